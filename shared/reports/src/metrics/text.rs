//! The text format: families of samples, each with type, unit and help text.

use std::fmt::Write as _;

use message::Histogram;
use quantity::number::float;

/// Exponents of the bucket bounds: powers of two in nanoseconds, from 16 µs to 268 ms. The histograms in shared
/// memory have bounds there too, so each count is exact.
const FIRST_BOUND: u32 = 14;
const LAST_BOUND: u32 = 28;
/// Quantiles over the whole incarnation.
const QUANTILES: [(&str, f64); 3] = [("0.5", 0.5), ("0.99", 0.99), ("0.999", 0.999)];

/// The units of OpenMetrics that names end in.
const UNITS: [&str; 7] = ["amperes", "bytes", "celsius", "hertz", "radians", "seconds", "volts"];

/// The type of a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Counter,
    Gauge,
    Histogram,
    Summary,
    Info,
}

impl Kind {
    const fn name(self) -> &'static str {
        match self {
            Self::Counter => "counter",
            Self::Gauge => "gauge",
            Self::Histogram => "histogram",
            Self::Summary => "summary",
            Self::Info => "info",
        }
    }
}

/// The text under construction. The header of a family is written with its first sample, so that no family is empty.
#[derive(Debug, Default)]
pub(crate) struct MetricsText {
    text: String,
    family: String,
    announcement: String,
}

/// A field of a reading that is exported: family name, help text, and its value.
pub(crate) type Field<T, V = u64> = (&'static str, &'static str, fn(&T) -> V);

/// The labels of a sample.
pub(crate) type Labels<'a> = &'a [(&'a str, &'a str)];

impl MetricsText {
    /// Starts a family. Its unit, if any, is the last word of the name.
    pub(crate) fn family(&mut self, name: &str, kind: Kind, help: &str) {
        name.clone_into(&mut self.family);
        self.announcement = format!("# TYPE {name} {}\n", kind.name());
        if let Some(unit) = name.rsplit('_').next().filter(|unit| UNITS.contains(unit)) {
            // Writing to a string cannot fail.
            let _ = writeln!(self.announcement, "# UNIT {name} {unit}");
        }
        let _ = writeln!(self.announcement, "# HELP {name} {}", escaped(help));
    }

    /// Adds a sample of the family: name with `suffix`, labels, value. Omits values that are not finite.
    pub(crate) fn sample(&mut self, suffix: &str, labels: Labels<'_>, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.text += &std::mem::take(&mut self.announcement);
        self.text += &self.family;
        self.text += suffix;
        for (place, (name, text)) in labels.iter().enumerate() {
            let before = if place == 0 { '{' } else { ',' };
            let _ = write!(self.text, "{before}{name}=\"{}\"", escaped(text));
        }
        if !labels.is_empty() {
            self.text.push('}');
        }
        let _ = writeln!(self.text, " {value}");
    }

    pub(crate) fn gauge(&mut self, labels: Labels<'_>, value: f64) {
        self.sample("", labels, value);
    }

    pub(crate) fn count(&mut self, labels: Labels<'_>, value: u64) {
        self.sample("_total", labels, float(value));
    }

    /// A family of gauges with one label.
    pub(crate) fn gauges(
        &mut self,
        name: &str,
        help: &str,
        label: &str,
        rows: impl IntoIterator<Item = (impl AsRef<str>, f64)>,
    ) {
        self.family(name, Kind::Gauge, help);
        for (text, value) in rows {
            self.gauge(&[(label, text.as_ref())], value);
        }
    }

    /// A family of counters for each field, with a sample per row; rows are named by the label.
    pub(crate) fn counters<'a, T: 'a>(
        &mut self,
        fields: &[Field<T>],
        label: &str,
        rows: impl IntoIterator<Item = (impl AsRef<str>, &'a T)>,
    ) {
        let rows: Vec<_> = rows.into_iter().collect();
        for (name, help, of) in fields {
            self.family(name, Kind::Counter, help);
            for (text, row) in &rows {
                self.count(&[(label, text.as_ref())], of(row));
            }
        }
    }

    /// Adds the bucket samples of a histogram.
    pub(crate) fn buckets(&mut self, labels: Labels<'_>, histogram: &Histogram) {
        let mut buckets = histogram.buckets().peekable();
        let mut count = 0;
        for exponent in FIRST_BOUND..=LAST_BOUND {
            let bound = 1_u64 << exponent;
            while let Some((_, more)) = buckets.next_if(|(max, _)| *max < bound) {
                count += u64::from(more);
            }
            let le = (float(bound) / 1e9).to_string();
            self.sample("_bucket", &[labels, &[("le", &le)]].concat(), float(count));
        }
        count += buckets.map(|(_, more)| u64::from(more)).sum::<u64>();
        self.sample("_bucket", &[labels, &[("le", "+Inf")]].concat(), float(count));
    }

    /// Adds the quantiles of a histogram in seconds, and its count.
    pub(crate) fn quantiles(&mut self, labels: Labels<'_>, histogram: &Histogram) {
        for (name, quantile) in QUANTILES {
            let seconds = seconds(histogram.quantile_ns(quantile));
            self.sample("", &[labels, &[("quantile", name)]].concat(), seconds);
        }
        self.sample("_count", labels, float(histogram.count()));
    }

    /// The whole text.
    pub(crate) fn end(mut self) -> String {
        self.text += "# EOF\n";
        self.text
    }
}

/// The value of a gauge of something that is so or not.
pub(crate) fn one_if(is_so: bool) -> f64 {
    f64::from(u8::from(is_so))
}

pub(crate) fn seconds(nanos: u64) -> f64 {
    float(nanos) / 1e9
}

fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

//! Judges the wake-up latency of a thread against its period.

use std::time::Duration;

use message::Histogram;

use super::Finding;

/// Limits of the wake-up latency as fractions of the period: 1/10 for the p99.9, 1/2 for the maximum. Beyond half of
/// the period, a cycle's computation no longer fits.
const P999_DIVISOR: u32 = 10;
const MAX_DIVISOR: u32 = 2;

/// Wake-up latency of a thread that only sleeps until the releases of a process.
#[derive(Clone, Debug)]
pub struct Wakeup {
    /// The process.
    pub process: &'static str,
    /// Time between two releases.
    pub period: Duration,
    /// Time from release to running.
    pub late: Histogram,
}

/// Whether the process can keep its rate.
#[must_use]
pub fn judge(wakeup: &Wakeup) -> Finding {
    let Wakeup { process, period, late } = wakeup;
    let about = format!("wake-up of {process}");
    let at = |quantile| Duration::from_nanos(late.quantile_ns(quantile));
    let micros = |time: Duration| time.as_micros();
    let max = Duration::from_nanos(late.max_ns());
    let text = format!(
        "{:.0} Hz: p50 {}, p99 {}, p99.9 {}, max {} µs of a period of {}, in {} releases",
        1.0 / period.as_secs_f64(),
        micros(at(0.5)),
        micros(at(0.99)),
        micros(at(0.999)),
        micros(max),
        micros(*period),
        late.count(),
    );
    if late.count() == 0 {
        return Finding::slower(
            &about,
            "no release was seen: the time was too short",
            "leo check --seconds 10",
        );
    }
    if at(0.999) <= *period / P999_DIVISOR && max <= *period / MAX_DIVISOR {
        Finding::good(&about, text)
    } else {
        let mend = "the lines above that are not good; then look for other programs: `ps -eLo rtprio,psr,pcpu,comm \
                    --sort -rtprio`";
        Finding::slower(&about, format!("{text}: too late for it"), mend)
    }
}

use std::path::{Path, PathBuf};

use belief::percepts::Percepts;
use message::{MAX_SOURCES, NAME_CAPACITY, Name};
use serde::Deserialize;
use settings::number::{Coordinate, Hertz, NotNegative};

/// A sensory source: a process or recording that delivers observations. Its number, and that of its topic, is its index
/// in the list, from zero.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Its name in texts for people.
    pub name: String,
    /// The kind of source.
    pub kind: SourceKind,
    /// The frame of its observations; the robot's base frame if absent.
    pub frame: Option<SourceFrame>,
    /// Expected frames per second; if absent, the source is not monitored.
    pub rate_hz: Option<Hertz>,
    /// Standard deviation of its reported positions along each axis, in metres; 0 if absent.
    pub position_sd_m: Option<NotNegative>,
    /// Traces only: the file.
    pub file: Option<PathBuf>,
    /// Traces only: which recorded source is played; may be absent if the trace has only one.
    pub recorded_source: Option<u16>,
    /// Traces only: whether playback restarts at the end; if absent, it stops there.
    pub repeat: Option<bool>,
}

/// The kind of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceKind {
    /// The built-in simulator.
    Simulator,
    /// Any process of this machine. It is ignored in simulated time, because an external process does not know that
    /// time.
    External,
    /// A recording, played by the sensor process itself; it also works in simulated time.
    Trace,
}

/// The pose of a source's frame in the robot's base frame.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawFrame")]
pub struct SourceFrame {
    /// Its origin, in metres.
    pub position_m: [f64; 3],
    /// Its orientation, unit quaternion `[x, y, z, w]`.
    pub orientation_xyzw: [f64; 4],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFrame {
    position_m: [Coordinate; 3],
    heading_deg: Option<f64>,
    orientation_xyzw: Option<[f64; 4]>,
}

impl TryFrom<RawFrame> for SourceFrame {
    type Error = String;

    fn try_from(written: RawFrame) -> Result<Self, String> {
        let orientation_xyzw = match (written.heading_deg, written.orientation_xyzw) {
            (Some(degrees), None) if (-360.0..=360.0).contains(&degrees) => {
                let half = degrees.to_radians() / 2.0;
                [0.0, 0.0, half.sin(), half.cos()]
            }
            (Some(degrees), None) => {
                return Err(format!("heading_deg = {degrees} is out of range: it must be from -360 to 360"));
            }
            (None, Some(orientation)) => {
                let norm = orientation.iter().map(|part| part * part).sum::<f64>().sqrt();
                // Written so that NaN is rejected.
                if (norm - 1.0).abs() < 0.01 {
                    orientation.map(|part| part / norm)
                } else {
                    return Err(format!(
                        "orientation_xyzw has the norm {norm}: that of a quaternion is 1, within 1 %"
                    ));
                }
            }
            (None, None) | (Some(_), Some(_)) => {
                return Err("a frame has either heading_deg or orientation_xyzw".to_owned());
            }
        };
        Ok(Self { position_m: written.position_m.map(Coordinate::get), orientation_xyzw })
    }
}

impl Source {
    /// Resolves a trace's path relative to the configuration's folder.
    pub(crate) fn relative_to(&mut self, folder: &Path) {
        if let Some(file) = &mut self.file {
            *file = folder.join(&*file);
        }
    }

    /// The error about a missing key, or about a key of another kind of source; `None` if the keys are right.
    fn key_error(&self) -> Option<String> {
        let name = &self.name;
        if self.kind == SourceKind::Trace {
            return match (&self.file, self.rate_hz) {
                (None, _) => Some(format!("the trace `{name}` needs a `file`")),
                (Some(_), Some(_)) => {
                    Some(format!("the trace `{name}` has the rhythm of its recording: leave out `rate_hz`"))
                }
                (Some(_), None) => None,
            };
        }
        let stray = [
            ("file", self.file.is_some()),
            ("recorded_source", self.recorded_source.is_some()),
            ("repeat", self.repeat.is_some()),
        ];
        let (key, _) = stray.iter().find(|(_, is_there)| *is_there)?;
        Some(format!("`{name}` is no trace: `{key}` is for sources with kind = \"trace\""))
    }

    /// Factor on its observations' confidence, in [0, 1]; 1 without noise.
    ///
    /// It is the probability P(|e| < r) that the position error e lies within the belief system's association distance
    /// r. With a normal error of standard deviation σ along each of three axes this is erf(u) − 2u/√π · exp(−u²) with u
    /// = r/(σ√2).
    #[must_use]
    pub fn confidence(&self, percepts: &Percepts) -> f64 {
        let sd_m = self.position_sd_m.map_or(0.0, NotNegative::get);
        let reach = percepts.association_distance_m() / (sd_m * std::f64::consts::SQRT_2);
        if reach.is_finite() {
            libm::erf(reach) - std::f64::consts::FRAC_2_SQRT_PI * reach * (-reach * reach).exp()
        } else {
            1.0
        }
    }
}

/// The first error in a list of sources: the index of the source, and the reason.
pub(crate) fn fault(sources: &[Source]) -> Option<(usize, String)> {
    let is_simulator = |source: &&Source| source.kind == SourceKind::Simulator;
    if sources.len() > MAX_SOURCES {
        return Some((
            MAX_SOURCES,
            format!("there are {} sources: at most {MAX_SOURCES} can be", sources.len()),
        ));
    }
    sources.iter().enumerate().find_map(|(index, source)| {
        let mut earlier = sources.iter().take(index);
        let reason = if source.name.trim().is_empty() {
            "a source needs a name".to_owned()
        } else if !Name::is_valid(&source.name) {
            format!("{:?} is not a name: it needs 1 to {NAME_CAPACITY} bytes, on one line", source.name)
        } else if earlier.clone().any(|earlier| earlier.name == source.name) {
            format!("there is a source `{}` already", source.name)
        } else if is_simulator(&source) && earlier.any(|earlier| is_simulator(&earlier)) {
            format!("`{}` is a second simulator: there is one", source.name)
        } else {
            source.key_error()?
        };
        Some((index, reason))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(more: &str) -> Result<Source, String> {
        let text = format!("name = \"camera\"\nkind = \"external\"\n{more}");
        crate::parse(&text, Path::new("x.toml")).map_err(|error| error.to_string())
    }

    #[test]
    fn a_source_reports_exactly_in_the_base_frame_by_default() {
        let source = source("").unwrap();
        assert_eq!((source.frame, source.rate_hz, source.position_sd_m), (None, None, None));
        assert!((source.confidence(&Percepts::builtin()) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_frame_is_turned_by_a_heading_or_by_a_quaternion() {
        let heading = source("frame = { position_m = [1, 0, 0.5], heading_deg = 90.0 }").unwrap();
        let quaternion =
            source("frame = { position_m = [1, 0, 0.5], orientation_xyzw = [0.0, 0.0, 0.7071, 0.7071] }")
                .unwrap();
        let (heading, quaternion) = (heading.frame.unwrap(), quaternion.frame.unwrap());
        let numbers = |frame: SourceFrame| frame.position_m.into_iter().chain(frame.orientation_xyzw);
        for (a, b) in numbers(heading).zip(numbers(quaternion)) {
            assert!((a - b).abs() < 1e-12, "{heading:?} {quaternion:?}");
        }
        assert!((heading.position_m[2] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn an_invalid_frame_is_refused_with_its_correction() {
        let mut wording = String::new();
        for (frame, word) in [
            ("{ position_m = [0, 0, 0] }", "heading_deg or orientation_xyzw"),
            (
                "{ position_m = [0, 0, 0], heading_deg = 1.0, orientation_xyzw = [0, 0, 0, 1] }",
                "heading_deg or",
            ),
            ("{ position_m = [0, 0, 0], orientation_xyzw = [0.0, 0.0, 0.0, 0.0] }", "norm 0"),
            ("{ position_m = [0, 0, 0], orientation_xyzw = [nan, 0.0, 0.0, 1.0] }", "norm NaN"),
            ("{ position_m = [0, nan, 0], heading_deg = 1.0 }", "-100 to 100 m"),
            ("{ position_m = [0, 0, 0], heading_deg = inf }", "-360 to 360"),
            ("{ position_m = [0, 0, 0], heading = 1.0 }", "`heading_deg`?"),
        ] {
            let error = source(&format!("frame = {frame}")).unwrap_err();
            assert!(error.starts_with("x.toml:3:") && error.contains(word), "{error}");
            wording += &format!("{frame}\n    {error}\n");
        }
        insta::assert_snapshot!(wording);
    }

    #[test]
    fn only_a_trace_has_a_file() {
        let trace = |more: &str| {
            let text = format!("name = \"a\"\nkind = \"trace\"\n{more}");
            fault(&[crate::parse(&text, Path::new("x.toml")).unwrap()]).map(|(_, reason)| reason)
        };
        assert_eq!(trace("file = \"a.jsonl\"\nrepeat = true\nrecorded_source = 2"), None);
        assert!(trace("").unwrap().contains("needs a `file`"));
        assert!(trace("file = \"a.jsonl\"\nrate_hz = 5.0").unwrap().contains("leave out `rate_hz`"));
        for stray in ["file = \"a\"", "repeat = false", "recorded_source = 0"] {
            let (_, reason) = fault(&[source(stray).unwrap()]).unwrap();
            assert!(reason.contains("`camera`") && reason.contains("kind = \"trace\""), "{reason}");
        }
    }

    #[test]
    fn confidence_decreases_with_the_noise_of_a_source() {
        let percepts = Percepts::builtin();
        let confidence =
            |sd_m: f64| source(&format!("position_sd_m = {sd_m:?}")).unwrap().confidence(&percepts);
        // Of the chi distribution with three degrees of freedom at 0.15 m / σ = 50, 3, 1.5 and 1.
        for (sd_m, expected) in [(0.003, 1.0), (0.05, 0.970_709), (0.1, 0.477_835), (0.15, 0.198_748)] {
            assert!((confidence(sd_m) - expected).abs() < 1e-5, "{sd_m}: {}", confidence(sd_m));
        }
        assert!(confidence(1e9) < 1e-20);
    }

    #[test]
    fn source_names_are_unique_and_at_most_one_is_the_simulator() {
        let make = |name: &str, kind| Source { name: name.to_owned(), kind, ..source("").unwrap() };
        let (simulator, external) = (SourceKind::Simulator, SourceKind::External);
        assert_eq!(fault(&[make("a", simulator), make("b", external)]), None);
        let said = |sources: &[Source]| fault(sources).unwrap();
        assert!(said(&[make("a", simulator), make("a", external)]).1.contains("already"));
        assert!(said(&[make("a", simulator), make("b", simulator)]).1.contains("second simulator"));
        assert_eq!(said(&[make("a", external), make(" ", external)]).0, 1);
        assert!(said(&[make(&"é".repeat(33), external)]).1.contains("1 to 64 bytes"));
        let many: Vec<Source> = (0..17).map(|index| make(&index.to_string(), external)).collect();
        assert!(said(&many).1.contains("17 sources"));
    }
}

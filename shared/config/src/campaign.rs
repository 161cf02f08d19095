//! A fault campaign: a file that schedules faults on the servo buses, in the percepts and in the processes.

use std::fmt::Display;
use std::path::Path;
use std::time::Duration;

use serde::Deserialize;
use settings::number::{NotNegative, UnitInterval};
use settings::{SettingsError, Spanned, error_at, parse};

/// The faults of one run.
///
/// ```
/// use config::campaign::{Campaign, PerceptFaultKind};
/// let campaign = config::parse::<Campaign>(
///     r#"
///     seed = 7
///     bus = ["drop bus=torso id=5 p=0.01"]
///     [[percepts]]
///     kind = "drop"
///     probability = 0.05
///     [[processes]]
///     kind = "kill"
///     process = "belief"
///     at_s = 3.0
///     "#,
///     "campaign.toml".as_ref(),
/// )?;
/// assert_eq!(campaign.percepts[0].kind, PerceptFaultKind::Drop);
/// # Ok::<(), config::SettingsError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// Seed of the random faults; the same seed gives the same faults.
    #[serde(default)]
    pub seed: u64,
    /// Faults on the mock servo buses, in the syntax of `leo mock-bus --fault`.
    #[serde(default)]
    pub bus: Vec<Spanned<String>>,
    /// Faults in the percepts, on their way to the belief systems.
    #[serde(default)]
    pub percepts: Vec<PerceptFault>,
    /// Faults of processes.
    #[serde(default)]
    pub processes: Vec<ProcessFault>,
}

/// A fault in the percepts.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerceptFault {
    /// The kind of fault.
    pub kind: PerceptFaultKind,
    /// Its probability, per percept snapshot; per frame for `reorder` and `freeze`.
    pub probability: UnitInterval,
    /// Its start, in seconds since the sensor process started; 0 if absent.
    #[serde(default)]
    pub start_s: Option<NotNegative>,
    /// Its duration in seconds; unlimited if absent.
    #[serde(default)]
    pub duration_s: Option<NotNegative>,
    /// The delay of a `delay` fault in milliseconds; 50 ms if absent.
    #[serde(default)]
    pub delay_ms: Option<NotNegative>,
}

/// A kind of fault in the percepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PerceptFaultKind {
    /// A percept snapshot is lost.
    Drop,
    /// A percept snapshot arrives late, in a later frame.
    Delay,
    /// A percept snapshot occurs twice.
    Duplicate,
    /// The snapshots of a frame are in another order.
    Reorder,
    /// The numbers of a percept snapshot are NaN.
    Nan,
    /// A frame repeats the content of the one before.
    Freeze,
}

/// A fault of a process.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessFault {
    /// The kind of fault.
    pub kind: ProcessFaultKind,
    /// The name of the process.
    pub process: Spanned<String>,
    /// Its start, in seconds since all processes are running.
    pub at_s: NotNegative,
    /// Its duration in seconds, for `stop` and `slow`; half a second if absent.
    #[serde(default)]
    pub duration_s: Option<NotNegative>,
}

/// A kind of fault of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProcessFaultKind {
    /// The process is killed.
    Kill,
    /// The process is paused for a while.
    Stop,
    /// The process is paused half of the time, for a while.
    Slow,
}

impl Campaign {
    /// Reads a campaign. `bus` checks the syntax of each bus fault, and `process` the name of each process.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is invalid, or `bus` or `process` rejects an entry. The error names the line.
    pub fn load<B: Display, P: Display>(
        file: &Path,
        bus: impl Fn(&str) -> Result<(), B>,
        process: impl Fn(&str) -> Result<(), P>,
    ) -> Result<Self, SettingsError> {
        let text = crate::text(file)?;
        Self::checked(&text, file, bus, process)
    }

    /// Checks the text of a campaign; errors name it as `file`.
    ///
    /// # Errors
    ///
    /// As [`Campaign::load`].
    pub fn checked<B: Display, P: Display>(
        text: &str,
        file: &Path,
        bus: impl Fn(&str) -> Result<(), B>,
        process: impl Fn(&str) -> Result<(), P>,
    ) -> Result<Self, SettingsError> {
        let campaign: Self = parse(text, file)?;
        for words in &campaign.bus {
            bus(words.get_ref()).map_err(|error| error_at(text, file, words.span(), error.to_string()))?;
        }
        for fault in &campaign.processes {
            let name = &fault.process;
            process(name.get_ref()).map_err(|error| error_at(text, file, name.span(), error.to_string()))?;
        }
        Ok(campaign)
    }

    /// The bus faults, as written.
    pub fn bus(&self) -> impl Iterator<Item = &str> {
        self.bus.iter().map(|words| words.get_ref().as_str())
    }
}

impl PerceptFault {
    /// Whether the fault is active `after` the start of the sensor process.
    #[must_use]
    pub fn is_on(&self, after: Duration) -> bool {
        let seconds = after.as_secs_f64();
        let from = self.start_s.map_or(0.0, NotNegative::get);
        seconds >= from && self.duration_s.is_none_or(|lasts| seconds < from + lasts.get())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invalid_campaign_fault_is_refused_with_its_position() {
        let refuse = |text: &str| parse::<Campaign>(text, Path::new("c.toml")).unwrap_err().to_string();
        let said = refuse("[[percepts]]\nkind = \"dorp\"\nprobability = 0.1");
        assert!(said.contains("c.toml:2") && said.contains("drop"), "{said}");
        let said = refuse("[[percepts]]\nkind = \"drop\"\nprobability = 7");
        assert!(said.contains("from 0 to 1"), "{said}");
        let said = refuse("[[processes]]\nkind = \"kill\"\nprocess = \"belief\"\nat_s = -1");
        assert!(said.contains("c.toml:4"), "{said}");
        assert!(parse::<Campaign>("", Path::new("c.toml")).is_ok());
    }

    #[test]
    fn a_fault_lasts_for_its_duration() {
        let text = "[[percepts]]\nkind = \"nan\"\nprobability = 1\nstart_s = 2\nduration_s = 3";
        let fault = parse::<Campaign>(text, Path::new("c.toml")).unwrap().percepts[0];
        let on = |ms| fault.is_on(Duration::from_millis(ms));
        assert_eq!([on(1999), on(2000), on(4999), on(5000)], [false, true, true, false]);
    }
}

//! A campaign of faults: one file that says what goes wrong on the servo buses, with the percepts and
//! with the processes, and when.

use std::fmt::Display;
use std::path::Path;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::load::{self, invalid};
use crate::number::{NotNegative, Unit};
use crate::{ConfigError, parse};

/// What goes wrong in a run, and when.
///
/// ```
/// use config::campaign::{Campaign, PerceptFaultKind};
/// let campaign = config::parse::<Campaign>(
///     r#"
///     seed = 7
///     bus = ["drop bus=torso id=5 p=0.01"]
///     [[percepts]]
///     kind = "drop"
///     chance = 0.05
///     [[processes]]
///     kind = "kill"
///     process = "belief"
///     at_s = 3.0
///     "#,
///     "campaign.toml".as_ref(),
/// )?;
/// assert_eq!(campaign.percepts[0].kind, PerceptFaultKind::Drop);
/// # Ok::<(), config::ConfigError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// The same seed makes the same faults.
    #[serde(default)]
    pub seed: u64,
    /// What goes wrong on the mock servo buses, in the words of `leo mock-bus --fault`.
    #[serde(default)]
    pub bus: Vec<Spanned<String>>,
    /// What goes wrong with the percepts, on their way to the belief systems.
    #[serde(default)]
    pub percepts: Vec<PerceptFault>,
    /// What goes wrong with the processes.
    #[serde(default)]
    pub processes: Vec<ProcessFault>,
}

/// Something that goes wrong with percepts.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerceptFault {
    /// What.
    pub kind: PerceptFaultKind,
    /// How probably: for each percept snapshot, or for each frame where the kind says so.
    pub chance: Unit,
    /// Not before this long after the sensor process began.
    #[serde(default)]
    pub from_s: Option<NotNegative>,
    /// For so long; without end, without it.
    #[serde(default)]
    pub for_s: Option<NotNegative>,
    /// How late a delayed one is; 50 ms without it.
    #[serde(default)]
    pub by_ms: Option<NotNegative>,
}

/// What can go wrong with percepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PerceptFaultKind {
    /// A percept snapshot is missing.
    Drop,
    /// One comes later, in another frame.
    Delay,
    /// One is there twice.
    Duplicate,
    /// Those of a frame come in another order.
    Reorder,
    /// The numbers of one are none.
    Nan,
    /// A frame says what the one before it said.
    Freeze,
}

/// Something that goes wrong with a process.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProcessFault {
    /// What.
    pub kind: ProcessFaultKind,
    /// With which process, by its name.
    pub process: Spanned<String>,
    /// How long after all of the robot runs.
    pub at_s: NotNegative,
    /// For so long, where it lasts; half a second without it.
    #[serde(default)]
    pub for_s: Option<NotNegative>,
}

/// What can go wrong with a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProcessFaultKind {
    /// It is killed.
    Kill,
    /// It stands still for a while.
    Stop,
    /// It stands still half of the time, for a while.
    Slow,
}

impl Campaign {
    /// Reads a campaign; `bus` and `process` look at what it says of buses and whether it names a
    /// process.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or says something that is none; the error says in which line.
    pub fn load<B: Display, P: Display>(
        file: &Path,
        bus: impl Fn(&str) -> Result<(), B>,
        process: impl Fn(&str) -> Result<(), P>,
    ) -> Result<Self, ConfigError> {
        let text = load::text(file)?;
        Self::checked(&text, file, bus, process)
    }

    /// Checks the text of a campaign; `file` is what errors call it.
    ///
    /// # Errors
    ///
    /// As [`Campaign::load`].
    pub fn checked<B: Display, P: Display>(
        text: &str,
        file: &Path,
        bus: impl Fn(&str) -> Result<(), B>,
        process: impl Fn(&str) -> Result<(), P>,
    ) -> Result<Self, ConfigError> {
        let campaign: Self = parse(text, file)?;
        for words in &campaign.bus {
            bus(words.get_ref()).map_err(|error| invalid(text, file, words.span(), error.to_string()))?;
        }
        for fault in &campaign.processes {
            let name = &fault.process;
            process(name.get_ref()).map_err(|error| invalid(text, file, name.span(), error.to_string()))?;
        }
        Ok(campaign)
    }

    /// What goes wrong on the buses, in words.
    pub fn bus(&self) -> impl Iterator<Item = &str> {
        self.bus.iter().map(|words| words.get_ref().as_str())
    }
}

impl PerceptFault {
    /// Whether it can happen `after` the beginning.
    #[must_use]
    pub fn is_on(&self, after: Duration) -> bool {
        let seconds = after.as_secs_f64();
        let from = self.from_s.map_or(0.0, NotNegative::get);
        seconds >= from && self.for_s.is_none_or(|lasts| seconds < from + lasts.get())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_fault_is_refused_where_it_stands() {
        let refuse = |text: &str| parse::<Campaign>(text, Path::new("c.toml")).unwrap_err().to_string();
        let said = refuse("[[percepts]]\nkind = \"dorp\"\nchance = 0.1");
        assert!(said.contains("c.toml:2") && said.contains("drop"), "{said}");
        let said = refuse("[[percepts]]\nkind = \"drop\"\nchance = 7");
        assert!(said.contains("from 0 to 1"), "{said}");
        let said = refuse("[[processes]]\nkind = \"kill\"\nprocess = \"belief\"\nat_s = -1");
        assert!(said.contains("c.toml:4"), "{said}");
        assert!(parse::<Campaign>("", Path::new("c.toml")).is_ok());
    }

    #[test]
    fn a_fault_lasts_as_long_as_it_says() {
        let text = "[[percepts]]\nkind = \"nan\"\nchance = 1\nfrom_s = 2\nfor_s = 3";
        let fault = parse::<Campaign>(text, Path::new("c.toml")).unwrap().percepts[0];
        let on = |ms| fault.is_on(Duration::from_millis(ms));
        assert_eq!([on(1999), on(2000), on(4999), on(5000)], [false, true, true, false]);
    }
}

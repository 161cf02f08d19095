use std::fmt;
use std::path::PathBuf;

use crate::survey::Lost;

/// What was found when a store was opened, other than that all is well.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// Damaged files.
    pub damaged: Vec<Damage>,
    /// What can be read nowhere any more.
    pub lost: Lost,
    /// Why it could not be mended yet. What can be read of it is there; it is mended before anything is written.
    pub unmended: Option<String>,
}

/// A damaged file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it, as a verb and what follows it.
    pub what: String,
    /// Where it is kept as it was; nowhere, where it is missing or could not be set aside yet.
    pub aside: Option<PathBuf>,
}

impl Findings {
    /// Whether all is well.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, Damage { file, what, aside }) in self.damaged.iter().enumerate() {
            let aside = aside
                .as_ref()
                .map_or_else(String::new, |aside| format!(", and is kept as {}", aside.display()));
            let and = if index == 0 { "" } else { "; " };
            write!(to, "{and}{} {what}{aside}", file.display())?;
        }
        if !self.damaged.is_empty() {
            if self.lost == Lost::Nothing {
                write!(to, ". Nothing that was learned is lost")?;
            } else {
                write!(to, ". {}", self.lost)?;
            }
        }
        if let Some(why) = &self.unmended {
            let and = if self.damaged.is_empty() { "" } else { ". " };
            write!(to, "{and}what was learned is readable, and cannot be added to: {why}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Lost {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => write!(to, "nothing is lost"),
            Self::Perhaps => write!(
                to,
                "what was learned last may be lost, and everything before it is there: `leo tasks list` shows it"
            ),
            Self::Records(count) => write!(
                to,
                "at least {count} of the examples, or changes of tasks, is lost, and everything else is there: \
                 `leo tasks list` shows it. Teach again what is missing"
            ),
            Self::Everything => write!(
                to,
                "nothing of what was learned can be read there: take it in again from an export (`leo tasks import`), \
                 or teach it again"
            ),
        }
    }
}

impl Lost {
    /// As a robot says it.
    pub(crate) fn in_short(self) -> String {
        match self {
            Self::Nothing => "nothing is lost".to_owned(),
            Self::Perhaps => "what I learned last may be lost".to_owned(),
            Self::Records(count) => format!("at least {count} of the examples, or changes of tasks, is lost"),
            Self::Everything => "all of it is lost".to_owned(),
        }
    }
}

use std::fmt;
use std::path::PathBuf;

use crate::survey::Lost;

/// The irregularities found when a store was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// Damaged files.
    pub damaged: Vec<Damage>,
    /// What is lost in both copies.
    pub lost: Lost,
    /// Why the store could not be repaired yet. It is readable; the repair comes before the next write.
    pub repair_error: Option<String>,
}

/// A damaged file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it, as a predicate ("is empty").
    pub what: String,
    /// The path of the unchanged copy; `None` if the file is missing or not set aside yet.
    pub aside: Option<PathBuf>,
}

impl Findings {
    /// Whether there are no irregularities.
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
        if let Some(why) = &self.repair_error {
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
    /// The phrase for the robot to say.
    pub(crate) fn in_short(self) -> String {
        match self {
            Self::Nothing => "nothing is lost".to_owned(),
            Self::Perhaps => "what I learned last may be lost".to_owned(),
            Self::Records(count) => format!("at least {count} of the examples, or changes of tasks, is lost"),
            Self::Everything => "all of it is lost".to_owned(),
        }
    }
}

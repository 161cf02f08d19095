use std::collections::BTreeSet;

use message::{NAME_CAPACITY, NOBODY, TEXT_CAPACITY};
use serde::Deserialize;

/// The robot's name in texts for people.
const ROBOT: &str = "Leo";
/// Maximum length of a name in bytes: a quarter of a text, so that a sentence about the agent still fits.
const LONGEST: usize = TEXT_CAPACITY / 4;
const _: () = assert!(LONGEST <= NAME_CAPACITY, "every name fits the board of symbols");

/// The agents' names in texts for people.
///
/// ```
/// let names = config::Robot::load(None)?.leo.belief.names;
/// assert_eq!([0, 1, 2].map(|agent| names.of(agent)), ["Leo", "the teacher", "partner 2"]);
/// # Ok::<(), config::SettingsError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(try_from = "Vec<String>")]
pub struct Names(Vec<String>);

impl TryFrom<Vec<String>> for Names {
    type Error = String;

    fn try_from(names: Vec<String>) -> Result<Self, String> {
        let mut known = BTreeSet::from([ROBOT]);
        for name in &names {
            if name.trim().is_empty() || name.chars().any(char::is_control) || name.len() > LONGEST {
                return Err(format!("{name:?} is not a name: it needs 1 to {LONGEST} bytes, on one line"));
            }
            if !known.insert(name) {
                return Err(format!("{name:?} is used twice: every name must be unique"));
            }
        }
        Ok(Self(names))
    }
}

impl Names {
    /// The name of an agent: "Leo" for the robot; a partner's configured name, or "partner N" without one.
    #[must_use]
    pub fn of(&self, agent: u16) -> String {
        match agent {
            0 => ROBOT.to_owned(),
            NOBODY => "somebody".to_owned(),
            partner => {
                let name = self.0.get(usize::from(partner - 1));
                name.cloned().unwrap_or_else(|| format!("partner {partner}"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Result<Names, String> {
        Names::try_from(names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn an_unnamed_agent_is_called_by_its_number() {
        let anna = names(&["Anna"]).unwrap();
        assert_eq!([1, 2, NOBODY].map(|agent| anna.of(agent)), ["Anna", "partner 2", "somebody"]);
    }

    #[test]
    fn duplicate_names_are_refused() {
        for wrong in [&["Leo"][..], &["Anna", "Anna"], &[""], &["  "], &["a\nb"], &[&"x".repeat(64)]] {
            assert!(names(wrong).is_err(), "{wrong:?}");
        }
    }
}

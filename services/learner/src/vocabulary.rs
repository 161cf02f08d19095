use belief::percepts::{Kernel, Percepts, Role, Space, StateName};
use config::Names;
use tasks::{Effect, FeatureWords, Language, Learned, Signature, StateWords};

use crate::report::expectation;

/// The learner's names for percepts, from the percept configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Vocabulary {
    /// The features and states for rules.
    pub language: Language,
    /// The state that [`crate::Skill::Insert`] causes in the block, and the one in the inserted peg; `None` if the
    /// configuration has no percepts for them.
    pub(crate) insertion: Option<Insertion>,
    /// The state that a marker on an object causes; `None` if there is no such percept.
    pub(crate) marked: Option<String>,
    /// The names of the partners.
    pub(crate) names: Names,
}

/// The names of the states of a filled block and of an inserted peg.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Insertion {
    pub(crate) filled: String,
    pub(crate) inserted: String,
}

/// The error for a percept set that does not allow learning.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VocabularyError {
    /// No percept provides positions.
    #[error("percepts: no percept has the kernel \"position\": tasks cannot be learned without; add one")]
    NoPosition,
    /// No state can be the expectation of a goal.
    #[error("percepts: no percept with a state has the role \"expectation\": add one, such as \"filled\"")]
    NoExpectation,
}

/// An object counts as moved if its position differs by more than this, in metres.
const MOVED_M: f64 = 0.03;

impl Vocabulary {
    /// The vocabulary of a percept set. The shape is the noun and comes last.
    ///
    /// # Errors
    /// [`VocabularyError`] if nothing could be learned with these percepts.
    pub fn of(percepts: &Percepts) -> Result<Self, VocabularyError> {
        let (mut features, mut nouns, mut states) = (Vec::new(), Vec::new(), Vec::new());
        let (mut position, mut orientation, mut extents) = (None, None, None);
        let (mut filled, mut inserted, mut marked) = (None, None, None);
        for (index, percept) in (0_u16..).zip(&percepts.percepts) {
            let is_criterion = percept.role == Role::Criteria;
            match &percept.kernel {
                Kernel::Position => position = position.or(Some(index)),
                Kernel::Orientation => orientation = orientation.or(Some(index)),
                Kernel::Extents => extents = extents.or(Some(index)),
                Kernel::Nearest(nearest) if is_criterion => {
                    let words = FeatureWords {
                        percept: index,
                        name: percept.name.clone(),
                        values: percept.symbols().map(str::to_owned).collect(),
                    };
                    if nearest.space == Space::Shape { nouns.push(words) } else { features.push(words) }
                }
                Kernel::State(state) if percept.role == Role::Expectation => {
                    match state {
                        StateName::Filled => filled = Some(percept.name.clone()),
                        StateName::Inserted => inserted = Some(percept.name.clone()),
                        StateName::Marked => marked = Some(percept.name.clone()),
                        StateName::On => {}
                    }
                    states.push(StateWords { percept: index, name: percept.name.clone() });
                }
                Kernel::State(_)
                | Kernel::Source
                | Kernel::Nearest(_)
                | Kernel::Region(_)
                | Kernel::Range(_)
                | Kernel::Plugin(_) => {}
            }
        }
        features.append(&mut nouns);
        if states.is_empty() {
            return Err(VocabularyError::NoExpectation);
        }
        let position = position.ok_or(VocabularyError::NoPosition)?;
        let insertion = filled.zip(inserted).map(|(filled, inserted)| Insertion { filled, inserted });
        let language = Language { features, states, position, orientation, extents, moved_m: MOVED_M };
        Ok(Self { language, insertion, marked, names: Names::default() })
    }

    /// A copy with the names of the partners.
    #[must_use]
    pub fn with_names(self, names: &Names) -> Self {
        Self { names: names.clone(), ..self }
    }

    /// The insertion, if it achieves exactly this expectation.
    pub(crate) fn fills(&self, expected: &Signature) -> Option<&Insertion> {
        self.insertion.as_ref().filter(|insertion| is_only(expected, &insertion.filled))
    }

    /// The state of a marked object, if it is exactly this expectation.
    pub(crate) fn marks(&self, expected: &Signature) -> Option<&String> {
        self.marked.as_ref().filter(|marked| is_only(expected, marked))
    }

    /// The part of a task for which Leo has no skill, in words; `None` if it can perform all of it.
    pub(crate) fn missing_skill(&self, learned: &Learned) -> Option<String> {
        if !learned.arrangements.is_empty() {
            return None;
        }
        let mut rules = learned.primary();
        let rule = rules.find(|rule| {
            self.fills(&rule.expectation).is_none() && self.marks(&rule.expectation).is_none()
        })?;
        Some(no_skill(&expectation(rule)))
    }
}

/// The sentence about a missing skill.
pub(crate) fn no_skill(wanted: &str) -> String {
    format!("I have no skill that makes a thing {wanted}")
}

fn is_only(expected: &Signature, state: &str) -> bool {
    let is_it = |effect: &Effect| matches!(effect, Effect::State { name, on: true } if name == state);
    expected.len() == 1 && expected.iter().all(is_it)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_percepts_have_words_and_the_noun_comes_last() {
        let vocabulary = Vocabulary::of(&Percepts::builtin()).unwrap();
        let names: Vec<&str> = vocabulary.language.features.iter().map(|words| words.name.as_str()).collect();
        assert_eq!(names, ["size", "colour", "shape"]);
        assert!(vocabulary.language.states.iter().any(|words| words.name == "filled"));
        assert!(vocabulary.insertion.is_some());
    }

    #[test]
    fn percepts_without_a_place_are_refused() {
        let mut percepts = Percepts::builtin();
        percepts.percepts.retain(|percept| percept.kernel != Kernel::Position);
        assert_eq!(Vocabulary::of(&percepts), Err(VocabularyError::NoPosition));
    }
}

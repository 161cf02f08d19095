//! The words that examples use.

use std::collections::BTreeSet;

use tasks::{FeatureWords, Language, MAX_FEATURES, MAX_VALUES, StateWords};

/// Minimum displacement that counts as a move, as in the learner.
const MOVED_M: f64 = 0.03;
/// The features, values and states that occur in the examples.
#[derive(Default)]
pub(super) struct Vocabulary {
    /// In the order of speech.
    features: Vec<FeatureWords>,
    declared: bool,
    states: BTreeSet<String>,
}

impl Vocabulary {
    /// Sets the features of the header, in the order of speech.
    ///
    /// # Errors
    /// The field of the header, and the error.
    pub(super) fn declare(&mut self, names: &[String]) -> Result<(), (String, String)> {
        for (index, name) in names.iter().enumerate() {
            let field = || format!("features[{index}]: ");
            if name.trim().is_empty() || self.features.iter().any(|known| known.name == *name) {
                return Err((field(), format!("`{name}` is not a name, or is a duplicate")));
            }
            self.add(name).map_err(|reason| (field(), reason))?;
        }
        self.declared = !names.is_empty();
        Ok(())
    }

    fn add(&mut self, name: &str) -> Result<(), String> {
        if self.features.len() >= MAX_FEATURES {
            return Err(format!("`{name}` is one feature too many: there can be {MAX_FEATURES}"));
        }
        self.features.push(FeatureWords { percept: 0, name: name.to_owned(), values: Vec::new() });
        Ok(())
    }

    /// Adds a value of a feature.
    pub(super) fn note(&mut self, name: &str, value: &str) -> Result<(), String> {
        if !self.features.iter().any(|known| known.name == name) {
            if self.declared {
                let known: Vec<&str> = self.features.iter().map(|known| known.name.as_str()).collect();
                let known = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
                return Err(config::suggest(&format!("unknown field `{name}`, the header names {known}")));
            }
            self.add(name)?;
            // Without a header the order of speech is unknown, so sort by name.
            self.features.sort_by(|a, b| a.name.cmp(&b.name));
        }
        let Some(words) = self.features.iter_mut().find(|known| known.name == name) else { return Ok(()) };
        if !words.values.iter().any(|known| known == value) {
            if words.values.len() >= MAX_VALUES {
                return Err(format!(
                    "`{value}` is one value of `{name}` too many: there can be {MAX_VALUES}"
                ));
            }
            words.values.push(value.to_owned());
        }
        Ok(())
    }

    /// Adds states.
    pub(super) fn note_states<'a>(&mut self, names: impl Iterator<Item = &'a String>) {
        self.states.extend(names.cloned());
    }

    /// All words as a language.
    pub(super) fn language(self) -> Language {
        let states = self.states.into_iter().map(|name| StateWords { percept: 0, name });
        Language {
            features: self.features,
            states: states.collect(),
            position: 0,
            orientation: None,
            extents: None,
            moved_m: MOVED_M,
        }
    }
}

use serde::Deserialize;
use tasks::{HypothesisLanguage, Noise};

use crate::leo::{Depth, Leo};

/// The settings of `leo.toml` that a lesson needs beyond the built-in ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Needs {
    /// Minimum number of partners.
    pub partners: Option<u32>,
    /// Minimum nesting depth of perspectives.
    pub depth: Option<Depth>,
    /// The hypothesis language.
    pub language: Option<HypothesisLanguage>,
    /// Minimum label noise.
    pub noise: Option<Noise>,
}

impl Needs {
    /// The settings that a robot lacks, as lines for its `leo.toml`; `None` if it has all of them.
    #[must_use]
    pub fn lacking(&self, leo: &Leo) -> Option<String> {
        let (belief, learner) = (&leo.belief, &leo.learner);
        let lacking: Vec<String> = [
            self.partners.filter(|min| belief.partners < *min).map(|min| format!("partners = {min}")),
            self.depth
                .filter(|min| belief.depth.get() < min.get())
                .map(|min| format!("depth = {}", min.get())),
            self.language
                .filter(|language| learner.language != *language)
                .map(|language| format!("language = \"{}\"", language.word())),
            self.noise
                .filter(|min| learner.noise.get() < min.get())
                .map(|min| format!("noise = {}", min.get())),
        ]
        .into_iter()
        .flatten()
        .map(|setting| format!("`{setting}`"))
        .collect();
        (!lacking.is_empty()).then(|| lacking.join(" and "))
    }

    /// Whether the built-in settings suffice.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

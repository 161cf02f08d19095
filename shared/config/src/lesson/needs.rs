use serde::Deserialize;

use crate::leo::{Depth, Hypotheses, Leo};
use crate::number::Slips;

/// What of `leo.toml` a lesson needs to show what it is about, where the built-in settings do not do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Needs {
    /// So many partners at least.
    pub partners: Option<u32>,
    /// Perspectives nested so deep at least.
    pub depth: Option<Depth>,
    /// This language.
    pub language: Option<Hypotheses>,
    /// A teacher who slips so often at least.
    pub noise: Option<Slips>,
}

impl Needs {
    /// What of it a robot lacks, as it is to be written in its `leo.toml`; `None` where that does.
    #[must_use]
    pub fn lacking(&self, leo: &Leo) -> Option<String> {
        let (belief, learner) = (&leo.belief, &leo.learner);
        let lacking: Vec<String> = [
            self.partners.filter(|least| belief.partners < *least).map(|least| format!("partners = {least}")),
            self.depth
                .filter(|least| belief.depth.get() < least.get())
                .map(|least| format!("depth = {}", least.get())),
            self.language
                .filter(|language| learner.language != *language)
                .map(|language| format!("language = \"{}\"", language.word())),
            self.noise
                .filter(|least| learner.noise.get() < least.get())
                .map(|least| format!("noise = {}", least.get())),
        ]
        .into_iter()
        .flatten()
        .map(|setting| format!("`{setting}`"))
        .collect();
        (!lacking.is_empty()).then(|| lacking.join(" and "))
    }

    /// Whether there is nothing that it needs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

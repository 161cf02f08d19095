/// What the percepts of a belief are called, and which of them may stand in a rule.
///
/// It is the learner's view of the configured percept set: class features may be criteria of a
/// goal belief, states may be its expectations.
#[derive(Clone, Debug, PartialEq)]
pub struct Language {
    /// Class features in the order in which people say them, the noun last (size, colour, shape).
    pub features: Vec<FeatureWords>,
    /// States that an act may change.
    pub states: Vec<StateWords>,
    /// The percept whose feature is the position in the perspective's frame.
    pub position: u16,
    /// The percept whose feature is the orientation in the perspective's frame, where there is one.
    pub orientation: Option<u16>,
    /// The percept whose feature is half the extents, where there is one.
    pub extents: Option<u16>,
    /// An object has moved when its place differs by more than this, in metres.
    pub moved_m: f64,
}

/// A class feature: its percept and what its symbols are called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeatureWords {
    /// The percept.
    pub percept: u16,
    /// The feature's name ("colour").
    pub name: String,
    /// What its symbols are called, in the order of the symbols' numbers.
    pub values: Vec<String>,
}

/// A state: its percept and its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StateWords {
    /// The percept, whose feature is the degree of the state in [0, 1].
    pub percept: u16,
    /// The state's name ("filled").
    pub name: String,
}

impl Language {
    /// Where a feature stands in the order of speech; features that are not known stand last.
    #[must_use]
    pub(crate) fn feature_order(&self, name: &str) -> usize {
        self.features.iter().position(|feature| feature.name == name).unwrap_or(usize::MAX)
    }

    /// Where a value stands in its feature; values that are not known stand last.
    #[must_use]
    pub(crate) fn value_order(&self, feature: &str, value: &str) -> usize {
        self.features
            .iter()
            .find(|words| words.name == feature)
            .and_then(|words| words.values.iter().position(|known| known == value))
            .unwrap_or(usize::MAX)
    }
}

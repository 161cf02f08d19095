//! The names of the percepts.

/// The learner's view of the configured percept set: names, and which percepts a rule may use.
///
/// Class features may be criteria of a goal belief; states may be its expectations.
#[derive(Clone, Debug, PartialEq)]
pub struct Language {
    /// Class features in the order of speech, the noun last (size, colour, shape).
    pub features: Vec<FeatureWords>,
    /// States that an act may change.
    pub states: Vec<StateWords>,
    /// The percept whose feature is the position, in the frame of the perspective.
    pub position: u16,
    /// The percept whose feature is the orientation in the frame of the perspective, if any.
    pub orientation: Option<u16>,
    /// The percept whose feature is half the extents, if any.
    pub extents: Option<u16>,
    /// An object counts as moved if its position differs by more than this, in metres.
    pub moved_m: f64,
}

/// A class feature: its percept and the names of its symbols.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeatureWords {
    /// The percept.
    pub percept: u16,
    /// The feature's name ("colour").
    pub name: String,
    /// The names of its symbols, indexed by symbol number.
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
    /// Index of a feature in the order of speech; `usize::MAX` for unknown features.
    #[must_use]
    pub(crate) fn feature_order(&self, name: &str) -> usize {
        self.features.iter().position(|feature| feature.name == name).unwrap_or(usize::MAX)
    }

    /// Index of a value in its feature; `usize::MAX` for unknown values.
    #[must_use]
    pub(crate) fn value_order(&self, feature: &str, value: &str) -> usize {
        self.features
            .iter()
            .find(|words| words.name == feature)
            .and_then(|words| words.values.iter().position(|known| known == value))
            .unwrap_or(usize::MAX)
    }
}

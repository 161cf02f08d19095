use std::fmt;

use crate::bytes::message;
use crate::{FeatureKind, MAX_PERCEPTS, MAX_PERSPECTIVES, ZeroCopySend, fill, filled, wire_enum};

/// Capacity of a [`Name`] in bytes.
pub const NAME_CAPACITY: usize = 64;
/// Maximum number of named symbols of one percept.
pub const MAX_SYMBOLS: usize = 64;
/// Raw kind of the feature of a plug-in percept: the plug-in decides it for each observation.
const ANY_FEATURE: u16 = u16::MAX;
/// Raw number of a missing parent.
const NO_PARENT: u16 = u16::MAX;

wire_enum! {
    /// The role of a percept in goal beliefs.
    PerceptRole: u16 {
        /// It selects the objects that are meant.
        Criteria = 0 as "criteria",
        /// It describes the state that the objects are to reach.
        Expectation = 1 as "expectation",
        /// Goal beliefs ignore it.
        Neither = 2 as "neither",
    }
}

wire_enum! {
    /// The classifier of a percept.
    PerceptKernel: u16 {
        /// The position, in the frame of the perspective.
        Position = 0 as "position",
        /// The orientation, in the frame of the perspective.
        Orientation = 1 as "orientation",
        /// Half the extents along the object's own axes.
        Extents = 2 as "extents",
        /// The number of the source that observed the object.
        Source = 3 as "source",
        /// The degree of a state, from 0 to 1.
        State = 4 as "state",
        /// The nearest prototype of shape.
        NearestShape = 5 as "nearest shape",
        /// The nearest prototype of colour.
        NearestColour = 6 as "nearest colour",
        /// The nearest prototype of size.
        NearestSize = 7 as "nearest size",
        /// 1 inside a box of the perspective's frame, 0 outside.
        Region = 8 as "region",
        /// The degree to which a number of the parent's feature is within limits, from 0 to 1.
        Range = 9 as "range",
        /// A classifier of the program itself.
        Plugin = 10 as "plugin",
    }
}

wire_enum! {
    /// The unit of a feature's numbers.
    FeatureUnit: u16 {
        /// None: a symbol, a degree, a quaternion, or the feature of a plug-in.
        None = 0 as "",
        /// Metres.
        Metres = 1 as "m",
    }
}

impl PerceptKernel {
    /// The kind of its features; `None` if a plug-in decides it.
    #[must_use]
    pub const fn feature_kind(self) -> Option<FeatureKind> {
        match self {
            Self::Position | Self::Extents => Some(FeatureKind::Vector),
            Self::Orientation => Some(FeatureKind::Orientation),
            Self::Source | Self::NearestShape | Self::NearestColour | Self::NearestSize => {
                Some(FeatureKind::Symbol)
            }
            Self::State | Self::Region | Self::Range => Some(FeatureKind::Number),
            Self::Plugin => None,
        }
    }

    /// The unit of its features.
    #[must_use]
    pub const fn unit(self) -> FeatureUnit {
        match self {
            Self::Position | Self::Extents => FeatureUnit::Metres,
            Self::Orientation
            | Self::Source
            | Self::State
            | Self::NearestShape
            | Self::NearestColour
            | Self::NearestSize
            | Self::Region
            | Self::Range
            | Self::Plugin => FeatureUnit::None,
        }
    }
}

message! {
    /// A short name of fixed capacity, UTF-8.
    #[derive(PartialEq, Eq)]
    pub struct Name as "leo/Name/1" {
        /// Its length in bytes.
        length: u32,
        /// Its bytes; those beyond its length are zero.
        bytes: [u8; NAME_CAPACITY],
    }
}

impl Name {
    const EMPTY: Self = Self { length: 0, bytes: [0; NAME_CAPACITY] };

    /// Whether a text is a name that fits: 1 to [`NAME_CAPACITY`] bytes on one line.
    #[must_use]
    pub fn is_valid(text: &str) -> bool {
        !text.trim().is_empty() && text.len() <= NAME_CAPACITY && !text.chars().any(char::is_control)
    }

    /// The name, truncated at a character boundary if it does not fit.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut end = text.len().min(NAME_CAPACITY);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let mut name = Self::EMPTY;
        for (to, from) in name.bytes.iter_mut().zip(text.bytes().take(end)) {
            *to = from;
            name.length += 1;
        }
        name
    }

    /// The name; empty if the bytes are not UTF-8 or the length is out of range.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let length = usize::try_from(self.length).ok();
        let bytes = length.and_then(|length| self.bytes.get(..length));
        bytes.and_then(|bytes| std::str::from_utf8(bytes).ok()).unwrap_or("")
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().fmt(out)
    }
}

message! {
    /// What a percept number in beliefs and snapshots means.
    #[derive(Debug, PartialEq, Eq)]
    pub struct PerceptDescription as "leo/PerceptDescription/1" {
        /// Its unique name in `percepts.toml`.
        pub name: Name,
        /// Its `PerceptRole`.
        role: u16,
        /// Its `PerceptKernel`.
        kernel: u16,
        /// The `FeatureKind` of its features; 65535 if a plug-in decides it.
        feature_kind: u16,
        /// The `FeatureUnit` of its features.
        unit: u16,
        /// The number of the percept that gates it; 65535 if there is none.
        parent: u16,
        /// Zero.
        reserved: u16,
        /// The number of its named symbols.
        symbol_count: u32,
        /// Their names, by number. A symbol beyond the count has no name.
        symbols: [Name; MAX_SYMBOLS],
    }
}

impl PerceptDescription {
    const EMPTY: Self = Self {
        name: Name::EMPTY,
        role: 0,
        kernel: 0,
        feature_kind: 0,
        unit: 0,
        parent: NO_PARENT,
        reserved: 0,
        symbol_count: 0,
        symbols: [Name::EMPTY; MAX_SYMBOLS],
    };

    /// A description without symbols; the kernel determines kind and unit of the feature.
    #[must_use]
    pub fn new(name: &str, role: PerceptRole, kernel: PerceptKernel, parent: Option<u16>) -> Self {
        Self {
            name: Name::new(name),
            role: role.raw(),
            kernel: kernel.raw(),
            feature_kind: kernel.feature_kind().map_or(ANY_FEATURE, FeatureKind::raw),
            unit: kernel.unit().raw(),
            parent: parent.unwrap_or(NO_PARENT),
            ..Self::EMPTY
        }
    }

    /// Names the next symbol; `false` if there are [`MAX_SYMBOLS`] already.
    pub fn push_symbol(&mut self, name: &str) -> bool {
        fill(&mut self.symbols, &mut self.symbol_count, Name::new(name))
    }

    /// Its role; `None` if the number is invalid.
    #[must_use]
    pub fn role(&self) -> Option<PerceptRole> {
        PerceptRole::from_raw(self.role)
    }

    /// Its classifier; `None` if the number is invalid.
    #[must_use]
    pub fn kernel(&self) -> Option<PerceptKernel> {
        PerceptKernel::from_raw(self.kernel)
    }

    /// The kind of its features; `None` if a plug-in decides it, or the number is invalid.
    #[must_use]
    pub fn feature_kind(&self) -> Option<FeatureKind> {
        FeatureKind::from_raw(self.feature_kind)
    }

    /// The unit of its features; `None` if the number is invalid.
    #[must_use]
    pub fn unit(&self) -> Option<FeatureUnit> {
        FeatureUnit::from_raw(self.unit)
    }

    /// The number of the percept that gates it.
    #[must_use]
    pub fn parent(&self) -> Option<u16> {
        Some(self.parent).filter(|parent| usize::from(*parent) < MAX_PERCEPTS)
    }

    /// The names of its symbols, by number.
    #[must_use]
    pub fn symbols(&self) -> &[Name] {
        filled(&self.symbols, self.symbol_count)
    }
}

message! {
    /// The names of what beliefs refer to by number: percepts, their symbols, and agents.
    ///
    /// The belief process writes it to its board once, before its first beliefs. The board's name contains the
    /// incarnation that the headers of these beliefs contain.
    #[derive(Debug, PartialEq, Eq)]
    pub struct Symbols as "leo/Symbols/1" {
        /// The number of percepts; zero until the board has been written.
        percept_count: u32,
        /// The number of agents: the robot and its partners.
        agent_count: u32,
        /// The percepts, by number.
        percepts: [PerceptDescription; MAX_PERCEPTS],
        /// The names of the agents, by number: 0 the robot, n partner n.
        agents: [Name; MAX_PERSPECTIVES],
    }
}

impl Default for Symbols {
    fn default() -> Self {
        Self {
            percept_count: 0,
            agent_count: 0,
            percepts: [PerceptDescription::EMPTY; MAX_PERCEPTS],
            agents: [Name::EMPTY; MAX_PERSPECTIVES],
        }
    }
}

impl Symbols {
    /// Adds the next percept; `false` if there are [`MAX_PERCEPTS`] already.
    pub fn push_percept(&mut self, percept: PerceptDescription) -> bool {
        fill(&mut self.percepts, &mut self.percept_count, percept)
    }

    /// Adds the next agent; `false` if there are [`MAX_PERSPECTIVES`] already.
    pub fn push_agent(&mut self, name: &str) -> bool {
        fill(&mut self.agents, &mut self.agent_count, Name::new(name))
    }

    /// The percepts, by number.
    #[must_use]
    pub fn percepts(&self) -> &[PerceptDescription] {
        filled(&self.percepts, self.percept_count)
    }

    /// The names of the agents, by number.
    #[must_use]
    pub fn agents(&self) -> &[Name] {
        filled(&self.agents, self.agent_count)
    }

    /// The name of a symbol of a percept; `None` if it has none.
    #[must_use]
    pub fn symbol(&self, percept: u16, symbol: u16) -> Option<&str> {
        let percept = self.percepts().get(usize::from(percept))?;
        percept.symbols().get(usize::from(symbol)).map(Name::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_name_is_cut_between_characters() {
        assert_eq!(Name::new(&"é".repeat(40)).as_str(), "é".repeat(32));
        assert_eq!(Name::new(&format!("x{}", "é".repeat(40))).as_str(), format!("x{}", "é".repeat(31)));
    }

    #[test]
    fn a_name_with_a_false_length_or_half_a_character_is_empty() {
        assert_eq!(Name { length: u32::MAX, ..Name::new("red") }.as_str(), "");
        assert_eq!(Name { length: 65, ..Name::new("red") }.as_str(), "");
        assert_eq!(Name { length: 1, ..Name::new("é") }.as_str(), "");
    }

    #[test]
    fn a_name_has_1_to_64_bytes_on_one_line() {
        assert!(Name::is_valid("sehr grün") && Name::is_valid(&"x".repeat(64)));
        for wrong in ["", "  ", "a\nb", &"x".repeat(65), &"é".repeat(33)] {
            assert!(!Name::is_valid(wrong), "{wrong:?}");
        }
    }

    #[test]
    fn counts_beyond_the_capacity_are_limited_to_it() {
        let lie = Symbols { percept_count: u32::MAX, agent_count: 257, ..Symbols::default() };
        assert_eq!((lie.percepts().len(), lie.agents().len()), (MAX_PERCEPTS, MAX_PERSPECTIVES));
        let lie = PerceptDescription { symbol_count: 65, ..PerceptDescription::EMPTY };
        assert_eq!(lie.symbols().len(), MAX_SYMBOLS);
    }

    #[test]
    fn a_symbol_is_found_by_its_percept_and_its_number() {
        let mut colour =
            PerceptDescription::new("colour", PerceptRole::Criteria, PerceptKernel::NearestColour, Some(1));
        assert!(colour.push_symbol("red") && colour.push_symbol("yellow"));
        let mut symbols = Symbols::default();
        let plugin = PerceptDescription::new("own", PerceptRole::Neither, PerceptKernel::Plugin, None);
        assert!(symbols.push_percept(plugin) && symbols.push_percept(colour) && symbols.push_agent("Leo"));
        let found = [(1, 1), (1, 2), (0, 0), (2, 0)].map(|(percept, symbol)| symbols.symbol(percept, symbol));
        assert_eq!(found, [Some("yellow"), None, None, None]);
        let kinds = [0, 1].map(|percept| symbols.percepts()[percept].feature_kind());
        assert_eq!(kinds, [None, Some(FeatureKind::Symbol)]);
        assert_eq!([0, 1].map(|percept| symbols.percepts()[percept].parent()), [None, Some(1)]);
    }

    #[test]
    fn a_full_list_takes_no_more() {
        let mut symbols = Symbols::default();
        let percept = PerceptDescription::new("p", PerceptRole::Neither, PerceptKernel::Position, None);
        let taken = (0..20).take_while(|_| symbols.push_percept(percept)).count();
        assert_eq!((taken, symbols.percepts().len()), (MAX_PERCEPTS, MAX_PERCEPTS));
        let mut percept = percept;
        let named = (0..100).take_while(|number| percept.push_symbol(&number.to_string())).count();
        assert_eq!((named, percept.symbols().last().map(Name::as_str)), (MAX_SYMBOLS, Some("63")));
    }
}

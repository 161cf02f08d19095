/// A set of sensory sources, for example those that observed an object.
///
/// A robot has at most 16 sources. In a trace with more, all sources from number 63 on share one bit.
///
/// ```
/// use message::SourceSet;
///
/// let eyes = SourceSet::of(0).union(SourceSet::of(2));
/// assert!(eyes.intersects(SourceSet::of(2)) && !eyes.intersects(SourceSet::of(1)));
/// assert!(!SourceSet::EMPTY.intersects(eyes));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceSet(u64);

impl SourceSet {
    /// The empty set.
    pub const EMPTY: Self = Self(0);
    /// The set of all sources.
    pub const ALL: Self = Self(u64::MAX);

    /// One source.
    #[must_use]
    pub const fn of(source: u16) -> Self {
        Self(1 << if source < 63 { source } else { 63 })
    }

    /// The union of both sets.
    #[must_use]
    pub const fn union(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Whether the sets have a common source.
    #[must_use]
    #[inline]
    pub const fn intersects(self, others: Self) -> bool {
        self.0 & others.0 != 0
    }

    pub(crate) const fn from_raw(raw: u64) -> Self {
        Self(raw)
    }

    pub(crate) const fn raw(self) -> u64 {
        self.0
    }
}

impl FromIterator<Self> for SourceSet {
    fn from_iter<Each: IntoIterator<Item = Self>>(each: Each) -> Self {
        each.into_iter().fold(Self::EMPTY, Self::union)
    }
}

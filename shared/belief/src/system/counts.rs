/// Counters since the system was created.
///
/// The number of current beliefs is those created, less those merged, culled and evicted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Observations rejected because of invalid numbers, and percept evaluations omitted for the same reason.
    pub unsound: u64,
    /// Observations rejected because their time stamp was too far ahead: their source's clock is wrong.
    pub ahead: u64,
    /// Observations rejected because they were not newer than those that their source delivered in an earlier step.
    pub stale: u64,
    /// Steps whose instant was before that of the previous step; the previous instant was used instead.
    pub backwards: u64,
    /// Beliefs created, one per snapshot (Eq. 6).
    pub created: u64,
    /// Pairs of beliefs merged.
    pub merged: u64,
    /// Beliefs culled (Eq. 5).
    pub culled: u64,
    /// Observations dropped because the system was full.
    pub overflowed: u64,
    /// New beliefs dropped because the system was full: those that merged into no older one.
    pub evicted: u64,
}

impl Counts {
    /// Observations and evaluations rejected, for any reason.
    #[must_use]
    pub const fn refused(&self) -> u64 {
        self.unsound + self.ahead + self.stale
    }
}

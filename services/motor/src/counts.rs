/// What the motor counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Goals refused: no number, or for no joint.
    pub refused: u64,
    /// Goals beyond a joint's limits, which became the limit.
    pub limited: u64,
    /// Answers dropped because nobody awaited them, or because they were sampled before they were
    /// asked for.
    pub stale: u64,
}

/// What is counted of one bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusCounts {
    /// Requests carried out.
    pub exchanges: u64,
    /// Answers dropped because nobody awaited them, or because they were sampled before they were
    /// asked for.
    pub stale: u64,
    /// Answers that did not come.
    pub missed: u64,
    /// Answers that arrived broken, and requests whose answers had noise among them.
    pub broken: u64,
    /// Bytes that came after their time.
    pub late_bytes: u64,
}

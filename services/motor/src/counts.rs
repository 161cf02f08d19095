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
    /// Times that a joint was locked.
    pub locks: u64,
    /// Times that a joint moved without being allowed to, and was stopped: none, unless this program is wrong.
    pub violations: u64,
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
    /// What befell its servos.
    pub incidents: Incidents,
    /// Identifiers to which two servos were found to answer.
    pub duplicates: u64,
    /// Times that its line was lost.
    pub hang_ups: u64,
}

/// What is counted of servos where it is noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Incidents {
    /// Hardware alerts that stopped a joint.
    pub alerts: u64,
    /// Times that a servo began anew by itself.
    pub restarts: u64,
    /// Bus watchdogs that were found to have tripped.
    pub watchdogs: u64,
    /// Answers that refuse an instruction by an error number, but for the number that says that it arrived broken.
    pub refusals: u64,
    /// Times that a joint did not follow its command for so long that it was stopped.
    pub blocked: u64,
}

impl Incidents {
    /// Adds what befell a joint's servo.
    pub(crate) const fn add(&mut self, other: Self) {
        let Self { alerts, restarts, watchdogs, refusals, blocked } = other;
        self.alerts += alerts;
        self.restarts += restarts;
        self.watchdogs += watchdogs;
        self.refusals += refusals;
        self.blocked += blocked;
    }
}

/// Counters of the motor process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MotorCounters {
    /// Goals refused: not finite, or for an unknown joint.
    pub refused: u64,
    /// Goals beyond a joint's limits, which were clamped.
    pub limited: u64,
    /// Answers dropped because they were not expected, or were sampled before they were requested.
    pub stale: u64,
    /// Times that a joint was locked.
    pub locks: u64,
    /// Times that a joint moved without permission, and was stopped. Not zero only after a programming error.
    pub violations: u64,
}

/// Counters of one bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusCounters {
    /// Requests carried out.
    pub exchanges: u64,
    /// Answers dropped because they were not expected, or were sampled before they were requested.
    pub stale: u64,
    /// Missing answers.
    pub missed: u64,
    /// Corrupt answers, and exchanges with noise among the answers.
    pub corrupt: u64,
    /// Bytes that arrived too late.
    pub late_bytes: u64,
    /// Faults of its servos.
    pub fault_counters: FaultCounters,
    /// Identifiers to which two servos answered.
    pub duplicates: u64,
    /// Times that its line was lost.
    pub hang_ups: u64,
}

/// Fault counters of servos.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaultCounters {
    /// Hardware alerts that stopped a joint.
    pub alerts: u64,
    /// Times that a servo restarted by itself.
    pub restarts: u64,
    /// Bus watchdogs found tripped or disabled.
    pub watchdogs: u64,
    /// Answers that refuse an instruction by an error number, except the number for a wrong check sum.
    pub refusals: u64,
    /// Times that a joint was stopped because it did not follow its setpoint.
    pub blocked: u64,
}

impl FaultCounters {
    /// Adds the faults of a joint's servo.
    pub(crate) const fn add(&mut self, other: Self) {
        let Self { alerts, restarts, watchdogs, refusals, blocked } = other;
        self.alerts += alerts;
        self.restarts += restarts;
        self.watchdogs += watchdogs;
        self.refusals += refusals;
        self.blocked += blocked;
    }
}

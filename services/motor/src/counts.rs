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

/// Fault counters of a servo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FaultCounters {
    /// Hardware alerts that stopped a joint.
    pub(crate) alerts: u64,
    /// Times that a servo restarted by itself.
    pub(crate) restarts: u64,
    /// Bus watchdogs found tripped or disabled.
    pub(crate) watchdogs: u64,
    /// Answers that refuse an instruction by an error number, except the number for a wrong check sum.
    pub(crate) refusals: u64,
}

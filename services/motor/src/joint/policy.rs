use std::sync::Arc;

use config::leo::{AlertReaction, Motor};
use message::JointCause;
use servo::HardwareErrors;

use super::arming_state::arming_cause;

/// Settings that are equal for all joints.
#[derive(Clone, Debug)]
pub(crate) struct Policy {
    pub(crate) settings: Arc<Motor>,
    /// Whether all servos of the robot are simulated.
    is_simulated: bool,
}

impl Policy {
    /// Keeps the settings. `is_simulated`: whether all servos of the robot are simulated.
    pub(crate) fn new(settings: &Motor, is_simulated: bool) -> Self {
        Self { settings: Arc::new(settings.clone()), is_simulated }
    }

    /// Whether a joint is armed automatically after this cause.
    pub(crate) fn arms_after(&self, cause: JointCause) -> bool {
        let automatic = &self.settings.automatic_arming;
        arming_cause(cause).is_some_and(|cause| automatic.covers(cause, self.is_simulated))
    }

    /// Reaction to these hardware errors: that of the error that asks to switch torque off earliest, in the order limp,
    /// hold, lower. `max` is the limit of the joint's group. As long as the errors are unknown, the joint holds.
    pub(crate) fn reaction(&self, errors: HardwareErrors, max: AlertReaction) -> AlertReaction {
        let alert = &self.settings.alert;
        let reactions = [
            (1, alert.input_voltage),
            (1 << 2, alert.overheating),
            (1 << 3, alert.encoder),
            (1 << 4, alert.electrical_shock),
            (1 << 5, alert.overload),
        ];
        let asked = reactions.iter().filter(|(bit, _)| errors.0 & bit != 0).map(|(_, reaction)| *reaction);
        let known = reactions.iter().fold(0, |bits, (bit, _)| bits | bit);
        let unknown = (errors.0 & !known != 0).then_some(AlertReaction::Limp);
        asked.chain(unknown).min().unwrap_or(AlertReaction::Hold).min(max)
    }
}

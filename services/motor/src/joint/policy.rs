use clock::Duration;
use config::leo::{AlertReaction, AlertReactions, ArmingCause, Motor, OnAlert};
use message::JointCause;
use servo::HardwareErrors;

use super::arming_state::arming_cause;

/// All causes after which the configuration may allow automatic arming.
const ARMING_CAUSES: [ArmingCause; 9] = [
    ArmingCause::Start,
    ArmingCause::CommandTimeout,
    ArmingCause::Silent,
    ArmingCause::Restarted,
    ArmingCause::BusLost,
    ArmingCause::Watchdog,
    ArmingCause::OtherFailed,
    ArmingCause::Alert,
    ArmingCause::EmergencyStop,
];

/// Settings that are equal for all joints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Policy {
    /// Cycle period of the setpoints.
    pub(crate) period: Duration,
    pub(crate) command_timeout: Duration,
    pub(crate) soft_start: Duration,
    pub(crate) soft_start_rad_s: f64,
    pub(crate) on_alert: OnAlert,
    pub(crate) max_tracking_error_rad: f64,
    pub(crate) blocked_after: Duration,
    pub(crate) max_beyond_limits_rad: f64,
    /// How long a joint holds after an alert, and the longest duration of the motion to its rest pose then.
    pub(crate) hold: Duration,
    pub(crate) lower_timeout: Duration,
    /// Reaction to each hardware error, by its bit.
    reactions: [(u8, AlertReaction); 5],
    /// Whether joints are armed automatically after a cause, in the order of [`ARMING_CAUSES`].
    automatic: [bool; ARMING_CAUSES.len()],
}

impl Policy {
    /// Reads the settings. `is_simulated`: whether all servos of the robot are simulated.
    pub(crate) fn new(settings: &Motor, is_simulated: bool) -> Self {
        let AlertReactions {
            input_voltage,
            overheating,
            encoder,
            electrical_shock,
            overload,
            groups: _,
            hold_ms,
            lower_timeout_ms,
        } = &settings.alert;
        Self {
            period: settings.rate_hz.period(),
            command_timeout: settings.command_timeout_ms.duration(),
            soft_start: settings.soft_start_ms.duration(),
            soft_start_rad_s: settings.soft_start_rad_s.get(),
            on_alert: settings.on_alert,
            max_tracking_error_rad: settings.max_tracking_error_rad.get(),
            blocked_after: settings.blocked_after_ms.duration(),
            max_beyond_limits_rad: settings.max_beyond_limits_rad.get(),
            hold: hold_ms.duration(),
            lower_timeout: lower_timeout_ms.duration(),
            reactions: [
                (1, *input_voltage),
                (1 << 2, *overheating),
                (1 << 3, *encoder),
                (1 << 4, *electrical_shock),
                (1 << 5, *overload),
            ],
            automatic: ARMING_CAUSES.map(|cause| settings.automatic_arming.covers(cause, is_simulated)),
        }
    }

    /// Whether a joint is armed automatically after this cause.
    pub(crate) fn arms_after(&self, cause: JointCause) -> bool {
        let place =
            arming_cause(cause).and_then(|cause| ARMING_CAUSES.iter().position(|known| *known == cause));
        place.and_then(|place| self.automatic.get(place)).is_some_and(|is_automatic| *is_automatic)
    }

    /// Reaction to these hardware errors: that of the error that asks to switch torque off earliest, in the order limp,
    /// hold, lower. `max` is the limit of the joint's group. As long as the errors are unknown, the joint holds.
    pub(crate) fn reaction(&self, errors: HardwareErrors, max: AlertReaction) -> AlertReaction {
        let asked =
            self.reactions.iter().filter(|(bit, _)| errors.0 & bit != 0).map(|(_, reaction)| *reaction);
        let known = self.reactions.iter().fold(0, |bits, (bit, _)| bits | bit);
        let unknown = (errors.0 & !known != 0).then_some(AlertReaction::Limp);
        asked.chain(unknown).min().unwrap_or(AlertReaction::Hold).min(max)
    }
}

use servo::HardwareErrors;

/// Why a joint failed, as a message to the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JointFault {
    /// The servo is of another model than configured.
    #[error(
        "a servo of model number {found} answers, and {expected} is configured: correct motor.toml or the id"
    )]
    Model {
        /// Model number of the configured model.
        expected: u16,
        /// Model number that was answered.
        found: u16,
    },
    /// The servo adds an offset to its positions.
    #[error(
        "its homing offset (item 20) is {0} counts, which would shift every limit by as much. Offsets belong in \
         motor.toml: write 0 with `leo bus write`, and check offset_rad"
    )]
    HomingOffset(i32),
    /// The servo would not shut down on errors for which the manufacturer enables that.
    #[error(
        "its item 63, shutdown, is {found}: the servo would not switch off when it is hot or overloaded; write \
         {expected} with `leo bus write`"
    )]
    Shutdown {
        /// The manufacturer's setting.
        expected: u8,
        /// The value found.
        found: u8,
    },
    /// The servo also executes instructions to another identifier.
    #[error(
        "its secondary id (item 12) is {0}: it also executes the instructions to servo {0}, without an answer; write \
         255 with `leo bus write`"
    )]
    SecondaryId(u8),
    /// The servo changes settings by itself at power-on.
    #[error(
        "its item 60, startup configuration, is {0}: at power-on the servo switches its torque on or restores stored \
         settings; write 0 with `leo bus write`"
    )]
    Startup(u8),
    /// The servo has the limits of another joint.
    #[error(
        "its limits (items 48 and 52) are exactly those of joint number {0} in motor.toml: are two servos swapped, or \
         their ids? If so, correct that first. `leo arm --acknowledge` overwrites the limits"
    )]
    OtherJoint(usize),
    /// A limit is 0, so that the servo cannot move.
    #[error(
        "its item {0}, a limit of its power, is 0, so that it cannot move; write the factory value with `leo bus \
         write`, and then `leo arm --acknowledge`"
    )]
    Powerless(u16),
    /// The joint did not follow its setpoint.
    #[error(
        "blocked: it was {} rad from its command for longer than `blocked_after_ms`; remove what holds it, then `leo \
         arm --acknowledge`", f64_of_mrad(*by_mrad)
    )]
    Blocked {
        /// Tracking error, in thousandths of a radian.
        by_mrad: i64,
    },
    /// The joint is too far beyond its limits.
    #[error(
        "it stands {} rad beyond its limits: a slipped horn, a wrong offset_rad or a swapped servo? Bring it back by \
         hand, or correct motor.toml, and then `leo arm --acknowledge`", f64_of_mrad(*by_mrad)
    )]
    BeyondLimits {
        /// Distance beyond the limit, in thousandths of a radian.
        by_mrad: i64,
    },
    /// The servo refused an instruction.
    #[error("{0}; torque stays off until `leo arm --acknowledge`")]
    Refused(servo::Fault),
    /// The servo reports a hardware alert.
    #[error(
        "hardware alert: {0}; its group holds. Once its torque is off, it stays off until its servo reboots, where \
         `on_alert` says so, or until `leo arm --acknowledge`"
    )]
    Alert(HardwareErrors),
    /// The servo's readings cannot be shown to be fresh.
    #[error(
        "its servo answers with readings that cannot be trusted: its clock (item 120) stands still or is too slow, or \
         its position jumps. It is quarantined until its readings have been right for 15 s. Switch its power off and \
         on; if that does not help, replace it"
    )]
    Unbelieved,
    /// Two servos answer to one identifier.
    #[error(
        "two servos answer to id {0} on this bus; give one of them another id (connect it alone); torque of the whole \
         bus stays off until `leo arm --acknowledge`"
    )]
    Duplicate(u8),
}

#[expect(clippy::cast_precision_loss, reason = "thousandths of a radian are few")]
fn f64_of_mrad(mrad: i64) -> f64 {
    mrad as f64 / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let faults = [
            JointFault::Model { expected: 1200, found: 1020 },
            JointFault::HomingOffset(-100),
            JointFault::Shutdown { expected: 52, found: 0 },
            JointFault::SecondaryId(9),
            JointFault::Startup(1),
            JointFault::OtherJoint(2),
            JointFault::Powerless(36),
            JointFault::Blocked { by_mrad: 250 },
            JointFault::BeyondLimits { by_mrad: 400 },
            JointFault::Refused(servo::Fault::Limit),
            JointFault::Alert(HardwareErrors(0b10_0100)),
            JointFault::Unbelieved,
            JointFault::Duplicate(2),
        ];
        insta::assert_snapshot!(faults.map(|fault| fault.to_string()).join("\n"));
    }
}

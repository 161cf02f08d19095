use servo::HardwareErrors;

/// Why a joint failed, for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// Another servo than the configured one answers.
    #[error(
        "a servo of model number {found} answers, and {expected} is configured: correct motor.toml or the id"
    )]
    Model {
        /// The configured model's number.
        expected: u16,
        /// The number that was answered.
        found: u16,
    },
    /// The servo adds something to its positions by itself.
    #[error(
        "its homing offset (item 20) is {0} counts, and every limit would be off by as much: offsets belong into \
         motor.toml; write 0 with `leo bus write`, and check offset_rad"
    )]
    HomingOffset(i32),
    /// The servo would not switch itself off where its maker has it do so.
    #[error(
        "by its item 63, shutdown, which is {found}, it would go on when it is hot or overloaded; write \
         {expected} with `leo bus write`"
    )]
    Shutdown {
        /// What the maker sets.
        expected: u8,
        /// What is set.
        found: u8,
    },
    /// The servo does what another one is told.
    #[error(
        "by its secondary id (item 12) it also does what servo {0} is told, and says nothing of it; write 255 with \
         `leo bus write`"
    )]
    SecondaryId(u8),
    /// The servo does something by itself when its power comes on.
    #[error(
        "by its item 60, startup configuration, which is {0}, it has its torque on, or settings that somebody once \
         stored, as soon as its power comes on; write 0 with `leo bus write`"
    )]
    Startup(u8),
    /// The servo refused an instruction.
    #[error("{0}; torque stays off until the motor process or a released emergency stop brings it up again")]
    Refused(servo::Fault),
    /// The servo reports a hardware alert.
    #[error(
        "hardware alert: {0}; its group holds, and its torque stays off until its servo begins anew, where `on_alert` \
         says so, or the motor process or a released emergency stop brings it up again"
    )]
    Alert(HardwareErrors),
    /// Nothing shows that the servo's answers are new.
    #[error(
        "its servo answers and cannot be believed: its clock (item 120) stands still or is too slow, or its position \
         leaps, so that nobody knows where it stands; it is quarantined until all of that has been right for 15 s. \
         Take its power off and on; if that does not help, replace it"
    )]
    Unbelieved,
    /// Two servos answer to one identifier.
    #[error(
        "two servos answer to id {0} on this bus; give one of them another id (connect it alone); torque stays \
         off until the motor process or a released emergency stop brings it up again"
    )]
    Duplicate(u8),
}

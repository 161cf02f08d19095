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
    /// The servo refused an instruction.
    #[error("{0}; torque stays off until the motor process or a released emergency stop brings it up again")]
    Refused(servo::Fault),
    /// The servo reports a hardware alert.
    #[error(
        "hardware alert: {0}; its group holds, and its torque stays off until the motor process or a released \
         emergency stop brings it up again"
    )]
    Alert(HardwareErrors),
    /// Two servos answer to one identifier.
    #[error(
        "two servos answer to id {0} on this bus; give one of them another id (connect it alone); torque stays \
         off until the motor process or a released emergency stop brings it up again"
    )]
    Duplicate(u8),
}

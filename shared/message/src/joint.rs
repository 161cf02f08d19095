use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::bytes::laid_out;
use crate::numbered;

numbered! {
    /// What the motor process does with a joint.
    JointMode: u16 {
        /// No torque: the joint hangs free.
        Limp = 0,
        /// Being brought up: found, checked, torque not yet on.
        Starting = 1,
        /// Following goals.
        Following = 2,
        /// The commander is gone: slowing down.
        Decelerating = 3,
        /// Holding the position where it stopped.
        Holding = 4,
        /// Its servo does not answer, or cannot be believed: no goal is sent, it is asked again now and then.
        Quarantined = 5,
        /// Told to switch its torque off, and its servo has not confirmed it yet.
        Releasing = 6,
    }
}

numbered! {
    /// Why a joint is in its mode.
    JointCause: u16 {
        /// As it should be.
        None = 0,
        /// Not started yet.
        NotStarted = 1,
        /// No new goals for longer than the command time-out.
        CommandTimeout = 2,
        /// The servo does not answer.
        Silent = 3,
        /// The servo reports a hardware alert.
        Alert = 4,
        /// The servo's own bus watchdog tripped.
        Watchdog = 5,
        /// The bus itself is lost.
        BusLost = 6,
        /// Stopped by order.
        Stopped = 7,
        /// The servo refused an instruction, or is another model than the configured one.
        Refused = 8,
        /// Another joint of its group is in trouble: the group stops together.
        GroupStopped = 9,
        /// A bus is lost: the body stops together.
        BodyStopped = 10,
        /// The emergency stop.
        Emergency = 11,
        /// The servo started anew by itself: its power or its firmware gave way for a moment.
        Restarted = 12,
        /// Two servos answer to one identifier on its bus.
        DuplicateId = 13,
        /// The servo is hot or short of voltage: it moves more slowly.
        Derated = 14,
        /// The servo answers, and nothing shows that its answers are new: its own clock does not go right.
        Unbelieved = 15,
    }
}

impl JointMode {
    /// Its word, as people and metrics say it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Limp => "limp",
            Self::Starting => "starting",
            Self::Following => "following",
            Self::Decelerating => "decelerating",
            Self::Holding => "holding",
            Self::Quarantined => "quarantined",
            Self::Releasing => "releasing",
        }
    }
}

impl JointCause {
    /// Its word, as people and metrics say it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::NotStarted => "not-started",
            Self::CommandTimeout => "command-timeout",
            Self::Silent => "silent",
            Self::Alert => "alert",
            Self::Watchdog => "watchdog",
            Self::BusLost => "bus-lost",
            Self::Stopped => "stopped",
            Self::Refused => "refused",
            Self::GroupStopped => "group-stopped",
            Self::BodyStopped => "body-stopped",
            Self::Emergency => "emergency",
            Self::Restarted => "restarted",
            Self::DuplicateId => "duplicate-id",
            Self::Derated => "derated",
            Self::Unbelieved => "unbelieved",
        }
    }
}

/// Where one joint shall be, and when.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/JointGoal/1")]
pub struct JointGoal {
    /// The joint: its index in the robot's configuration.
    pub joint: u32,
    /// Not used; zero.
    pub reserved: u32,
    /// Goal position, in radians from the joint's zero.
    pub goal_position_rad: f64,
    /// When it shall be there, in nanoseconds of the clock; the motor process moves smoothly and
    /// arrives later where the joint's limits ask for it.
    pub arrive_at_ns: u64,
}

/// What one joint does.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/JointState/2")]
pub struct JointState {
    /// The joint: its index in the robot's configuration.
    pub joint: u32,
    mode: u16,
    cause: u16,
    /// When the servo was read, in nanoseconds of the clock; zero when it never was.
    pub sampled_at_ns: u64,
    present_position_rad: f64,
    present_velocity_rad_s: f64,
    present_current_a: f64,
    command_position_rad: f64,
    present_temperature_c: f32,
    present_input_v: f32,
}

impl JointState {
    /// A joint that was never read. A missing reading is NaN in memory, `None` to its reader,
    /// and never a zero.
    #[must_use]
    pub fn unread(joint: u32, mode: JointMode, cause: JointCause) -> Self {
        Self {
            joint,
            mode: mode.raw(),
            cause: cause.raw(),
            sampled_at_ns: 0,
            present_position_rad: f64::NAN,
            present_velocity_rad_s: f64::NAN,
            present_current_a: f64::NAN,
            command_position_rad: f64::NAN,
            present_temperature_c: f32::NAN,
            present_input_v: f32::NAN,
        }
    }

    /// The same joint with a reading.
    #[must_use]
    pub fn with_reading(
        self,
        sampled_at_ns: u64,
        position_rad: f64,
        velocity_rad_s: f64,
        current_a: f64,
    ) -> Self {
        Self {
            sampled_at_ns,
            present_position_rad: position_rad,
            present_velocity_rad_s: velocity_rad_s,
            present_current_a: current_a,
            ..self
        }
    }

    /// The same joint with the position commanded in this cycle, after limits.
    #[must_use]
    pub fn with_command(self, position_rad: f64) -> Self {
        Self { command_position_rad: position_rad, ..self }
    }

    /// The same joint with what its servo said of itself last: temperature in °C, voltage in V.
    #[must_use]
    pub fn with_condition(self, temperature_c: f32, input_v: f32) -> Self {
        Self { present_temperature_c: temperature_c, present_input_v: input_v, ..self }
    }

    /// What the motor process does with the joint; `None` for nonsense.
    #[must_use]
    pub fn mode(&self) -> Option<JointMode> {
        JointMode::from_raw(self.mode)
    }

    /// Why; `None` for nonsense.
    #[must_use]
    pub fn cause(&self) -> Option<JointCause> {
        JointCause::from_raw(self.cause)
    }

    /// Position read from the servo, in radians.
    #[must_use]
    pub fn present_position_rad(&self) -> Option<f64> {
        finite(self.present_position_rad)
    }

    /// Velocity read from the servo, in radians per second.
    #[must_use]
    pub fn present_velocity_rad_s(&self) -> Option<f64> {
        finite(self.present_velocity_rad_s)
    }

    /// Current read from the servo, in amperes.
    #[must_use]
    pub fn present_current_a(&self) -> Option<f64> {
        finite(self.present_current_a)
    }

    /// Temperature inside the servo, in °C.
    #[must_use]
    pub fn present_temperature_c(&self) -> Option<f32> {
        Some(self.present_temperature_c).filter(|number| number.is_finite())
    }

    /// Voltage at the servo, in volts.
    #[must_use]
    pub fn present_input_v(&self) -> Option<f32> {
        Some(self.present_input_v).filter(|number| number.is_finite())
    }

    /// Position commanded in this cycle, after limits, in radians.
    #[must_use]
    pub fn command_position_rad(&self) -> Option<f64> {
        finite(self.command_position_rad)
    }
}

fn finite(number: f64) -> Option<f64> {
    Some(number).filter(|number| number.is_finite())
}

laid_out!(JointGoal = "leo/JointGoal/1" {
    joint, reserved, goal_position_rad, arrive_at_ns
});
laid_out!(JointState = "leo/JointState/2" {
    joint, mode, cause, sampled_at_ns, present_position_rad, present_velocity_rad_s, present_current_a,
    command_position_rad, present_temperature_c, present_input_v
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_that_was_never_read_has_no_position() {
        let joint = JointState::unread(3, JointMode::Starting, JointCause::NotStarted);
        assert_eq!(joint.present_position_rad(), None);
        assert_eq!(joint.with_reading(9, 0.0, 0.0, 0.0).present_position_rad(), Some(0.0));
    }
}

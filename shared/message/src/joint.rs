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
        /// Moving slowly from where torque came on, a little beyond its limits, back within them.
        Aligning = 7,
        /// Moving slowly to its rest pose, before its torque goes off.
        Lowering = 8,
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
        /// The joint did not follow its command: something held it, or its servo is too weak.
        Blocked = 16,
        /// It stands further beyond its limits than the tolerance: a slipped horn, a wrong offset, a swapped servo.
        BeyondLimits = 17,
    }
}

numbered! {
    /// What is known of the connection to a joint's servo.
    JointLink: u16 {
        /// It has not been asked yet.
        Unknown = 0,
        /// It is there, and is the configured model; how it is set up is being read or written.
        Identified = 1,
        /// It is set up and read in every cycle.
        Answering = 2,
        /// It does not answer, or cannot be believed: quarantined, and asked again now and then.
        Silent = 3,
        /// Its answers arrive broken: two servos may answer at once.
        Doubted = 4,
    }
}

numbered! {
    /// What is known of the torque of a joint's servo.
    JointPower: u16 {
        /// Nothing: it may be on.
        Unknown = 0,
        /// The servo has said that it is off.
        Off = 1,
        /// It was found on: another process switched it on.
        Found = 2,
        /// It is being switched on.
        Rising = 3,
        /// The motor process switched it on, and the servo's bus watchdog is armed.
        On = 4,
        /// The servo is told to switch it off, and has not confirmed it.
        Cutting = 5,
    }
}

numbered! {
    /// Whether a joint may move.
    JointLicence: u16 {
        /// Not until its cause is gone and a person has acknowledged it.
        Locked = 0,
        /// Not until a person arms it.
        Disarmed = 1,
        /// It may.
        Armed = 2,
    }
}

numbered! {
    /// How a joint moves.
    JointMotion: u16 {
        /// No goal is sent: it is limp, or its servo stays where it is.
        Idle = 0,
        /// Slowly back within its limits.
        Align = 1,
        /// After goals, no faster than the soft start.
        Soft = 2,
        /// After goals.
        Track = 3,
        /// Slowing down to a stop.
        Halt = 4,
        /// Held at the place where it stopped, for goals to come.
        Hold = 5,
        /// Slowly to its rest pose.
        Retreat = 6,
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
            Self::Aligning => "aligning",
            Self::Lowering => "lowering",
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
            Self::Blocked => "blocked",
            Self::BeyondLimits => "beyond-limits",
        }
    }
}

impl JointLink {
    /// Its word, as people and metrics say it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Identified => "identified",
            Self::Answering => "answering",
            Self::Silent => "silent",
            Self::Doubted => "doubted",
        }
    }
}

impl JointPower {
    /// Its word, as people and metrics say it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Off => "off",
            Self::Found => "found-on",
            Self::Rising => "rising",
            Self::On => "on",
            Self::Cutting => "cutting",
        }
    }
}

impl JointLicence {
    /// Its word, as people and metrics say it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Locked => "locked",
            Self::Disarmed => "disarmed",
            Self::Armed => "armed",
        }
    }
}

impl JointMotion {
    /// Its word, as people and metrics say it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Align => "align",
            Self::Soft => "soft",
            Self::Track => "track",
            Self::Halt => "halt",
            Self::Hold => "hold",
            Self::Retreat => "retreat",
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
#[type_name("leo/JointState/3")]
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
    link: u16,
    power: u16,
    licence: u16,
    motion: u16,
    licence_cause: u16,
    /// Not used; zero.
    pub reserved: [u16; 3],
}

/// The four state machines of a joint at one instant. A joint moves only where its link answers, its power is on,
/// its licence is armed, and its servo's bus watchdog is armed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointMachines {
    /// The connection to its servo.
    pub link: JointLink,
    /// The torque of its servo.
    pub power: JointPower,
    /// Whether it may move.
    pub licence: JointLicence,
    /// Why it is locked or disarmed; [`JointCause::None`] while it is armed.
    pub licence_cause: JointCause,
    /// How it moves.
    pub motion: JointMotion,
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
            link: JointLink::Unknown.raw(),
            power: JointPower::Unknown.raw(),
            licence: JointLicence::Disarmed.raw(),
            motion: JointMotion::Idle.raw(),
            licence_cause: JointCause::NotStarted.raw(),
            reserved: [0; 3],
        }
    }

    /// The same joint with the states of its machines.
    #[must_use]
    pub const fn with_machines(self, machines: JointMachines) -> Self {
        let JointMachines { link, power, licence, licence_cause, motion } = machines;
        Self {
            link: link.raw(),
            power: power.raw(),
            licence: licence.raw(),
            licence_cause: licence_cause.raw(),
            motion: motion.raw(),
            ..self
        }
    }

    /// The states of its machines; `None` for nonsense.
    #[must_use]
    pub const fn machines(&self) -> Option<JointMachines> {
        let (Some(link), Some(power)) = (JointLink::from_raw(self.link), JointPower::from_raw(self.power))
        else {
            return None;
        };
        let (Some(licence), Some(motion)) =
            (JointLicence::from_raw(self.licence), JointMotion::from_raw(self.motion))
        else {
            return None;
        };
        match JointCause::from_raw(self.licence_cause) {
            Some(licence_cause) => Some(JointMachines { link, power, licence, licence_cause, motion }),
            None => None,
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
laid_out!(JointState = "leo/JointState/3" {
    joint, mode, cause, sampled_at_ns, present_position_rad, present_velocity_rad_s, present_current_a,
    command_position_rad, present_temperature_c, present_input_v, link, power, licence, motion, licence_cause,
    reserved
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

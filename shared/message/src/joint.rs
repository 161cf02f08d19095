use crate::bytes::impl_bytes;
use crate::{ZeroCopySend, wire_enum};

wire_enum! {
    /// Mode of a joint in the motor process.
    JointMode: u16 {
        /// Torque off: the joint moves freely.
        Limp = 0 as "limp",
        /// Being initialised: found and checked, torque still off.
        Starting = 1 as "starting",
        /// Following goals.
        Following = 2 as "following",
        /// No goals arrive any more: decelerating.
        Decelerating = 3 as "decelerating",
        /// Holding the position where it stopped.
        Holding = 4 as "holding",
        /// The servo does not reply, or its replies are not trusted. No goal is sent; it is probed at intervals.
        Quarantined = 5 as "quarantined",
        /// Torque off was commanded, but the servo has not confirmed it.
        Releasing = 6 as "releasing",
        /// Moving slowly back within its limits, which it slightly exceeded when torque was switched on.
        Aligning = 7 as "aligning",
        /// Moving slowly to its rest pose before torque is switched off.
        Lowering = 8 as "lowering",
    }
}

wire_enum! {
    /// Cause of a joint's mode.
    JointCause: u16 {
        /// Normal operation.
        None = 0 as "none",
        /// Not started yet.
        NotStarted = 1 as "not-started",
        /// No new goals within the command timeout.
        CommandTimeout = 2 as "command-timeout",
        /// The servo does not reply.
        Silent = 3 as "silent",
        /// The servo reports a hardware alert.
        Alert = 4 as "alert",
        /// The servo's bus watchdog tripped.
        Watchdog = 5 as "watchdog",
        /// The bus is lost.
        BusLost = 6 as "bus-lost",
        /// Stopped by command.
        Stopped = 7 as "stopped",
        /// The servo rejected an instruction, or is not the configured model.
        Refused = 8 as "refused",
        /// Another joint of its group failed, and the group stops together.
        GroupStopped = 9 as "group-stopped",
        /// A bus is lost, and the whole body stops together.
        BodyStopped = 10 as "body-stopped",
        /// The emergency stop.
        Emergency = 11 as "emergency",
        /// The servo rebooted by itself, because of its power supply or firmware.
        Restarted = 12 as "restarted",
        /// Two servos reply to the same identifier on its bus.
        DuplicateId = 13 as "duplicate-id",
        /// The servo is hot or its voltage low, so its speed is reduced.
        Derated = 14 as "derated",
        /// The servo replies, but its clock does not advance correctly. So its replies may be outdated.
        Stale = 15 as "stale",
        /// The joint did not follow its command: it was blocked, or its servo is too weak.
        Blocked = 16 as "blocked",
        /// Further beyond its limits than the tolerance: a slipped horn, a wrong offset, or a swapped servo.
        BeyondLimits = 17 as "beyond-limits",
    }
}

wire_enum! {
    /// State of the connection to a joint's servo.
    JointLink: u16 {
        /// Not contacted yet.
        Unknown = 0 as "unknown",
        /// Found, and of the configured model; its settings are being read or written.
        Identified = 1 as "identified",
        /// Configured, and read in every cycle.
        Answering = 2 as "answering",
        /// Quarantined, and probed at intervals: it does not reply, or its replies are not trusted.
        Silent = 3 as "silent",
        /// Its replies arrive corrupt: two servos may reply at the same time.
        Corrupt = 4 as "corrupt",
    }
}

wire_enum! {
    /// State of the torque of a joint's servo.
    JointPower: u16 {
        /// Unknown: it may be on.
        Unknown = 0 as "unknown",
        /// The servo has confirmed that it is off.
        Off = 1 as "off",
        /// Found on at start-up: another process switched it on.
        Found = 2 as "found-on",
        /// Being switched on.
        SwitchingOn = 3 as "switching-on",
        /// On, and the servo's bus watchdog is armed.
        On = 4 as "on",
        /// Being switched off, not confirmed by the servo yet.
        SwitchingOff = 5 as "switching-off",
    }
}

wire_enum! {
    /// Arming state of a joint.
    JointArming: u16 {
        /// May not move until its cause is gone and an operator has acknowledged it.
        Locked = 0 as "locked",
        /// May not move until an operator arms it.
        Disarmed = 1 as "disarmed",
        /// May move.
        Armed = 2 as "armed",
    }
}

wire_enum! {
    /// Motion state of a joint.
    JointMotion: u16 {
        /// No goal is sent: torque is off, or its servo keeps its position.
        Idle = 0 as "idle",
        /// Moving slowly back within its limits.
        Align = 1 as "align",
        /// Following goals with the speed limit of the soft start.
        SoftStart = 2 as "soft-start",
        /// Following goals.
        Track = 3 as "track",
        /// Decelerating to a stop.
        Decelerate = 4 as "decelerate",
        /// Holding the position where it stopped, ready for new goals.
        Hold = 5 as "hold",
        /// Moving slowly to its rest pose.
        Lower = 6 as "lower",
    }
}

/// Goal position of one joint, with arrival time.
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
    /// Requested arrival time, in nanoseconds of the clock. The motor process moves smoothly, and arrives later if
    /// the joint's limits require it.
    pub arrive_at_ns: u64,
}

/// State of one joint.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/JointState/3")]
pub struct JointState {
    /// The joint: its index in the robot's configuration.
    pub joint: u32,
    mode: u16,
    cause: u16,
    /// When the servo was read, in nanoseconds of the clock; zero if never.
    pub sampled_at_ns: u64,
    present_position_rad: f64,
    present_velocity_rad_s: f64,
    present_current_a: f64,
    command_position_rad: f64,
    present_temperature_c: f32,
    present_input_v: f32,
    link: u16,
    power: u16,
    arming: u16,
    motion: u16,
    arming_cause: u16,
    /// Not used; zero.
    pub reserved: [u16; 3],
}

/// The four state machines of a joint at one instant. A joint moves only if its servo answers, its torque is on, it
/// is armed, and its servo's bus watchdog is armed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointMachines {
    /// The connection to its servo.
    pub link: JointLink,
    /// The torque of its servo.
    pub power: JointPower,
    /// Its arming state.
    pub arming: JointArming,
    /// Why it is locked or disarmed; [`JointCause::None`] if armed.
    pub arming_cause: JointCause,
    /// Its motion state.
    pub motion: JointMotion,
}

impl JointState {
    /// A joint that was never read. A missing reading is NaN in memory and `None` to its reader, never zero.
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
            arming: JointArming::Disarmed.raw(),
            motion: JointMotion::Idle.raw(),
            arming_cause: JointCause::NotStarted.raw(),
            reserved: [0; 3],
        }
    }

    /// Sets the states of its state machines.
    #[must_use]
    pub const fn with_machines(self, machines: JointMachines) -> Self {
        let JointMachines { link, power, arming, arming_cause, motion } = machines;
        Self {
            link: link.raw(),
            power: power.raw(),
            arming: arming.raw(),
            arming_cause: arming_cause.raw(),
            motion: motion.raw(),
            ..self
        }
    }

    /// The states of its state machines; `None` if a number is invalid.
    #[must_use]
    pub const fn machines(&self) -> Option<JointMachines> {
        let (Some(link), Some(power)) = (JointLink::from_raw(self.link), JointPower::from_raw(self.power))
        else {
            return None;
        };
        let (Some(arming), Some(motion)) =
            (JointArming::from_raw(self.arming), JointMotion::from_raw(self.motion))
        else {
            return None;
        };
        match JointCause::from_raw(self.arming_cause) {
            Some(arming_cause) => Some(JointMachines { link, power, arming, arming_cause, motion }),
            None => None,
        }
    }

    /// Sets the reading.
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

    /// Sets the position commanded in this cycle, after limits.
    #[must_use]
    pub fn with_command(self, position_rad: f64) -> Self {
        Self { command_position_rad: position_rad, ..self }
    }

    /// Sets the servo's last temperature in °C and voltage in V.
    #[must_use]
    pub fn with_condition(self, temperature_c: f32, input_v: f32) -> Self {
        Self { present_temperature_c: temperature_c, present_input_v: input_v, ..self }
    }

    /// The mode of the joint; `None` if the number is invalid.
    #[must_use]
    pub fn mode(&self) -> Option<JointMode> {
        JointMode::from_raw(self.mode)
    }

    /// The cause of the mode; `None` if the number is invalid.
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

impl_bytes!(JointGoal = "leo/JointGoal/1" {
    joint, reserved, goal_position_rad, arrive_at_ns
});
impl_bytes!(JointState = "leo/JointState/3" {
    joint, mode, cause, sampled_at_ns, present_position_rad, present_velocity_rad_s, present_current_a,
    command_position_rad, present_temperature_c, present_input_v, link, power, arming, motion, arming_cause,
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

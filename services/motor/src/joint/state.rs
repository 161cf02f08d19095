//! The published state of a joint.

use message::{JointArming, JointCause, JointMachines, JointMode, JointState};
use servo::Reading;

use super::motion::published;
use super::{ArmingState, Joint, Link, Motion, Power, is_own_fault};

impl Joint {
    /// The published state of the joint.
    pub(crate) fn state(&self) -> JointState {
        let (mode, cause) = self.mode();
        let (arming, arming_cause) = match self.arming.published() {
            // It cannot be armed before the emergency stop is released.
            (JointArming::Disarmed, _) if self.body_state.is_emergency => {
                (JointArming::Locked, JointCause::Emergency)
            }
            published => published,
        };
        let mut state = JointState::unread(self.index, mode, cause).with_machines(JointMachines {
            link: self.link.published(),
            power: self.power.published(),
            arming,
            arming_cause,
            motion: published(self.motion, self.stays()),
        });
        if let Some((at, reading)) = self.reading {
            let Reading { position_rad, velocity_rad_s, current_a, .. } = reading;
            state = state.with_reading(at.as_nanos(), position_rad, velocity_rad_s, current_a);
        }
        if let Some(supply) = self.supply {
            state = state.with_condition(supply.temperature_c, supply.input_v);
        }
        let command_rad = if let Motion::Align { to_rad } = self.motion {
            Some(to_rad)
        } else {
            self.motion.setpoint().map(|at| at.position_rad)
        };
        command_rad.map_or(state, |command_rad| state.with_command(command_rad))
    }

    /// Summarises the four state machines in one mode and its cause.
    fn mode(&self) -> (JointMode, JointCause) {
        let cause = self.let_go.unwrap_or_else(|| self.arming_cause());
        if let Power::Cutting { .. } = self.power {
            return (JointMode::Releasing, cause);
        }
        if self.let_go.is_some() {
            return (JointMode::Limp, cause);
        }
        match (self.link, self.power) {
            (Link::Silent { cause, .. }, _) => (JointMode::Quarantined, cause),
            (Link::Corrupt(_), _) => (JointMode::Quarantined, JointCause::Silent),
            _ if self.is_unproven() => (JointMode::Quarantined, JointCause::Stale),
            (_, Power::Off) if !self.arming.is_armed() => (JointMode::Limp, cause),
            (Link::Unknown | Link::Identified(_), _) if self.arming.is_locked() => (JointMode::Limp, cause),
            (_, Power::Found { .. }) if self.arming.is_locked() => (JointMode::Holding, cause),
            (_, Power::Found { .. }) if !self.body_state.live => (self.pace(), JointCause::CommandTimeout),
            (_, Power::Found { .. }) if is_own_fault(cause) => (self.pace(), cause),
            (_, Power::Found { .. }) => (self.pace(), self.body_state.halt.unwrap_or(cause)),
            (
                Link::Unknown | Link::Identified(_) | Link::Answering,
                Power::Unknown { .. } | Power::Off | Power::Rising { .. },
            ) => (JointMode::Starting, cause),
            (_, Power::On { .. }) => self.mode_of_motion(cause),
            (_, Power::Cutting { .. }) => (JointMode::Releasing, cause),
        }
    }

    fn mode_of_motion(&self, cause: JointCause) -> (JointMode, JointCause) {
        let ends_by = self.arming.ending().map(|ending| ending.cause).or(self.body_state.halt);
        let stops_by = ends_by.unwrap_or(JointCause::CommandTimeout);
        match self.motion {
            Motion::Idle if self.arming.is_given() => (JointMode::Starting, cause),
            Motion::Idle => (JointMode::Holding, cause),
            Motion::Align { .. } => (JointMode::Aligning, JointCause::NotStarted),
            Motion::Stay { .. }
                if self.arming.is_given() && self.body_state.live && self.body_state.halt.is_none() =>
            {
                (JointMode::Starting, cause)
            }
            Motion::Stay { .. } => (self.pace(), stops_by),
            Motion::Soft { .. } | Motion::Track { .. } if self.is_derated => {
                (JointMode::Following, JointCause::Derated)
            }
            Motion::Soft { .. } | Motion::Track { .. } => (JointMode::Following, JointCause::None),
            Motion::Halt { .. } => (JointMode::Decelerating, stops_by),
            Motion::Hold { .. } => (JointMode::Holding, stops_by),
            Motion::Retreat { .. } => (JointMode::Lowering, stops_by),
        }
    }

    /// Whether a servo that this process does not command is decelerating, or stands.
    fn pace(&self) -> JointMode {
        let has_to_stay = matches!(self.motion, Motion::Stay { .. }) || self.comes_back();
        let is_told = matches!(self.power, Power::Found { stay: Some(_), .. });
        if (has_to_stay || is_told) && !self.stays() { JointMode::Decelerating } else { JointMode::Holding }
    }

    /// Why it is not armed, or was not before.
    const fn arming_cause(&self) -> JointCause {
        match self.arming {
            ArmingState::Locked { cause, .. } | ArmingState::Disarmed { cause } => cause,
            ArmingState::Armed { after, ending: None, .. } => after,
            ArmingState::Armed { ending: Some(ending), .. } => ending.cause,
        }
    }
}

//! How a joint becomes armed, disarmed, locked and unlocked.

use clock::Instant;
use config::leo::AlertReaction;
use message::JointCause;

use super::{
    ArmingState, BodyState, Disarming, Joint, Link, Motion, Power, PowerUpStep, REBOOT_WAIT, Watchdog,
};
use crate::JointFault;

impl Joint {
    /// Arms the joint by an operator's order, which lapses at `lapses_at` unless torque is on by then. An order arms
    /// a joint once, and again if the joint had to wait for others.
    pub(crate) fn arm(&mut self, order: u64, lapses_at: Instant) {
        if self.arming.is_given() {
            // Whatever disarms the joint now also ends this order for it.
            self.order = order;
        }
        if let ArmingState::Disarmed { cause } = self.arming
            && self.missed_order != order
            && self.may_be_armed()
            && (self.order != order || matches!(cause, JointCause::GroupStopped | JointCause::BodyStopped))
        {
            self.order = order;
            self.arming = ArmingState::Armed { after: cause, lapses_at: Some(lapses_at), ending: None };
        }
    }

    /// Records a new order. The order does not arm the joint if its servo is silent now: a servo that returns later
    /// needs a new order. A servo that the order itself reboots is armed by it.
    pub(crate) fn note_order(&mut self, order: u64) {
        self.newest_order = order;
        let is_rebooted = matches!(self.link, Link::Silent { cause: JointCause::Alert, .. });
        if self.link.is_quarantined() && !is_rebooted {
            self.missed_order = order;
        }
    }

    /// Gives a new lock its number, `locks + 1`. Returns whether there was a new lock.
    pub(crate) fn count_lock(&mut self, locks: u64) -> bool {
        let ArmingState::Locked { number: number @ None, .. } = &mut self.arming else { return false };
        *number = Some(locks + 1);
        true
    }

    /// Unlocks the joint if the operator has seen its lock (it is among the first `locks`) and the cause is gone.
    /// What may still be wrong is checked again.
    ///
    /// An order stays valid for some seconds, so that torque which is still going off can go off. But a joint beyond
    /// its limits is unlocked only by a new order (`is_new`), because a person may have their hands on it.
    pub(crate) fn acknowledge(&mut self, now: Instant, locks: u64, is_new: bool) {
        let ArmingState::Locked { cause, number: Some(number) } = self.arming else { return };
        let is_off = matches!(self.power, Power::Off);
        if number > locks || self.let_go.is_some() || self.link.is_quarantined() {
            return;
        }
        let is_within =
            self.beyond_rad(now).is_some_and(|rad| rad <= self.policy.settings.max_beyond_limits_rad.get());
        if cause == JointCause::BeyondLimits {
            if !(is_new && is_within) {
                return;
            }
        } else if cause == JointCause::Blocked && self.power.is_on() {
            // The joint holds, and no longer presses against the obstacle.
        } else if !is_off {
            return;
        } else if cause == JointCause::Alert {
            // Only a reboot clears the shutdown.
            self.reboot_at = Some(now);
            self.power = Power::Unknown { was_on: false };
            self.link = Link::Silent { ask_at: now + REBOOT_WAIT, cause };
        } else if cause != JointCause::Blocked {
            self.are_limits_acknowledged |= matches!(self.trouble, Some(JointFault::OtherJoint(_)));
            self.begin_anew();
        }
        (self.trouble, self.reaction) = (None, None);
        self.arming = ArmingState::Disarmed { cause };
    }

    /// Disarms the joint for an emergency stop that lets it come to rest first.
    pub(crate) fn end_by_emergency(&mut self) {
        let ending = Disarming { cause: JointCause::Emergency, locks: false };
        if let Motion::Retreat { at, .. } = self.motion {
            // Lowering is aborted: the joint stops, and torque goes off.
            self.motion = Motion::Halt { at };
            self.reaction = Some(AlertReaction::Hold);
        }
        if self.arming.is_given() {
            self.begin_disarm(ending);
        } else if let ArmingState::Disarmed { .. } = self.arming {
            self.arming = ending.state();
        }
    }

    /// Restarts identification and inspection of its servo.
    pub(super) fn begin_anew(&mut self) {
        self.link = Link::Unknown;
        self.power = Power::Unknown { was_on: false };
        self.motion = Motion::Idle;
        self.clock.forget();
    }

    /// Switches torque off after commands have been absent for long.
    pub(super) fn release(&mut self, now: Instant) {
        let is_known =
            matches!(self.power, Power::Found { .. } | Power::Rising { is_on: true, .. } | Power::On { .. });
        if is_known {
            self.disarm(JointCause::CommandTimeout);
            self.switch_torque_off(now);
        } else if matches!(self.power, Power::Rising { .. }) {
            self.disarm(JointCause::CommandTimeout);
        }
    }

    /// Switches torque off from `now` on, in any state.
    pub(super) fn switch_torque_off(&mut self, now: Instant) {
        self.power = Power::Cutting { tell_at: now };
        (self.motion, self.goal, self.cut_at, self.behind_since) = (Motion::Idle, None, None, None);
        if let Some(ending) = self.arming.ending() {
            self.arming = ending.state();
        }
    }

    /// Disarms the joint at once. A lock stays.
    pub(super) fn disarm(&mut self, cause: JointCause) {
        match self.arming {
            ArmingState::Locked { .. } => {}
            ArmingState::Armed { ending: Some(ending @ Disarming { locks: true, .. }), .. } => {
                self.arming = ending.state();
            }
            ArmingState::Armed { .. } | ArmingState::Disarmed { .. } => {
                self.arming = ArmingState::Disarmed { cause }
            }
        }
        (self.motion, self.goal) = (Motion::Idle, None);
        self.abort_power_up();
    }

    /// Disarms or locks the joint once it has stopped; at once if it does not move.
    pub(super) fn begin_disarm(&mut self, ending: Disarming) {
        let ArmingState::Armed { after, lapses_at, ending: before } = self.arming else {
            if ending.locks && !self.arming.is_locked() {
                self.arming = ending.state();
            }
            return;
        };
        // A lock replaces a mere disarming; the first lock stays.
        let ending = before.filter(|before| before.locks || !ending.locks).unwrap_or(ending);
        if self.motion == Motion::Idle {
            self.abort_power_up();
            self.arming = ending.state();
        } else {
            self.goal = None;
            self.arming = ArmingState::Armed { after, lapses_at, ending: Some(ending) };
            self.halt();
        }
    }

    /// Aborts switching torque on.
    pub(super) fn abort_power_up(&mut self) {
        if let Power::Rising { step, is_on, is_tripped } = self.power {
            let watchdog = match step {
                PowerUpStep::ArmWatchdog if is_tripped => Watchdog::Tripped,
                PowerUpStep::ArmWatchdog => Watchdog::Unset,
                PowerUpStep::WriteGoal | PowerUpStep::Torque => Watchdog::Armed,
            };
            self.power = if is_on { Power::Found { watchdog, stay: None } } else { Power::Off };
        }
    }

    /// Updates the arming state: automatic arming, disarming, and lapse of an order.
    pub(super) fn update_arming(&mut self, now: Instant) {
        let BodyState { live, halt, body_stopped, .. } = self.body_state;
        if !live || body_stopped {
            self.abort_power_up();
        }
        self.lock_beyond_limits(now);
        match (self.arming, halt) {
            // Torque may come on while others are stopped; then the joint waits for them.
            (ArmingState::Armed { .. }, Some(cause)) if self.power.is_on() => {
                self.begin_disarm(Disarming { cause, locks: false });
            }
            (ArmingState::Armed { after, lapses_at: Some(lapses_at), ending: None }, _)
                if now >= lapses_at && !self.power.is_on() =>
            {
                self.disarm(after);
            }
            (ArmingState::Armed { after, ending: Some(ending), lapses_at }, _) => {
                // The reason of the stop is gone, and the configuration allows automatic arming after it.
                if !ending.locks && live && halt.is_none() && self.policy.arms_after(ending.cause) {
                    self.arming = ArmingState::Armed { after, lapses_at, ending: None };
                }
            }
            (ArmingState::Disarmed { cause }, _)
                if live && self.may_be_armed() && self.policy.arms_after(cause) =>
            {
                self.arming = ArmingState::Armed { after: cause, lapses_at: None, ending: None };
            }
            (ArmingState::Armed { .. } | ArmingState::Disarmed { .. } | ArmingState::Locked { .. }, _) => {}
        }
    }

    /// Whether an order arms the joint: its servo answers or is being identified. A joint that already has torque and
    /// has to wait for others is not armed, unless those wait for it as well.
    pub(super) fn may_be_armed(&self) -> bool {
        let waits = match self.power {
            Power::On { .. } => self.body_state.halt.is_some(),
            Power::Found { .. } => self.body_state.halt.is_some() && !self.stops_group(),
            Power::Unknown { .. } | Power::Off | Power::Rising { .. } | Power::Cutting { .. } => false,
        };
        self.let_go.is_none() && !self.is_absent() && !waits
    }

    /// Locks the joint if it was found too far beyond its limits.
    pub(super) fn lock_beyond_limits(&mut self, now: Instant) {
        let is_at_rest = self.motion == Motion::Idle && !self.arming.is_locked();
        let Some(rad) = self.beyond_rad(now).filter(|_| is_at_rest && matches!(self.link, Link::Answering))
        else {
            return;
        };
        if rad > self.policy.settings.max_beyond_limits_rad.get() {
            self.trouble = Some(JointFault::BeyondLimits { by_mrad: quantity::number::round_i64(rad * 1e3) });
            self.abort_power_up();
            self.arming = ArmingState::Locked { cause: JointCause::BeyondLimits, number: None };
            self.goal = None;
        }
    }
}

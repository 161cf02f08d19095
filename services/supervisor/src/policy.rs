//! The supervisor's decisions, as a pure function of time and events.
//!
//! Processes start one after the other in the given order, each when those before it are ready. They stop in reverse
//! order. A process is restarted if it dies, is not ready in time, or if its heartbeat stops. The restart delay
//! doubles each time. The run ends if one process dies too often within a window, refuses its configuration, or has
//! nothing left to do. A dead link never ends it.
//!
//! At the end, the motor process is told to stop at once, and the others in reverse order meanwhile. A second request
//! to stop does not shorten its timeout. If its last incarnation has not reported that torque is off, the supervisor
//! switches torque off before the mock servo bus stops.

mod lifecycle;

use std::fmt;

use clock::{Duration, Instant};
use config::leo::Supervisor;
use invariant::require;
use message::{Process, ProcessState};

use lifecycle::{ProcessLifecycle, Stage};

/// Heartbeat timeout of a process. The processes of the hot path have their own, the mock servo bus included; the
/// others may wait for a busy processor or disk.
fn heartbeat_timeout(settings: &Supervisor, process: Process) -> Duration {
    let is_hot = matches!(process, Process::Sensor | Process::Belief | Process::Motor | Process::MockBus);
    let timeout = if is_hot { settings.heartbeat_timeout_ms } else { settings.heartbeat_timeout_others_ms };
    timeout.duration()
}

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitKind {
    /// Exit status 0: nothing left to do. The motor process reports so that torque is off, and is restarted.
    Done,
    /// Exit status 2: the process refuses its configuration. A restart would not help.
    Refused,
    /// Any other exit status, or a signal.
    Failed,
}

/// An event that the policy reacts to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A process has died.
    Died(Process, ExitKind),
    /// The health of a process, as read just now.
    Heartbeat {
        /// The process.
        process: Process,
        /// Its state.
        state: ProcessState,
        /// Heartbeat counter; increases while the process works.
        beat: u64,
    },
    /// The leftovers of dead processes have been removed.
    CleanedUp,
    /// A stop request. A second one kills the processes, except those that switch torque off.
    Stop,
    /// The terminal has closed. Both the shell and the kernel may report it, so it never counts as a second stop
    /// request.
    HangUp,
    /// Shared memory was removed under the running robot: no process could start any more.
    MemoryRemoved,
    /// The supervisor has switched torque off, and has logged the servos for which this is not confirmed.
    TorqueIsOff,
    /// The requested run time is over.
    TimeIsOver,
}

/// Reason for killing a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KillReason {
    /// It was not ready in time.
    NotReady,
    /// Its heartbeat timed out.
    Hangs,
    /// It did not stop in time.
    DoesNotStop,
    /// A second stop request skips the stop timeout.
    Hurry,
}

/// How the run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// By request.
    Stopped,
    /// This process had nothing left to do.
    Done(Process),
    /// This process died too often.
    GaveUp(Process),
    /// This process refused its configuration.
    Refused(Process),
    /// Shared memory was removed.
    MemoryRemoved,
}

/// An action that the supervisor executes for the policy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Start a process as its `incarnation`th incarnation, counted from one.
    Start {
        /// The process.
        process: Process,
        /// The number of the incarnation.
        incarnation: u64,
    },
    /// Ask a process to stop.
    Terminate(Process),
    /// Kill a process.
    Kill(Process, KillReason),
    /// Clean up after dead processes, then report [`Event::CleanedUp`].
    CleanUp,
    /// All processes run for the first time.
    AllReady,
    /// No motor process runs any more, and the last one has not reported that torque is off. Switch it off, then
    /// report [`Event::TorqueIsOff`].
    SwitchTorqueOff,
    /// All processes are gone: the run is over.
    End(Outcome),
}

/// State of the robot as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotState {
    /// Number of processes that should run.
    pub of: usize,
    /// Number of processes that run with a current heartbeat.
    pub run: usize,
    /// Whether all processes have run at the same time before.
    pub were_ready: bool,
    /// Whether the run is over and the processes are being stopped.
    pub is_ending: bool,
}

impl RobotState {
    /// Whether all processes run and none is being stopped; input of the service manager's watchdog.
    #[must_use]
    pub const fn is_well(&self) -> bool {
        self.run == self.of && !self.is_ending
    }
}

impl fmt::Display for RobotState {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { of, run, were_ready, is_ending } = self;
        match (is_ending, were_ready, run == of) {
            (true, ..) => write!(out, "stopping: {run} of {of} processes still run"),
            (false, false, _) => write!(out, "starting: {run} of {of} processes run"),
            (false, true, true) => write!(out, "all {of} processes run"),
            (false, true, false) => write!(out, "{run} of {of} processes run, the others are being replaced"),
        }
    }
}

/// State machine that makes the supervisor's decisions.
#[derive(Clone, Debug)]
pub struct Policy {
    settings: Supervisor,
    lifecycles: Vec<ProcessLifecycle>,
    clean_up_state: CleanUpState,
    all_were_ready: bool,
    /// The outcome of the run, set by its first cause.
    ending: Option<Outcome>,
    /// Whether a stop was requested.
    stop_requested: bool,
    /// Whether a second stop request skips the stop timeouts.
    skips_stop_timeouts: bool,
    torque: Torque,
    looked_at: Instant,
}

/// Knowledge about the servos' torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Torque {
    /// No motor process has started yet, or torque was switched off since.
    Off,
    /// A motor process has started and has not reported that torque is off.
    Unknown,
    /// The supervisor is switching torque off.
    Switching,
}

/// Whether dead processes have left files behind. Nothing starts before they are removed, because they may block a
/// starting process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CleanUpState {
    No,
    Yes,
    Requested,
    /// Another process died while a clean-up was pending.
    RequestAgain,
}

impl Policy {
    /// No process runs yet; `order` is the start order.
    #[must_use]
    pub fn new(settings: Supervisor, order: &[Process], now: Instant) -> Self {
        let lifecycles = order.iter().map(|&process| ProcessLifecycle::new(process, now)).collect();
        Self {
            settings,
            lifecycles,
            clean_up_state: CleanUpState::No,
            all_were_ready: false,
            ending: None,
            stop_requested: false,
            skips_stop_timeouts: false,
            torque: Torque::Off,
            looked_at: now,
        }
    }

    /// Processes the events and returns the actions due `now`.
    pub fn step(&mut self, now: Instant, events: &[Event]) -> Vec<Action> {
        let mut actions = Vec::new();
        self.extend_deadline(now);
        for event in events {
            self.handle_event(now, *event, &mut actions);
        }
        for lifecycle in &mut self.lifecycles {
            lifecycle.watch(&self.settings, now, &mut actions);
        }
        if self.ending.is_none() {
            self.start_next(now, &mut actions);
        } else {
            self.stop_next(now, &mut actions);
        }
        actions
    }

    /// If the supervisor's step is late, the whole machine may have been paused. So between two steps at most half of
    /// the heartbeat timeout counts.
    fn extend_deadline(&mut self, now: Instant) {
        let late =
            now.since(self.looked_at).saturating_sub(self.settings.heartbeat_timeout_ms.duration() / 2);
        self.looked_at = now;
        if !late.is_zero() {
            self.lifecycles.iter_mut().for_each(|lifecycle| lifecycle.extend_deadline(late));
        }
    }

    /// Whether a process is starting or stopping, so that the next step should follow soon.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.ending.is_some()
            || self.clean_up_state != CleanUpState::No
            || !self.lifecycles.iter().all(|lifecycle| matches!(lifecycle.stage, Stage::Running { .. }))
    }

    /// The state of the robot as a whole.
    #[must_use]
    pub fn robot_state(&self) -> RobotState {
        let runs = |lifecycle: &&ProcessLifecycle| matches!(lifecycle.stage, Stage::Running { .. });
        RobotState {
            of: self.lifecycles.len(),
            run: self.lifecycles.iter().filter(runs).count(),
            were_ready: self.all_were_ready,
            is_ending: self.ending.is_some(),
        }
    }

    fn handle_event(&mut self, now: Instant, event: Event, actions: &mut Vec<Action>) {
        match event {
            Event::Died(process, ended) => self.record_exit(now, process, ended),
            Event::Heartbeat { process, state, beat } => {
                if let Some(lifecycle) =
                    self.lifecycles.iter_mut().find(|lifecycle| lifecycle.process == process)
                {
                    lifecycle.update_heartbeat(state, beat, now);
                }
            }
            Event::CleanedUp => {
                self.clean_up_state = if self.clean_up_state == CleanUpState::RequestAgain {
                    CleanUpState::Yes
                } else {
                    CleanUpState::No
                };
            }
            Event::Stop => {
                if std::mem::replace(&mut self.stop_requested, true) {
                    self.skips_stop_timeouts = true;
                    let hurried = self
                        .lifecycles
                        .iter_mut()
                        .filter(|lifecycle| !switches_torque_off(lifecycle.process));
                    actions.extend(hurried.filter_map(|lifecycle| lifecycle.kill(KillReason::Hurry)));
                }
                self.ending.get_or_insert(Outcome::Stopped);
            }
            Event::HangUp => {
                self.stop_requested = true;
                self.ending.get_or_insert(Outcome::Stopped);
            }
            Event::MemoryRemoved => {
                self.ending.get_or_insert(Outcome::MemoryRemoved);
            }
            Event::TorqueIsOff => self.torque = Torque::Off,
            Event::TimeIsOver => {
                self.ending.get_or_insert(Outcome::Stopped);
            }
        }
    }

    fn record_exit(&mut self, now: Instant, process: Process, ended: ExitKind) {
        let lifecycle = self.lifecycles.iter_mut().find(|lifecycle| lifecycle.process == process);
        let Some(lifecycle) = require!(lifecycle, "{process} is supervised") else { return };
        let asked = matches!(lifecycle.stage, Stage::Stopping { .. });
        let too_often = lifecycle.record_death(&self.settings, now);
        if process == Process::Motor && ended == ExitKind::Done {
            self.torque = Torque::Off;
        }
        self.clean_up_state = match self.clean_up_state {
            CleanUpState::No | CleanUpState::Yes => CleanUpState::Yes,
            CleanUpState::Requested | CleanUpState::RequestAgain => CleanUpState::RequestAgain,
        };
        if asked || self.ending.is_some() {
            return;
        }
        self.ending = match ended {
            ExitKind::Done if process != Process::Motor => Some(Outcome::Done(process)),
            ExitKind::Refused => Some(Outcome::Refused(process)),
            // Without a link the robot keeps running; only its peers receive nothing.
            ExitKind::Failed if process == Process::Link => None,
            ExitKind::Done | ExitKind::Failed => too_often.then_some(Outcome::GaveUp(process)),
        };
    }

    fn start_next(&mut self, now: Instant, actions: &mut Vec<Action>) {
        let starting =
            self.lifecycles.iter().any(|lifecycle| matches!(lifecycle.stage, Stage::Starting { .. }));
        if self.clean_up_state == CleanUpState::Yes && !starting {
            self.clean_up_state = CleanUpState::Requested;
            actions.push(Action::CleanUp);
        }
        if self.clean_up_state == CleanUpState::No {
            for lifecycle in &mut self.lifecycles {
                if let Stage::Waiting { until } = lifecycle.stage
                    && now >= until
                {
                    actions.push(lifecycle.start(now));
                    if lifecycle.process == Process::Motor {
                        self.torque = Torque::Unknown;
                    }
                }
                // The following processes wait until this one was ready once.
                if !lifecycle.was_ready {
                    break;
                }
            }
        }
        if !self.all_were_ready
            && self.lifecycles.iter().all(|lifecycle| matches!(lifecycle.stage, Stage::Running { .. }))
        {
            self.all_were_ready = true;
            actions.push(Action::AllReady);
        }
    }

    fn stop_next(&mut self, now: Instant, actions: &mut Vec<Action>) {
        let motor = self.lifecycles.iter_mut().find(|lifecycle| lifecycle.process == Process::Motor);
        let is_motor_gone = motor.is_none_or(|motor| {
            // It depends on no other process to decelerate, hold and switch torque off.
            actions.extend(motor.stop(now));
            motor.is_gone()
        });
        if is_motor_gone && self.torque == Torque::Unknown {
            self.torque = Torque::Switching;
            actions.push(Action::SwitchTorqueOff);
        }
        let is_off = is_motor_gone && self.torque == Torque::Off;
        for lifecycle in
            self.lifecycles.iter_mut().rev().filter(|lifecycle| lifecycle.process != Process::Motor)
        {
            if lifecycle.process == Process::MockBus && !is_off {
                return;
            }
            actions.extend(if self.skips_stop_timeouts {
                lifecycle.kill(KillReason::Hurry)
            } else {
                lifecycle.stop(now)
            });
            if !lifecycle.is_gone() {
                return;
            }
        }
        if is_off {
            actions.extend(self.ending.map(Action::End));
        }
    }
}

/// Whether torque is switched off by this process or through it. A second stop request never kills it.
fn switches_torque_off(process: Process) -> bool {
    matches!(process, Process::Motor | Process::MockBus)
}

#[cfg(test)]
mod tests;

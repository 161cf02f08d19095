//! What the supervisor decides: pure, over the time and the events it is told.
//!
//! Processes start one after the other in the order given, each when those before it are ready,
//! and stop in the reverse order. A process that dies, is not ready in time or lets its heart
//! stand still is started anew after a wait that doubles; too many deaths in a window end the run.
//!
//! At the end the motor process is told to stop first, beside the others, and is never hurried. Where its last life has
//! not said that torque is off, the supervisor switches it off itself, before the mock servo bus stops.

mod life;

use std::fmt;

use clock::{Duration, Instant};
use config::leo::Supervisor;
use message::{Process, ProcessState};

use life::{Life, Stage};

/// The bounds that the policy keeps.
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// From the start of a process to its being ready.
    pub ready_within: Duration,
    /// How long the heart of a process of the hot path may stand still, the servos' own included.
    pub heartbeat_timeout: Duration,
    /// How long that of any other may: it may wait for a processor, or a disk, that others keep busy.
    pub heartbeat_timeout_others: Duration,
    /// Wait before the first restart.
    pub backoff_first: Duration,
    /// The longest wait before a restart.
    pub backoff_most: Duration,
    /// Deaths of one process within the window that end the run.
    pub deaths_most: usize,
    /// The window; a life that lasted as long ends the doubling of the wait.
    pub deaths_window: Duration,
    /// From being told to stop to being killed.
    pub stop_within: Duration,
}

impl From<&Supervisor> for Terms {
    fn from(config: &Supervisor) -> Self {
        Self {
            ready_within: config.ready_within_ms.duration(),
            heartbeat_timeout: config.heartbeat_timeout_ms.duration(),
            heartbeat_timeout_others: config.heartbeat_timeout_others_ms.duration(),
            backoff_first: config.backoff_first_ms.duration(),
            backoff_most: config.backoff_most_ms.duration(),
            deaths_most: usize::try_from(config.deaths_most).unwrap_or(usize::MAX),
            deaths_window: config.deaths_window_ms.duration(),
            stop_within: config.stop_within_ms.duration(),
        }
    }
}

impl Terms {
    /// How long the heart of a process may stand still.
    fn patience(&self, process: Process) -> Duration {
        let is_hot = matches!(process, Process::Sensor | Process::Belief | Process::Motor | Process::MockBus);
        if is_hot { self.heartbeat_timeout } else { self.heartbeat_timeout_others }
    }
}

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// With nothing left to do: exit status 0. Of the motor process it says that torque is off, and never ends a run.
    Done,
    /// By itself, refusing what it was configured to do: exit status 2. Starting it anew would
    /// change nothing.
    Refused,
    /// In any other way.
    Failed,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A process is dead.
    Died(Process, Ended),
    /// The health of a process as it was read just now.
    Pulse {
        /// Whose.
        process: Process,
        /// Where it is in its life.
        state: ProcessState,
        /// Grows while it works.
        beat: u64,
    },
    /// What dead processes left behind is cleaned up.
    CleanedUp,
    /// Somebody wants the run to end. Said again, the processes are killed, all but those that switch torque off.
    Stop,
    /// The terminal is gone. A shell and the kernel both say so: however often, it is no second wish.
    HangUp,
    /// Shared memory was removed under the robot: no process could start any more.
    MemoryRemoved,
    /// The supervisor has switched torque off, and has said of which servos that is not known.
    TorqueIsOff,
    /// The run has lasted as long as it was to.
    TimeIsOver,
}

/// Why a process is killed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// It was not ready in time.
    NotReady,
    /// Its heart stood still.
    Hangs,
    /// It was told to stop and did not.
    DoesNotStop,
    /// Somebody does not want to wait for it to stop.
    Hurry,
}

/// How the run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Somebody wanted it to.
    Stopped,
    /// This process had nothing left to do.
    Done(Process),
    /// This process died too often.
    GaveUp(Process),
    /// This process refused its configuration.
    Refused(Process),
    /// Shared memory was removed under it.
    MemoryRemoved,
}

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Start a process for the `incarnation`th time, counted from one.
    Start {
        /// Which.
        process: Process,
        /// Counts its lives.
        incarnation: u64,
    },
    /// Ask a process to stop.
    Terminate(Process),
    /// Kill a process.
    Kill(Process, Why),
    /// Clean up after the dead, and say so with [`Event::CleanedUp`].
    CleanUp,
    /// All processes run, for the first time.
    AllReady,
    /// No motor process runs any more, and the last one has not said that torque is off: switch it off, and say so
    /// with [`Event::TorqueIsOff`].
    SwitchTorqueOff,
    /// All processes are gone: the run is over.
    End(Outcome),
}

/// How the robot stands as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// Processes that there should be.
    pub of: usize,
    /// Those that run, and whose hearts did not stand still for too long.
    pub run: usize,
    /// Whether all ran at once before.
    pub were_ready: bool,
    /// Whether the run is over, and the processes are being stopped.
    pub is_ending: bool,
}

impl Standing {
    /// Whether the robot is as it should be: what a watchdog over it wants to know.
    #[must_use]
    pub const fn is_well(&self) -> bool {
        self.run == self.of && !self.is_ending
    }
}

impl fmt::Display for Standing {
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

/// The supervisor's judgement.
#[derive(Clone, Debug)]
pub struct Policy {
    terms: Terms,
    lives: Vec<Life>,
    unclean: Unclean,
    all_were_ready: bool,
    /// How the run ends, by what ended it first.
    ending: Option<Outcome>,
    /// Whether somebody has wanted the run to end.
    was_told: bool,
    /// Whether somebody does not want to wait for that.
    hurry: bool,
    torque: Torque,
    looked_at: Instant,
}

/// What is known of the servos' torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Torque {
    /// No motor process has begun, or torque was switched off since.
    Off,
    /// A motor process has begun, and has not said that it switched torque off.
    Unknown,
    /// The supervisor is switching it off.
    Switching,
}

/// Whether dead processes left something behind. Nothing starts before it is cleaned up, because
/// it may be in the way of what starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unclean {
    No,
    Yes,
    Asked,
    /// Somebody died while we were waiting for the answer.
    AskAgain,
}

impl Policy {
    /// Nothing runs yet; `order` is the order of starting.
    #[must_use]
    pub fn new(terms: Terms, order: &[Process], now: Instant) -> Self {
        let lives = order.iter().map(|&process| Life::new(process, now)).collect();
        Self {
            terms,
            lives,
            unclean: Unclean::No,
            all_were_ready: false,
            ending: None,
            was_told: false,
            hurry: false,
            torque: Torque::Off,
            looked_at: now,
        }
    }

    /// Takes in what happened, and says what is to be done `now`.
    pub fn step(&mut self, now: Instant, events: &[Event]) -> Vec<Action> {
        let mut actions = Vec::new();
        self.forgive(now);
        for event in events {
            self.take_in(now, *event, &mut actions);
        }
        for life in &mut self.lives {
            life.watch(&self.terms, now, &mut actions);
        }
        if self.ending.is_none() {
            self.start_next(now, &mut actions);
        } else {
            self.stop_next(now, &mut actions);
        }
        actions
    }

    /// Where the supervisor itself comes late to a look, the machine may have stood still, and every heart
    /// with it: no more than half of the time that a heart may stand still passes between two looks.
    fn forgive(&mut self, now: Instant) {
        let late = now.since(self.looked_at).saturating_sub(self.terms.heartbeat_timeout / 2);
        self.looked_at = now;
        if !late.is_zero() {
            self.lives.iter_mut().for_each(|life| life.forgive(late));
        }
    }

    /// Whether a process is on its way up or down, so that the next step should come soon.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.ending.is_some()
            || self.unclean != Unclean::No
            || !self.lives.iter().all(|life| matches!(life.stage, Stage::Running { .. }))
    }

    /// How many processes there are, and how many of them run with a beating heart.
    #[must_use]
    pub fn standing(&self) -> Standing {
        let runs = |life: &&Life| matches!(life.stage, Stage::Running { .. });
        Standing {
            of: self.lives.len(),
            run: self.lives.iter().filter(runs).count(),
            were_ready: self.all_were_ready,
            is_ending: self.ending.is_some(),
        }
    }

    fn take_in(&mut self, now: Instant, event: Event, actions: &mut Vec<Action>) {
        match event {
            Event::Died(process, ended) => self.bury(now, process, ended),
            Event::Pulse { process, state, beat } => {
                if let Some(life) = self.lives.iter_mut().find(|life| life.process == process) {
                    life.feel(state, beat, now);
                }
            }
            Event::CleanedUp => {
                self.unclean = if self.unclean == Unclean::AskAgain { Unclean::Yes } else { Unclean::No };
            }
            Event::Stop => {
                if std::mem::replace(&mut self.was_told, true) {
                    self.hurry = true;
                    let hurried = self.lives.iter_mut().filter(|life| !switches_torque_off(life.process));
                    actions.extend(hurried.filter_map(|life| life.kill(Why::Hurry)));
                }
                self.ending.get_or_insert(Outcome::Stopped);
            }
            Event::HangUp => {
                self.was_told = true;
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

    fn bury(&mut self, now: Instant, process: Process, ended: Ended) {
        let Some(life) = self.lives.iter_mut().find(|life| life.process == process) else { return };
        let asked = matches!(life.stage, Stage::Stopping { .. });
        let too_often = life.die(&self.terms, now);
        if process == Process::Motor && ended == Ended::Done {
            self.torque = Torque::Off;
        }
        self.unclean = match self.unclean {
            Unclean::No | Unclean::Yes => Unclean::Yes,
            Unclean::Asked | Unclean::AskAgain => Unclean::AskAgain,
        };
        if asked || self.ending.is_some() {
            return;
        }
        self.ending = match ended {
            Ended::Done if process != Process::Motor => Some(Outcome::Done(process)),
            Ended::Refused => Some(Outcome::Refused(process)),
            // Without a link the robot runs on, and is only not heard elsewhere.
            Ended::Failed if process == Process::Link => None,
            Ended::Done | Ended::Failed => too_often.then_some(Outcome::GaveUp(process)),
        };
    }

    fn start_next(&mut self, now: Instant, actions: &mut Vec<Action>) {
        let starting = self.lives.iter().any(|life| matches!(life.stage, Stage::Starting { .. }));
        if self.unclean == Unclean::Yes && !starting {
            self.unclean = Unclean::Asked;
            actions.push(Action::CleanUp);
        }
        if self.unclean == Unclean::No {
            for life in &mut self.lives {
                if let Stage::Waiting { until } = life.stage
                    && now >= until
                {
                    actions.push(life.start(now));
                    if life.process == Process::Motor {
                        self.torque = Torque::Unknown;
                    }
                }
                // Those behind wait until this one was ready once.
                if !life.was_ready {
                    break;
                }
            }
        }
        if !self.all_were_ready && self.lives.iter().all(|life| matches!(life.stage, Stage::Running { .. })) {
            self.all_were_ready = true;
            actions.push(Action::AllReady);
        }
    }

    fn stop_next(&mut self, now: Instant, actions: &mut Vec<Action>) {
        let motor = self.lives.iter_mut().find(|life| life.process == Process::Motor);
        let is_motor_gone = motor.is_none_or(|motor| {
            // It needs none of the others to slow down, hold and let go, and waits for none.
            actions.extend(motor.stop(now));
            motor.is_gone()
        });
        if is_motor_gone && self.torque == Torque::Unknown {
            self.torque = Torque::Switching;
            actions.push(Action::SwitchTorqueOff);
        }
        let is_off = is_motor_gone && self.torque == Torque::Off;
        for life in self.lives.iter_mut().rev().filter(|life| life.process != Process::Motor) {
            if life.process == Process::MockBus && !is_off {
                return;
            }
            actions.extend(if self.hurry { life.kill(Why::Hurry) } else { life.stop(now) });
            if !life.is_gone() {
                return;
            }
        }
        if is_off {
            actions.extend(self.ending.map(Action::End));
        }
    }
}

/// Whether torque is switched off by this process, or over it: it is never killed because somebody is in a hurry.
fn switches_torque_off(process: Process) -> bool {
    matches!(process, Process::Motor | Process::MockBus)
}

#[cfg(test)]
mod tests;

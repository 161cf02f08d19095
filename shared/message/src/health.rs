use std::fmt;
use std::str::FromStr;

use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::{Histogram, numbered};

numbered! {
    /// A process of Leo, in the direction the data flows.
    Process: u16 {
        /// The workspace, the teacher and Leo's body.
        Simulator = 0,
        /// Observations to percepts.
        Sensor = 1,
        /// Percepts to beliefs.
        Belief = 2,
        /// Beliefs to tasks, tasks to joint goals.
        Learner = 3,
        /// The other end of the servo buses.
        MockBus = 4,
        /// Joint goals to servos, servos to joint states.
        Motor = 5,
        /// Tells people what happens.
        Console = 6,
        /// Starts and watches the others.
        Supervisor = 7,
        /// Carries frames between this machine and another one.
        Link = 8,
    }
}

impl Process {
    /// Its name, which is its subcommand.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simulator => "simulator",
            Self::Sensor => "sensor",
            Self::Belief => "belief",
            Self::Learner => "learner",
            Self::MockBus => "mock-bus",
            Self::Motor => "motor",
            Self::Console => "console",
            Self::Supervisor => "run",
            Self::Link => "link",
        }
    }
}

impl fmt::Display for Process {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name())
    }
}

/// A word that names no process.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no process `{0}`")]
pub struct UnknownProcess(pub String);

impl FromStr for Process {
    type Err = UnknownProcess;

    fn from_str(name: &str) -> Result<Self, UnknownProcess> {
        Self::ALL
            .iter()
            .copied()
            .find(|process| process.name() == name)
            .ok_or_else(|| UnknownProcess(name.to_owned()))
    }
}

numbered! {
    /// Where a process is in its life.
    ProcessState: u32 {
        /// Nothing was written yet.
        Absent = 0,
        /// Opening its ports, locking its memory.
        Starting = 1,
        /// In its loop.
        Running = 2,
        /// Told to stop.
        Stopping = 3,
    }
}

/// The health of one process: what its loop counted, for whoever looks.
///
/// It stands on a blackboard in shared memory, so that looking never touches the thread that is
/// looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Health/2")]
pub struct Health {
    /// The operating system's process number.
    pub pid: u32,
    state: u32,
    /// Counts the process's lives from one.
    pub incarnation: u64,
    /// Grows with every turn of the loop: a beat that stands still is a process that hangs.
    pub beat: u64,
    /// When the beat last grew, in nanoseconds of the monotonic clock.
    pub beat_at_ns: u64,
    /// When this life began.
    pub started_at_ns: u64,
    /// Configured period of the cycle; zero for a process that is woken.
    pub period_ns: u64,
    /// Cycles begun.
    pub cycles: u64,
    /// Cycles that ended after their deadline.
    pub overruns: u64,
    /// Releases skipped because a cycle ran past them; never made up.
    pub skipped: u64,
    /// Frames lost at the process's inlets, by gaps of the sequence.
    pub drops: u64,
    /// Frames that an outlet could not deliver to some reader.
    pub undelivered: u64,
    /// Frames or entries refused because they were nonsense.
    pub refused: u64,
    /// Frames refused because the supervisor's roster does not name the process that published them.
    pub unlisted_frames: u64,
    /// The process number of the newest such publisher; zero where there was none.
    pub unlisted_pid: u64,
    /// Page faults since the loop began, minor and major.
    pub page_faults: u64,
    /// Rights that were asked for and not granted, one bit each: scheduling, affinity, memory.
    pub missing_rights: u64,
    /// Release to start.
    pub wakeup: Histogram,
    /// Start to end.
    pub execution: Histogram,
    /// Age of the input when its step began: from the previous hop's publication.
    pub latency: Histogram,
}

impl Health {
    /// Where the process is in its life; `None` for nonsense.
    #[must_use]
    pub fn state(&self) -> Option<ProcessState> {
        ProcessState::from_raw(self.state)
    }

    /// Notes where the process is in its life.
    pub fn set_state(&mut self, state: ProcessState) {
        self.state = state.raw();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_found_by_its_name() {
        for process in Process::ALL {
            assert_eq!(process.name().parse(), Ok(*process));
        }
        assert_eq!("sensors".parse::<Process>(), Err(UnknownProcess("sensors".to_owned())));
    }
}

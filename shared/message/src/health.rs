use std::fmt;
use std::str::FromStr;

use crate::{Histogram, ZeroCopySend, wire_enum};

wire_enum! {
    /// A process of Leo, in the direction of the data flow. Its name is also its subcommand.
    Process: u16 {
        /// Simulates the workspace, the teacher and Leo's body.
        Simulator = 0 as "simulator",
        /// Turns observations into percepts.
        Sensor = 1 as "sensor",
        /// Turns percepts into beliefs.
        Belief = 2 as "belief",
        /// Learns tasks from beliefs, and turns tasks into joint goals.
        Learner = 3 as "learner",
        /// Simulates the servos at the other end of the buses.
        MockBus = 4 as "mock-bus",
        /// Sends joint goals to servos and publishes joint states.
        Motor = 5 as "motor",
        /// Serves the page, and reports events to people.
        Console = 6 as "console",
        /// Starts and monitors the other processes.
        Supervisor = 7 as "run",
        /// Transfers frames between this machine and another one.
        Link = 8 as "link",
    }
}

impl fmt::Display for Process {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name())
    }
}

/// The name of an unknown process.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no process `{0}`")]
pub struct UnknownProcessError(pub String);

impl FromStr for Process {
    type Err = UnknownProcessError;

    fn from_str(name: &str) -> Result<Self, UnknownProcessError> {
        Self::ALL
            .iter()
            .copied()
            .find(|process| process.name() == name)
            .ok_or_else(|| UnknownProcessError(name.to_owned()))
    }
}

wire_enum! {
    /// State of a process.
    ProcessState: u32 {
        /// The board has not been written yet.
        Absent = 0 as "down",
        /// Opening its ports and locking its memory.
        Starting = 1 as "starting",
        /// In its main loop.
        Running = 2 as "running",
        /// Received a stop request.
        Stopping = 3 as "stopping",
    }
}

/// Health of one process: the counters of its main loop.
///
/// It is on a board in shared memory, so that reading it never blocks the monitored thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Health/3")]
pub struct Health {
    /// The operating system's process id.
    pub pid: u32,
    state: u32,
    /// Incarnation of the process, from one.
    pub incarnation: u64,
    /// Heartbeat: incremented in every iteration of the main loop.
    pub beat: u64,
    /// Time of the last heartbeat, in nanoseconds of the monotonic clock.
    pub beat_at_ns: u64,
    /// Start time of this incarnation, in nanoseconds of the monotonic clock.
    pub started_at_ns: u64,
    /// Configured cycle period; zero for an event-driven process.
    pub period_ns: u64,
    /// Cycles started.
    pub cycles: u64,
    /// Cycles that missed their deadline.
    pub overruns: u64,
    /// Releases skipped because of an overrun; they are not made up for.
    pub skipped: u64,
    /// Frames lost at the process's subscribers, by gaps of the sequence number.
    pub drops: u64,
    /// Frames that a publisher could not deliver to some subscriber.
    pub undelivered: u64,
    /// Frames or entries refused as invalid.
    pub refused: u64,
    /// Frames refused because their publisher is not on the supervisor's roster.
    pub unlisted_frames: u64,
    /// Process id of the last such publisher; zero if there was none.
    pub unlisted_pid: u64,
    /// Failed checks of invariants since the process started; any value above zero is a bug.
    pub broken_invariants: u64,
    /// Minor and major page faults since the main loop started.
    pub page_faults: u64,
    /// Rights that were requested and not granted, one bit each: scheduling, affinity, memory.
    pub missing_rights: u64,
    /// Wake-up latency: from release to start.
    pub wakeup: Histogram,
    /// Execution time: from start to end.
    pub execution: Histogram,
    /// Age of the input when its step started, measured from its publication by the previous hop.
    pub latency: Histogram,
}

impl Health {
    /// The state of the process; `None` if the number is invalid.
    #[must_use]
    pub fn state(&self) -> Option<ProcessState> {
        ProcessState::from_raw(self.state)
    }

    /// Sets the state of the process.
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
        assert_eq!("sensors".parse::<Process>(), Err(UnknownProcessError("sensors".to_owned())));
    }
}

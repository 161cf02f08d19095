//! Lockstep: gives each process its turns at instants of simulated time.

use std::collections::BTreeMap;
use std::time::Duration;

use clock::Instant;
use message::{Done, Header, Process, Turn, TurnKind, Turns, TurnsDone};
use transport::{FramePublisher, FrameSubscriber, Node, PortError, ReceiveError, SendError};

/// Polling interval while waiting for a turn; between polls, the process is checked.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Reason why a turn was not completed.
#[derive(Debug, thiserror::Error)]
pub enum TurnError {
    /// The process ended during its turn, or before it.
    #[error("the process `{process}` died at {:.3} s of simulated time ({how})", seconds(*at))]
    Died {
        /// The process.
        process: Process,
        /// The simulated instant.
        at: Instant,
        /// Its exit status.
        how: String,
    },
    /// The process did not complete its turn in time.
    #[error("the process `{process}` hangs: its step at {:.3} s of simulated time took more than {} s", seconds(*at), within.as_secs())]
    Hangs {
        /// The process.
        process: Process,
        /// The simulated instant.
        at: Instant,
        /// The timeout.
        within: Duration,
    },
    /// The user requested a stop.
    #[error("interrupted")]
    Interrupted,
    /// The turn could not be sent.
    #[error(transparent)]
    Send(#[from] SendError),
    /// The reply could not be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
}

fn seconds(at: Instant) -> f64 {
    at.since(Instant::EPOCH).as_secs_f64()
}

/// Checks that the conductor makes while it waits for a turn.
pub trait ProcessMonitor {
    /// The exit status of the process, if it has ended.
    fn ended(&mut self, process: Process) -> Option<String>;
    /// Whether the user has requested a stop.
    fn interrupted(&mut self) -> bool;
}

/// Conducts the processes of a robot in lockstep time.
pub struct Conductor {
    turn_ports: BTreeMap<Process, TurnPorts>,
    within: Duration,
    round: u64,
}

struct TurnPorts {
    turns: FramePublisher<Turns>,
    done: FrameSubscriber<TurnsDone>,
}

impl Conductor {
    /// A conductor of `processes`, with a timeout of `within` for each turn.
    ///
    /// # Errors
    ///
    /// Shared memory is exhausted.
    pub fn open(node: &Node, processes: &[Process], within: Duration) -> Result<Self, PortError> {
        let mut turn_ports = BTreeMap::new();
        for &process in processes {
            let number = Some(u32::from(process.raw()));
            turn_ports.insert(
                process,
                TurnPorts { turns: node.publisher(number, 1)?, done: node.waking_subscriber(number)? },
            );
        }
        Ok(Self { turn_ports, within, round: 0 })
    }

    /// Gives one process its turn and waits until it is completed. Returns whether the process has nothing left to
    /// do.
    ///
    /// # Errors
    ///
    /// The process died, timed out or cannot be reached, or the user requested a stop.
    pub fn step(
        &mut self,
        process: Process,
        at: Instant,
        watch: &mut impl ProcessMonitor,
    ) -> Result<bool, TurnError> {
        // Asked before each turn, because the turns of a fast lesson never wait as long as the polling interval.
        if watch.interrupted() {
            return Err(TurnError::Interrupted);
        }
        self.round += 1;
        let turn = Turn { kind: TurnKind::Step.raw(), reserved: 0, round: self.round };
        let Some(ports) = self.turn_ports.get_mut(&process) else { return Ok(true) };
        ports.turns.send(Header::at(at.as_nanos()), 1, |_| turn, |_| {})?;
        let give_up = clock::now() + self.within;
        loop {
            ports.done.wait(POLL_INTERVAL)?;
            while let Some(frame) = ports.done.receive()? {
                if let Some(Done { round, finished }) = frame.entries().first()
                    && *round == self.round
                {
                    return Ok(*finished != 0);
                }
            }
            if let Some(how) = watch.ended(process) {
                return Err(TurnError::Died { process, at, how });
            }
            if watch.interrupted() {
                return Err(TurnError::Interrupted);
            }
            if clock::now() >= give_up {
                return Err(TurnError::Hangs { process, at, within: self.within });
            }
        }
    }

    /// Tells every process to exit.
    pub fn stop_all(&mut self) {
        self.round += 1;
        let turn = Turn { kind: TurnKind::Stop.raw(), reserved: 0, round: self.round };
        for ports in self.turn_ports.values_mut() {
            // A process that cannot be told is killed with the others.
            let _ = ports.turns.send(Header::default(), 1, |_| turn, |_| {});
        }
    }
}

/// Schedule of the processes' turns, on periodic grids that all start one period after zero.
#[derive(Clone, Debug)]
pub struct TurnSchedule {
    /// Processes in the order of their turns at the same instant, with period and next turn.
    due: Vec<(Process, Duration, Instant)>,
}

impl TurnSchedule {
    /// A timetable of processes with their periods, in the order of their turns.
    #[must_use]
    pub fn new(periods: &[(Process, Duration)]) -> Self {
        let due =
            periods.iter().map(|&(process, period)| (process, period, Instant::EPOCH + period)).collect();
        Self { due }
    }

    /// The next turn: process and instant. `None` if the timetable is empty.
    pub fn next_turn(&mut self) -> Option<(Process, Instant)> {
        // `min_by_key` returns the first of equal keys, which preserves the order of turns.
        let (process, period, at) = self.due.iter_mut().min_by_key(|(_, _, at)| *at)?;
        let turn = (*process, *at);
        *at += *period;
        Some(turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use message::Process::{Motor, Sensor, Simulator};

    #[test]
    fn process_turns_are_ordered_by_time_and_then_by_data_flow() {
        let ms = Duration::from_millis;
        let mut schedule = TurnSchedule::new(&[(Simulator, ms(5)), (Sensor, ms(5)), (Motor, ms(4))]);
        let turns: Vec<(Process, u64)> = std::iter::from_fn(|| schedule.next_turn())
            .take(14)
            .map(|(process, at)| (process, at.as_nanos() / 1_000_000))
            .collect();
        assert_eq!(
            turns,
            [
                (Motor, 4),
                (Simulator, 5),
                (Sensor, 5),
                (Motor, 8),
                (Simulator, 10),
                (Sensor, 10),
                (Motor, 12),
                (Simulator, 15),
                (Sensor, 15),
                (Motor, 16),
                (Simulator, 20),
                (Sensor, 20),
                (Motor, 20),
                (Motor, 24),
            ]
        );
    }
}

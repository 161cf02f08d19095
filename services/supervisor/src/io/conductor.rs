//! Lockstep: gives every process its turn at instants of simulated time.

use std::collections::BTreeMap;
use std::time::Duration;

use clock::Instant;
use message::{Done, Header, Process, Turn, TurnKind, Turns, TurnsDone};
use transport::{Inlet, Node, Outlet, PortError, ReceiveError, SendError};

/// A turn is waited for in slices of this length, between which the process is looked after.
const SLICE: Duration = Duration::from_millis(100);

/// Why a turn was not done.
#[derive(Debug, thiserror::Error)]
pub enum TurnError {
    /// The process ended in its turn, or before it.
    #[error("the process `{process}` died at {:.3} s of simulated time ({how})", seconds(*at))]
    Died {
        /// The process.
        process: Process,
        /// The simulated instant.
        at: Instant,
        /// Its exit status.
        how: String,
    },
    /// The process did not end its turn in time.
    #[error("the process `{process}` hangs: its turn at {:.3} s of simulated time is not done after {} s", seconds(*at), within.as_secs())]
    Hangs {
        /// The process.
        process: Process,
        /// The simulated instant.
        at: Instant,
        /// How long it was waited for.
        within: Duration,
    },
    /// The user wants to stop.
    #[error("interrupted")]
    Interrupted,
    /// No turn could be given.
    #[error(transparent)]
    Send(#[from] SendError),
    /// No answer could be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
}

fn seconds(at: Instant) -> f64 {
    at.since(Instant::EPOCH).as_secs_f64()
}

/// What the conductor asks between two slices of waiting.
pub trait Watch {
    /// How the process ended, if it did.
    fn ended(&mut self, process: Process) -> Option<String>;
    /// Whether the user wants to stop.
    fn interrupted(&mut self) -> bool;
}

/// The conductor of lockstep time.
pub struct Conductor {
    seats: BTreeMap<Process, Seat>,
    within: Duration,
    round: u64,
}

struct Seat {
    turns: Outlet<Turns>,
    done: Inlet<TurnsDone>,
}

impl Conductor {
    /// A conductor of `processes`, each of which has `within` to do a turn.
    ///
    /// # Errors
    ///
    /// Shared memory is full.
    pub fn open(node: &Node, processes: &[Process], within: Duration) -> Result<Self, PortError> {
        let mut seats = BTreeMap::new();
        for &process in processes {
            let number = Some(u32::from(process.raw()));
            seats.insert(process, Seat { turns: node.outlet(number, 1)?, done: node.waking_inlet(number)? });
        }
        Ok(Self { seats, within, round: 0 })
    }

    /// Gives one process its turn and waits until it is done; whether it has nothing more to do.
    ///
    /// # Errors
    ///
    /// The process died, hangs, or cannot be reached; the user wants to stop.
    pub fn step(&mut self, process: Process, at: Instant, watch: &mut impl Watch) -> Result<bool, TurnError> {
        self.round += 1;
        let turn = Turn { kind: TurnKind::Step.raw(), reserved: 0, round: self.round };
        let Some(seat) = self.seats.get_mut(&process) else { return Ok(true) };
        seat.turns.send(Header::at(at.as_nanos()), 1, |_| turn, |_| {})?;
        let give_up = clock::now() + self.within;
        loop {
            seat.done.wait(SLICE)?;
            while let Some(frame) = seat.done.receive()? {
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

    /// Tells every process to end.
    pub fn dismiss(&mut self) {
        self.round += 1;
        let turn = Turn { kind: TurnKind::Stop.raw(), reserved: 0, round: self.round };
        for seat in self.seats.values_mut() {
            // One that cannot be told is killed with the others.
            let _ = seat.turns.send(Header::default(), 1, |_| turn, |_| {});
        }
    }
}

/// When each process is due, on grids that begin together at one period after zero.
#[derive(Clone, Debug)]
pub struct Timetable {
    /// Processes in the order of their turns at one instant, each with its period.
    due: Vec<(Process, Duration, Instant)>,
}

impl Timetable {
    /// A timetable of processes with their periods, in the order of their turns.
    #[must_use]
    pub fn new(periods: &[(Process, Duration)]) -> Self {
        let due =
            periods.iter().map(|&(process, period)| (process, period, Instant::EPOCH + period)).collect();
        Self { due }
    }

    /// The next turn: whose, and when. `None` when nobody is in the timetable.
    pub fn next_turn(&mut self) -> Option<(Process, Instant)> {
        // `min_by_key` keeps the first of equals: the order of the turns.
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
    fn turns_come_in_order_of_time_and_then_of_the_data() {
        let ms = Duration::from_millis;
        let mut timetable = Timetable::new(&[(Simulator, ms(5)), (Sensor, ms(5)), (Motor, ms(4))]);
        let turns: Vec<(Process, u64)> = std::iter::from_fn(|| timetable.next_turn())
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

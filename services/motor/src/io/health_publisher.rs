use clock::{Duration, Instant};
use config::Robot;
use message::{Buses, Joints, Text};
use transport::BoardWriter;

use crate::Motor;
use crate::io::threads::BusThreads;

/// Period of writing the boards. A change of the unconfirmed servos is written at once, because an emergency stop
/// waits for it.
const EVERY: Duration = Duration::from_millis(100);

/// Publishes the health boards of the buses and joints.
pub(crate) struct HealthPublisher {
    board: BoardWriter<Buses>,
    joints_board: BoardWriter<Joints>,
    joints: Joints,
    buses: Buses,
    write_at: Instant,
    /// Number of servos that have not confirmed torque off, `None` while no torque off is requested; and since when.
    unconfirmed: (Option<usize>, Instant),
}

impl HealthPublisher {
    pub(crate) fn new(board: BoardWriter<Buses>, joints_board: BoardWriter<Joints>, robot: &Robot) -> Self {
        let mut buses = Buses::default();
        for (index, (place, bus)) in buses.buses.iter_mut().zip(&robot.motor.buses).enumerate() {
            place.name = Text::new(&bus.name);
            let joints = robot.motor.joints.iter().filter(|joint| joint.bus == index);
            place.joints = u64::try_from(joints.count()).unwrap_or(0);
            buses.count += 1;
        }
        Self {
            board,
            joints_board,
            joints: Joints::default(),
            buses,
            write_at: Instant::EPOCH,
            unconfirmed: (None, Instant::EPOCH),
        }
    }

    pub(crate) fn keep(&mut self, motor: &Motor, threads: &BusThreads, now: Instant) {
        let unconfirmed = motor.letting_go().map(|_| motor.unconfirmed());
        if unconfirmed != self.unconfirmed.0 {
            self.unconfirmed = (unconfirmed, now);
        }
        // A joint counts as limp once it has been sampled after the confirmation, one or two cycles later.
        let is_news = now.since(self.unconfirmed.1) < EVERY;
        if now < self.write_at && !is_news {
            return;
        }
        self.write_at = now + EVERY;
        for (index, (bus, (skipped, took))) in
            self.buses.buses.iter_mut().zip(threads.exchange_stats()).enumerate()
        {
            let counts = motor.bus_counts(index);
            bus.quarantined = u64::try_from(motor.quarantined(index)).unwrap_or(u64::MAX);
            bus.lost = u64::from(motor.is_lost(index));
            bus.exchanges = counts.exchanges;
            bus.skipped = skipped;
            bus.missed = counts.missed;
            bus.corrupt = counts.corrupt;
            bus.stale = counts.stale;
            bus.late_bytes = counts.late_bytes;
            bus.alerts = counts.fault_counters.alerts;
            bus.restarts = counts.fault_counters.restarts;
            bus.watchdogs = counts.fault_counters.watchdogs;
            bus.refusals = counts.fault_counters.refusals;
            bus.duplicates = counts.duplicates;
            bus.hang_ups = counts.hang_ups;
            bus.exchange = *took;
        }
        self.board.write(&self.buses);
        self.joints.set(motor.states());
        let counts = motor.counts();
        (self.joints.locks, self.joints.limited, self.joints.refused) =
            (counts.locks, counts.limited, counts.refused);
        self.joints_board.write(&self.joints);
    }
}

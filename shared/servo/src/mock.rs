//! A servo that behaves: a whole control table with its rules, and a motor behind it.
//!
//! Time is an argument, so the servo lives as well in simulated time, and two servos that hear
//! the same at the same instants do the same to the last bit.

mod dynamics;
mod line;
mod memory;

pub use line::Line;

use clock::{Duration, Instant};

use crate::mock::dynamics::Dynamics;
use crate::mock::memory::Memory;
use crate::table::{
    BUS_WATCHDOG, FIRMWARE, GOAL_POSITION, HARDWARE_ERROR_STATUS, ID, MODEL_NUMBER, REALTIME_TICK,
    RETURN_DELAY, STATUS_RETURN_LEVEL, TORQUE_ENABLE,
};
use crate::{Fault, Id, Model, position_count};

/// How long a servo hears nothing after it was told to reboot.
const REBOOT: Duration = Duration::from_millis(400);
/// The unit of the bus watchdog.
const WATCHDOG_UNIT_MS: u64 = 20;
/// What the watchdog reads once it tripped: −1.
const TRIPPED: i64 = 0xFF;

/// A servo.
#[derive(Clone, Debug)]
pub struct Servo {
    model: Model,
    memory: Memory,
    dynamics: Dynamics,
    now: Instant,
    /// Since when the realtime tick counts.
    started_at: Instant,
    /// When it last heard an instruction.
    heard_at: Instant,
    deaf_until: Instant,
}

impl Servo {
    /// A servo whose power comes on at `now` while it stands at `position_rad`, in radians from
    /// the middle of its range.
    #[must_use]
    pub fn new(model: Model, id: Id, position_rad: f64, now: Instant) -> Self {
        let mut memory = Memory::new(model);
        memory.set(ID, i64::from(id.get()));
        memory.set(GOAL_POSITION, i64::from(position_count(position_rad)));
        let dynamics = Dynamics::new(model, position_rad);
        let mut servo =
            Self { model, memory, dynamics, now, started_at: now, heard_at: now, deaf_until: now };
        servo.show();
        servo
    }

    /// Its identifier.
    #[must_use]
    pub fn id(&self) -> u8 {
        u8::try_from(self.memory.get(ID)).unwrap_or(u8::MAX)
    }

    /// Where it stands, in radians from the middle of its range.
    #[must_use]
    pub fn position_rad(&self) -> f64 {
        self.dynamics.motion().position_rad
    }

    /// Whether it answers anything now.
    #[must_use]
    pub fn is_listening(&self) -> bool {
        self.now >= self.deaf_until
    }

    /// Whether it has a hardware error, which every answer then says.
    #[must_use]
    pub fn has_alert(&self) -> bool {
        self.memory.get(HARDWARE_ERROR_STATUS) != 0
    }

    /// How much it answers: 0 pings, 1 reads too, 2 everything.
    #[must_use]
    pub fn status_return_level(&self) -> i64 {
        self.memory.get(STATUS_RETURN_LEVEL)
    }

    /// How long it waits before it answers.
    #[must_use]
    pub fn return_delay(&self) -> Duration {
        Duration::from_micros(2 * u64::try_from(self.memory.get(RETURN_DELAY)).unwrap_or(0))
    }

    /// Lives until `now`; an instant that has passed changes nothing.
    pub fn advance(&mut self, now: Instant) {
        if now <= self.now {
            return;
        }
        let torque = self.memory.get(TORQUE_ENABLE) == 1;
        let watchdog = self.memory.get(BUS_WATCHDOG);
        if torque && let Ok(units @ 1..=127) = u64::try_from(watchdog) {
            let trips_at = self.heard_at + Duration::from_millis(units * WATCHDOG_UNIT_MS);
            if now > trips_at {
                self.dynamics.advance(&self.memory, trips_at.since(self.now));
                self.now = self.now.max(trips_at);
                self.memory.set(BUS_WATCHDOG, TRIPPED);
                self.dynamics.stop();
            }
        }
        self.dynamics.advance(&self.memory, now.since(self.now));
        self.now = now;
        if self.dynamics.overheats(&self.memory) {
            self.memory.set(HARDWARE_ERROR_STATUS, 1 << 2);
            self.memory.set(TORQUE_ENABLE, 0);
        }
        self.show();
    }

    /// Notes that an instruction is on the bus, whomever it is for: any counts as life for the
    /// bus watchdog. Call it after [`advance`](Self::advance).
    pub fn hear(&mut self) {
        self.heard_at = self.now;
    }

    /// The data with which it answers a ping: model number and firmware.
    #[must_use]
    pub fn ping(&self) -> [u8; 3] {
        let [low, high] = self.model.number().to_le_bytes();
        [low, high, u8::try_from(self.memory.get(FIRMWARE)).unwrap_or(0)]
    }

    /// Bytes of its control table.
    ///
    /// # Errors
    ///
    /// [`Fault::Access`] beyond the table's end.
    pub fn read(&self, address: u16, length: u16) -> Result<&[u8], Fault> {
        self.memory.bytes(address, length).ok_or(Fault::Access)
    }

    /// Writes whole items of its control table: all of them or, with a fault, none.
    ///
    /// # Errors
    ///
    /// [`Fault::Access`] where an item may not be written, or not while torque is on;
    /// [`Fault::Length`] where one is written in part; [`Fault::Range`] and [`Fault::Limit`]
    /// where a value is out of bounds, and for goals once the bus watchdog has tripped.
    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), Fault> {
        let before = self.memory.get(TORQUE_ENABLE);
        let tripped = self.memory.get(BUS_WATCHDOG) == TRIPPED;
        let written = self.memory.write(address, data, tripped)?;
        if written.covers(TORQUE_ENABLE) && before == 0 && self.memory.get(TORQUE_ENABLE) == 1 {
            // With torque the goal becomes where the servo stands: it never jumps.
            self.memory.set(GOAL_POSITION, i64::from(position_count(self.position_rad())));
            self.dynamics.stop();
        }
        if written.covers(GOAL_POSITION) {
            self.dynamics.go();
        }
        Ok(())
    }

    /// Begins anew, as after power came on: what is kept without power stays.
    pub fn reboot(&mut self) {
        self.memory.forget();
        self.dynamics.stop();
        self.deaf_until = self.now + REBOOT;
        self.started_at = self.deaf_until;
        self.memory.set(GOAL_POSITION, i64::from(position_count(self.position_rad())));
        self.show();
    }

    /// Begins anew without a moment's silence, as after its power gave way too shortly for
    /// anybody to notice.
    pub fn restart(&mut self) {
        self.reboot();
        (self.deaf_until, self.started_at) = (self.now, self.now);
        self.show();
    }

    /// Makes it as warm as this, in °C.
    pub fn warm_to(&mut self, temperature_c: f64) {
        self.dynamics.warm_to(temperature_c);
        self.show();
    }

    /// Writes what it measures into its table.
    fn show(&mut self) {
        self.memory.set(MODEL_NUMBER, i64::from(self.model.number()));
        let tick = self.now.since(self.started_at).as_millis() % 32768;
        self.memory.set(REALTIME_TICK, i64::try_from(tick).unwrap_or(0));
        self.dynamics.show(&mut self.memory);
    }
}

#[cfg(test)]
mod tests;

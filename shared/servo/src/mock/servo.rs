use clock::{Duration, Instant};

use crate::mock::dynamics::{Dynamics, Obstacle};
use crate::mock::memory::{Memory, Mode};
use crate::table::{
    BAUD_RATE, BUS_WATCHDOG, DRIVE_MODE, FIRMWARE, GOAL_CURRENT, GOAL_POSITION, GOAL_PWM, GOAL_VELOCITY,
    HARDWARE_ERROR_STATUS, HOMING_OFFSET, ID, OPERATING_MODE, PRESENT_VELOCITY, PROFILE_ACCELERATION,
    PROFILE_VELOCITY, REALTIME_TICK, REGISTERED_INSTRUCTION, RETURN_DELAY, SECONDARY_ID, SHUTDOWN,
    STARTUP_CONFIGURATION, STATUS_RETURN_LEVEL, TORQUE_ENABLE,
};
use crate::{Backup, Fault, Id, Model, Reset, baud_rate};

/// How long a servo hears nothing after it was told to reboot.
const REBOOT: Duration = Duration::from_millis(400);
/// The unit of the bus watchdog.
const WATCHDOG_UNIT_MS: u64 = 20;
/// What the watchdog reads once it tripped: −1.
const TRIPPED: i64 = 0xFF;
/// The drive mode in which a goal switches the torque on.
const TORQUE_BY_GOAL: i64 = 1 << 3;
/// The startup configuration with which the torque comes on.
const STARTUP_TORQUE: i64 = 1;

/// What a servo protects itself from: bits of item 70, and of the mask in item 63.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HardwareError {
    /// The supply is out of its limits.
    InputVoltage,
    /// It is too hot.
    Overheating,
    /// The encoder fails.
    Encoder,
    /// The circuit was shocked, or has too little power.
    ElectricalShock,
    /// The load is too much for too long.
    Overload,
}

impl HardwareError {
    /// Its bit.
    #[must_use]
    pub const fn bit(self) -> i64 {
        match self {
            Self::InputVoltage => 1,
            Self::Overheating => 1 << 2,
            Self::Encoder => 1 << 3,
            Self::ElectricalShock => 1 << 4,
            Self::Overload => 1 << 5,
        }
    }
}

/// A servo.
#[derive(Clone, Debug)]
pub struct Servo {
    model: Model,
    memory: Memory,
    dynamics: Dynamics,
    now: Instant,
    /// Since when the realtime tick counts, and for how long it has stood still since then.
    started_at: Instant,
    stood_still: Duration,
    has_stopped_clock: bool,
    /// When it last heard an instruction.
    heard_at: Instant,
    deaf_until: Instant,
    /// A write that waits for an action.
    registered: Option<(u16, Vec<u8>)>,
}

impl Servo {
    /// A servo whose power comes on at `now` while it stands at `position_rad`, in radians from
    /// the middle of its range.
    #[must_use]
    pub fn new(model: Model, id: Id, position_rad: f64, now: Instant) -> Self {
        let mut memory = Memory::new(model);
        memory.set(ID, i64::from(id.get()));
        let dynamics = Dynamics::new(model, position_rad);
        memory.set(GOAL_POSITION, i64::from(dynamics.count(&memory)));
        let mut servo = Self {
            model,
            memory,
            dynamics,
            now,
            started_at: now,
            stood_still: Duration::ZERO,
            has_stopped_clock: false,
            heard_at: now,
            deaf_until: now,
            registered: None,
        };
        servo.show();
        servo
    }

    /// The same servo with firmware of another version. An older one knows no fast reads.
    #[must_use]
    pub fn with_firmware(mut self, version: u8) -> Self {
        self.memory.set(FIRMWARE, i64::from(version));
        self
    }

    /// Whether it answers fast sync and fast bulk reads.
    #[must_use]
    pub fn knows_fast_reads(&self) -> bool {
        let [.., firmware] = self.ping();
        self.model.knows_fast_reads(firmware)
    }

    /// Its model.
    #[must_use]
    pub const fn model(&self) -> Model {
        self.model
    }

    /// Its identifier.
    #[must_use]
    pub fn id(&self) -> u8 {
        u8::try_from(self.memory.get(ID)).unwrap_or(u8::MAX)
    }

    /// The identifier to which it listens too, without answering; none where it is no identifier.
    #[must_use]
    pub fn secondary_id(&self) -> Option<Id> {
        u8::try_from(self.memory.get(SECONDARY_ID)).ok().and_then(Id::new)
    }

    /// The speed at which it listens, in bits per second.
    #[must_use]
    pub fn baud(&self) -> u32 {
        u8::try_from(self.memory.get(BAUD_RATE)).ok().and_then(baud_rate).unwrap_or(0)
    }

    /// Where its shaft stands, in radians from the middle of its range, whichever way its drive mode counts.
    #[must_use]
    pub fn position_rad(&self) -> f64 {
        self.dynamics.motion().position_rad
    }

    /// Since when its realtime tick counts.
    #[must_use]
    pub const fn started_at(&self) -> Instant {
        self.started_at
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
        Duration::from_micros(2 * u64::from(self.memory.get(RETURN_DELAY).to_le_bytes()[0]))
    }

    /// Lives until `now`; an instant that has passed changes nothing.
    pub fn advance(&mut self, now: Instant) {
        if now <= self.now {
            return;
        }
        if self.has_stopped_clock {
            self.stood_still += now.since(self.now);
        }
        let torque = self.memory.get(TORQUE_ENABLE) == 1;
        let watchdog = self.memory.get(BUS_WATCHDOG);
        if torque
            && !self.defeats_watchdog()
            && let Ok(units @ 1..=127) = u64::try_from(watchdog)
        {
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
        self.protect(self.dynamics.errors(&self.memory));
        self.show();
    }

    /// A homing offset keeps the watchdog from tripping in extended position mode, as it does in
    /// the servos on sale.
    fn defeats_watchdog(&self) -> bool {
        self.memory.mode() == Mode::ExtendedPosition && self.memory.get(HOMING_OFFSET) != 0
    }

    /// Shows what is wrong, and lets go where the shutdown mask says so: until a reboot then.
    fn protect(&mut self, errors: i64) {
        let shutdown = errors & self.memory.get(SHUTDOWN);
        self.memory.latch(shutdown);
        self.memory.set(HARDWARE_ERROR_STATUS, self.memory.latched() | errors);
        if shutdown != 0 {
            self.memory.set(TORQUE_ENABLE, 0);
            self.dynamics.stop();
        }
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
    /// [`Fault::Access`] where an item may not be written, or not while torque is on, and where
    /// torque is to come on after a shutdown; [`Fault::Length`] where one is written in part;
    /// [`Fault::Range`] and [`Fault::Limit`] where a value is out of bounds, and for goals once the
    /// bus watchdog has tripped.
    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), Fault> {
        let torque_before = self.memory.get(TORQUE_ENABLE);
        let written = self.memory.write(address, data, self.is_tripped())?;
        let covers = |item| written.covers(item);
        let mut torque = self.memory.get(TORQUE_ENABLE);
        let goal = [GOAL_PWM, GOAL_CURRENT, GOAL_VELOCITY, GOAL_POSITION].into_iter().any(covers);
        if goal && self.memory.get(DRIVE_MODE) & TORQUE_BY_GOAL != 0 && self.memory.latched() == 0 {
            self.memory.set(TORQUE_ENABLE, 1);
            torque = 1;
        }
        if torque_before == 0 && torque == 1 {
            self.begin_torque(covers(GOAL_POSITION));
        }
        if covers(OPERATING_MODE) {
            self.change_mode();
        }
        if goal {
            self.dynamics.go(&self.memory);
        }
        if covers(DRIVE_MODE) || covers(HOMING_OFFSET) {
            self.show();
        }
        Ok(())
    }

    fn is_tripped(&self) -> bool {
        self.memory.get(BUS_WATCHDOG) == TRIPPED
    }

    /// Torque came on: in position mode the position is within one turn from now on.
    fn begin_torque(&mut self, has_goal: bool) {
        self.dynamics.stop();
        if self.memory.mode() == Mode::Position {
            self.dynamics.unwind(&self.memory);
        }
        if !has_goal {
            self.stand();
        }
        self.show();
    }

    /// The goal becomes where it stands: with torque it never jumps.
    fn stand(&mut self) {
        let offset = self.memory.get(HOMING_OFFSET);
        self.memory.set(GOAL_POSITION, i64::from(self.dynamics.count(&self.memory)) + offset);
        self.dynamics.stop();
    }

    fn change_mode(&mut self) {
        self.memory.reset_goals();
        self.memory.set(PROFILE_ACCELERATION, 0);
        self.memory.set(PROFILE_VELOCITY, 0);
        if self.memory.mode() == Mode::Position {
            self.dynamics.unwind(&self.memory);
        }
        self.stand();
        self.show();
    }

    /// Keeps a write until the [action](Self::act).
    ///
    /// # Errors
    ///
    /// Those of [`write`](Self::write).
    pub fn register(&mut self, address: u16, data: &[u8]) -> Result<(), Fault> {
        self.memory.check(address, data, self.is_tripped())?;
        self.registered = Some((address, data.to_vec()));
        self.memory.set(REGISTERED_INSTRUCTION, 1);
        Ok(())
    }

    /// Writes what is registered.
    ///
    /// # Errors
    ///
    /// [`Fault::Instruction`] when nothing is, and those of [`write`](Self::write).
    pub fn act(&mut self) -> Result<(), Fault> {
        let (address, data) = self.registered.take().ok_or(Fault::Instruction)?;
        self.memory.set(REGISTERED_INSTRUCTION, 0);
        self.write(address, &data)
    }

    /// Forgets whole turns.
    ///
    /// # Errors
    ///
    /// [`Fault::Result`] while it moves.
    pub fn clear(&mut self) -> Result<(), Fault> {
        if self.memory.get(PRESENT_VELOCITY) != 0 {
            return Err(Fault::Result);
        }
        self.dynamics.unwind(&self.memory);
        self.stand();
        self.show();
        Ok(())
    }

    /// Keeps the control table, or takes it from the backup and begins anew.
    ///
    /// # Errors
    ///
    /// [`Fault::Result`] while torque is on, or when there is no backup.
    pub fn back_up(&mut self, backup: Backup) -> Result<(), Fault> {
        if self.memory.get(TORQUE_ENABLE) == 1 {
            return Err(Fault::Result);
        }
        match backup {
            Backup::Store => self.memory.store(),
            Backup::Restore if self.memory.restore() => self.reboot(),
            Backup::Restore => return Err(Fault::Result),
        }
        Ok(())
    }

    /// Puts the EEPROM back to what it was in the box, and begins anew.
    pub fn factory_reset(&mut self, reset: Reset) {
        self.memory.reset(reset);
        self.reboot();
    }

    /// Begins anew, as after power came on: what is kept without power stays.
    pub fn reboot(&mut self) {
        self.lose_power(self.now);
    }

    /// Has no power until an instant, and begins anew then.
    pub fn lose_power(&mut self, until: Instant) {
        self.memory.forget();
        self.registered = None;
        self.dynamics.stop();
        self.dynamics.unwind(&self.memory);
        self.deaf_until = until + REBOOT;
        (self.started_at, self.stood_still) = (self.deaf_until, Duration::ZERO);
        self.stand();
        if self.memory.get(STARTUP_CONFIGURATION) & STARTUP_TORQUE != 0 {
            self.memory.set(TORQUE_ENABLE, 1);
        }
        self.show();
    }

    /// Begins anew without a moment's silence, as after its power gave way too shortly for
    /// anybody to hear.
    pub fn restart(&mut self) {
        self.lose_power(self.now);
        (self.deaf_until, self.started_at) = (self.now, self.now);
        self.show();
    }

    /// Whether its realtime tick stands still.
    pub(super) const fn has_stopped_clock(&self) -> bool {
        self.has_stopped_clock
    }

    /// Has its realtime tick stand still from now on, or go on from where it stands.
    pub(super) const fn stop_clock(&mut self, stop: bool) {
        self.has_stopped_clock = stop;
    }

    /// Is pushed by somebody's hand, in radians.
    pub fn push_by(&mut self, by_rad: f64) {
        self.dynamics.push_by(by_rad);
        self.show();
    }

    /// Is as warm as this from now on, in °C.
    pub fn warm_to(&mut self, temperature_c: f64) {
        self.dynamics.warm_to(temperature_c);
        self.show();
    }

    /// Has a hardware error until it is rebooted, and lets go where the shutdown mask says so.
    pub fn fail(&mut self, error: HardwareError) {
        self.memory.latch(error.bit());
        self.protect(error.bit());
    }

    /// Puts a load on it, in amperes of what holds it.
    pub fn load(&mut self, amperes: f64) {
        self.dynamics.load(amperes);
    }

    /// An obstacle holds its shaft from now on, or no longer: it does not move, and with torque its current rises
    /// to its limit as its trajectory goes on.
    pub fn block(&mut self, blocked: bool) {
        self.dynamics.block(Obstacle::Caller, blocked);
    }

    /// Whether an obstacle holds its shaft.
    #[must_use]
    pub const fn is_blocked(&self) -> bool {
        self.dynamics.is_blocked()
    }

    /// Whether a fault holds its shaft.
    pub(super) const fn is_obstructed(&self) -> bool {
        self.dynamics.is_held_by(Obstacle::Fault)
    }

    /// As [`block`](Self::block), by a fault.
    pub(super) const fn obstruct(&mut self, blocked: bool) {
        self.dynamics.block(Obstacle::Fault, blocked);
    }

    /// Its supply has this voltage, in volts, until it is told none.
    pub(super) const fn sag(&mut self, volts: Option<f64>) {
        self.dynamics.sag(volts);
    }

    /// What its supply has while it sags, in volts.
    pub(super) const fn sags(&self) -> Option<f64> {
        self.dynamics.sags()
    }

    /// Gives it another supply, in volts.
    pub fn supply(&mut self, volts: f64) {
        self.dynamics.supply(volts);
    }

    /// Writes what it measures into its table.
    fn show(&mut self) {
        let goes_for = self.now.since(self.started_at).saturating_sub(self.stood_still);
        let tick = goes_for.as_millis() % 32768;
        self.memory.set(REALTIME_TICK, i64::try_from(tick).unwrap_or(0));
        self.dynamics.show(&mut self.memory);
        self.memory.refresh();
    }
}

#[cfg(test)]
mod tests;

use clock::{Duration, Instant};

use crate::mock::dynamics::Dynamics;
use crate::mock::memory::{Memory, Mode};
use crate::table::{
    BAUD_RATE, BUS_WATCHDOG, DRIVE_MODE, FIRMWARE, GOAL_CURRENT, GOAL_POSITION, GOAL_PWM, GOAL_VELOCITY,
    HARDWARE_ERROR_STATUS, HOMING_OFFSET, ID, OPERATING_MODE, PRESENT_VELOCITY, PROFILE_ACCELERATION,
    PROFILE_VELOCITY, REALTIME_TICK, REGISTERED_INSTRUCTION, RETURN_DELAY, SECONDARY_ID, SHUTDOWN,
    STARTUP_CONFIGURATION, STATUS_RETURN_LEVEL, TORQUE_ENABLE,
};
use crate::{Backup, Fault, Id, Model, Reset, baud_rate};

/// Time without reception after a reboot.
const REBOOT: Duration = Duration::from_millis(400);
/// Unit of the bus watchdog.
const WATCHDOG_UNIT_MS: u64 = 20;
/// Value of the watchdog after it tripped: −1.
const TRIPPED: i64 = 0xFF;
/// Drive mode bit for torque on by goal update.
const TORQUE_BY_GOAL: i64 = 1 << 3;
/// Startup configuration bit for torque on at startup.
const STARTUP_TORQUE: i64 = 1;

/// A hardware error: a bit of Hardware Error Status (address 70), and of the mask in Shutdown (address 63).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HardwareError {
    /// Input voltage out of range.
    InputVoltage = 1,
    /// Overheating.
    Overheating = 1 << 2,
    /// Encoder error.
    Encoder = 1 << 3,
    /// Electrical shock, or too little power.
    ElectricalShock = 1 << 4,
    /// Overload.
    Overload = 1 << 5,
}

impl HardwareError {
    /// Its bit.
    #[must_use]
    pub const fn bit(self) -> i64 {
        self as i64
    }
}

/// A simulated servo.
#[derive(Clone, Debug)]
pub struct Servo {
    model: Model,
    memory: Memory,
    pub(super) dynamics: Dynamics,
    now: Instant,
    /// The start of the realtime tick, and for how long it was stopped since then.
    started_at: Instant,
    stopped_for: Duration,
    pub(super) has_stopped_clock: bool,
    /// The time of the last instruction on the bus.
    heard_at: Instant,
    unresponsive_until: Instant,
    /// A registered write that waits for an Action.
    registered: Option<(u16, Vec<u8>)>,
}

impl Servo {
    /// A servo that is powered on at `now`, at `position_rad` from the middle of its range.
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
            stopped_for: Duration::ZERO,
            has_stopped_clock: false,
            heard_at: now,
            unresponsive_until: now,
            registered: None,
        };
        servo.show();
        servo
    }

    /// Sets the firmware version. Older versions do not support fast reads.
    #[must_use]
    pub fn with_firmware(mut self, version: u8) -> Self {
        self.memory.set(FIRMWARE, i64::from(version));
        self
    }

    /// Whether it replies to Fast Sync Read and Fast Bulk Read.
    #[must_use]
    pub fn supports_fast_reads(&self) -> bool {
        let [.., firmware] = self.ping();
        self.model.supports_fast_reads(firmware)
    }

    /// Its model.
    #[must_use]
    pub const fn model(&self) -> Model {
        self.model
    }

    /// Its ID.
    #[must_use]
    pub fn id(&self) -> u8 {
        u8::try_from(self.memory.get(ID)).unwrap_or(u8::MAX)
    }

    /// Its secondary ID, which it obeys without a status packet; `None` if it is not a valid ID.
    #[must_use]
    pub fn secondary_id(&self) -> Option<Id> {
        u8::try_from(self.memory.get(SECONDARY_ID)).ok().and_then(Id::new)
    }

    /// Its baud rate, in bits per second.
    #[must_use]
    pub fn baud(&self) -> u32 {
        u8::try_from(self.memory.get(BAUD_RATE)).ok().and_then(baud_rate).unwrap_or(0)
    }

    /// The shaft's position, in radians from the middle of its range, independent of the drive mode.
    #[must_use]
    pub fn position_rad(&self) -> f64 {
        self.dynamics.motion.position_rad
    }

    /// The start of its realtime tick.
    #[must_use]
    pub const fn started_at(&self) -> Instant {
        self.started_at
    }

    /// Whether it receives instructions now.
    #[must_use]
    pub fn is_listening(&self) -> bool {
        self.now >= self.unresponsive_until
    }

    /// Whether it has a hardware error, which every status packet signals.
    #[must_use]
    pub fn has_alert(&self) -> bool {
        self.memory.get(HARDWARE_ERROR_STATUS) != 0
    }

    /// Its status return level: 0 pings only, 1 also reads, 2 all instructions.
    #[must_use]
    pub fn status_return_level(&self) -> i64 {
        self.memory.get(STATUS_RETURN_LEVEL)
    }

    /// Its return delay time.
    #[must_use]
    pub fn return_delay(&self) -> Duration {
        Duration::from_micros(2 * u64::from(self.memory.get(RETURN_DELAY).to_le_bytes()[0]))
    }

    /// Advances the simulation to `now`; an earlier instant has no effect.
    pub fn advance(&mut self, now: Instant) {
        if now <= self.now {
            return;
        }
        if self.has_stopped_clock {
            self.stopped_for += now.since(self.now);
        }
        let torque = self.memory.get(TORQUE_ENABLE) == 1;
        let watchdog = self.memory.get(BUS_WATCHDOG);
        if torque
            && !self.disables_watchdog()
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

    /// A homing offset disables the watchdog in extended position mode, as in the real servos.
    fn disables_watchdog(&self) -> bool {
        self.memory.mode() == Mode::ExtendedPosition && self.memory.get(HOMING_OFFSET) != 0
    }

    /// Reports errors, and switches the torque off for those in the shutdown mask, until a reboot.
    fn protect(&mut self, errors: i64) {
        let shutdown = errors & self.memory.get(SHUTDOWN);
        self.memory.latched |= shutdown;
        self.memory.set(HARDWARE_ERROR_STATUS, self.memory.latched | errors);
        if shutdown != 0 {
            self.memory.set(TORQUE_ENABLE, 0);
            self.dynamics.stop();
        }
    }

    /// Feeds the bus watchdog: any instruction on the bus counts, whatever its addressee. Call it after
    /// [`advance`](Self::advance).
    pub fn hear(&mut self) {
        self.heard_at = self.now;
    }

    /// The parameters of its ping reply: model number and firmware version.
    #[must_use]
    pub fn ping(&self) -> [u8; 3] {
        let [low, high] = self.model.number().to_le_bytes();
        [low, high, u8::try_from(self.memory.get(FIRMWARE)).unwrap_or(0)]
    }

    /// Reads its control table.
    ///
    /// # Errors
    ///
    /// [`Fault::Access`] beyond the table's end.
    pub fn read(&self, address: u16, length: u16) -> Result<&[u8], Fault> {
        self.memory.bytes(address, length).ok_or(Fault::Access)
    }

    /// Writes complete items of its control table: all of them or, with an error, none.
    ///
    /// # Errors
    ///
    /// [`Fault::Access`] if an item is not writable, or not while torque is on, or if torque is enabled after a
    /// shutdown; [`Fault::Length`] if an item is written in part; [`Fault::Range`] or [`Fault::Limit`] if a value is
    /// out of bounds, and for goals after the bus watchdog has tripped.
    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), Fault> {
        let torque_before = self.memory.get(TORQUE_ENABLE);
        let written = self.memory.write(address, data, self.is_tripped())?;
        let covers = |item| written.covers(item);
        let mut torque = self.memory.get(TORQUE_ENABLE);
        let goal = [GOAL_PWM, GOAL_CURRENT, GOAL_VELOCITY, GOAL_POSITION].into_iter().any(covers);
        if goal && self.memory.get(DRIVE_MODE) & TORQUE_BY_GOAL != 0 && self.memory.latched == 0 {
            self.memory.set(TORQUE_ENABLE, 1);
            torque = 1;
        }
        if torque_before == 0 && torque == 1 {
            self.enable_torque(covers(GOAL_POSITION));
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

    /// Torque was enabled: in position mode the position is reduced to one turn.
    fn enable_torque(&mut self, has_goal: bool) {
        self.dynamics.stop();
        if self.memory.mode() == Mode::Position {
            self.dynamics.remove_turns(&self.memory);
        }
        if !has_goal {
            self.hold_position();
        }
        self.show();
    }

    /// Sets the goal to the present position, so that the servo never jumps.
    fn hold_position(&mut self) {
        let offset = self.memory.get(HOMING_OFFSET);
        self.memory.set(GOAL_POSITION, i64::from(self.dynamics.count(&self.memory)) + offset);
        self.dynamics.stop();
    }

    fn change_mode(&mut self) {
        self.memory.reset_goals();
        self.memory.set(PROFILE_ACCELERATION, 0);
        self.memory.set(PROFILE_VELOCITY, 0);
        if self.memory.mode() == Mode::Position {
            self.dynamics.remove_turns(&self.memory);
        }
        self.hold_position();
        self.show();
    }

    /// Registers a write for the [action](Self::act).
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

    /// Executes the registered write.
    ///
    /// # Errors
    ///
    /// [`Fault::Instruction`] without a registered write, and those of [`write`](Self::write).
    pub fn act(&mut self) -> Result<(), Fault> {
        let (address, data) = self.registered.take().ok_or(Fault::Instruction)?;
        self.memory.set(REGISTERED_INSTRUCTION, 0);
        self.write(address, &data)
    }

    /// Clears the multi-turn revolutions.
    ///
    /// # Errors
    ///
    /// [`Fault::Result`] while it moves.
    pub fn clear(&mut self) -> Result<(), Fault> {
        if self.memory.get(PRESENT_VELOCITY) != 0 {
            return Err(Fault::Result);
        }
        self.dynamics.remove_turns(&self.memory);
        self.hold_position();
        self.show();
        Ok(())
    }

    /// Stores the control table in the backup, or restores it and reboots.
    ///
    /// # Errors
    ///
    /// [`Fault::Result`] while torque is on, or without a backup.
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

    /// Resets the EEPROM to its defaults, and reboots.
    pub fn factory_reset(&mut self, reset: Reset) {
        self.memory.reset(reset);
        self.reboot();
    }

    /// Reboots: the EEPROM persists.
    pub fn reboot(&mut self) {
        self.lose_power(self.now);
    }

    /// Removes power until an instant, and reboots then.
    pub fn lose_power(&mut self, until: Instant) {
        self.memory.reset_ram();
        self.registered = None;
        self.dynamics.stop();
        self.dynamics.remove_turns(&self.memory);
        self.unresponsive_until = until + REBOOT;
        (self.started_at, self.stopped_for) = (self.unresponsive_until, Duration::ZERO);
        self.hold_position();
        if self.memory.get(STARTUP_CONFIGURATION) & STARTUP_TORQUE != 0 {
            self.memory.set(TORQUE_ENABLE, 1);
        }
        self.show();
    }

    /// Restarts without a time of silence, as after a power dip too short to be noticed.
    pub fn restart(&mut self) {
        self.lose_power(self.now);
        (self.unresponsive_until, self.started_at) = (self.now, self.now);
        self.show();
    }

    /// Displaces the shaft by an external force, in radians.
    pub fn displace(&mut self, by_rad: f64) {
        self.dynamics.displace(by_rad);
        self.show();
    }

    /// Sets its temperature, in °C.
    pub fn set_temperature(&mut self, temperature_c: f64) {
        self.dynamics.temperature_c = temperature_c;
        self.show();
    }

    /// Raises a hardware error that lasts until a reboot, and switches the torque off if the shutdown mask includes it.
    pub fn fail(&mut self, error: HardwareError) {
        self.memory.latched |= error.bit();
        self.protect(error.bit());
    }

    /// Applies a load, as the current in amperes that holds it.
    pub fn load(&mut self, amperes: f64) {
        self.dynamics.load_a = amperes;
    }

    /// Blocks or releases the shaft. A blocked shaft does not move; with torque on, its current rises to the limit as
    /// its trajectory goes on.
    pub fn block(&mut self, blocked: bool) {
        self.dynamics.is_blocked_by_caller = blocked;
    }

    /// Whether an obstacle blocks its shaft.
    #[must_use]
    pub const fn is_blocked(&self) -> bool {
        self.dynamics.is_blocked()
    }

    /// Sets its supply voltage, in volts.
    pub fn supply(&mut self, volts: f64) {
        self.dynamics.supply_v = volts;
    }

    /// Updates the measured values in its table.
    fn show(&mut self) {
        let running_for = self.now.since(self.started_at).saturating_sub(self.stopped_for);
        let tick = running_for.as_millis() % 32768;
        self.memory.set(REALTIME_TICK, i64::try_from(tick).unwrap_or(0));
        self.dynamics.show(&mut self.memory);
        self.memory.refresh();
    }
}

#[cfg(test)]
mod tests;

use crate::table::{
    Access, Area, BACKUP_READY, BAUD_RATE, BUS_WATCHDOG, CURRENT_LIMIT, EEPROM_END, Entry, FIRMWARE,
    GOAL_CURRENT, GOAL_POSITION, GOAL_PWM, GOAL_VELOCITY, ID, Item, MAX_POSITION_LIMIT, MIN_POSITION_LIMIT,
    MODEL_NUMBER, OPERATING_MODE, PROFILE_ACCELERATION, PROFILE_VELOCITY, PWM_LIMIT, SHUTDOWN,
    STARTUP_CONFIGURATION, TORQUE_ENABLE, VELOCITY_LIMIT, by_address, entries, length,
};
use crate::{Fault, Model, Reset};

use super::indirect::Indirect;

/// Length of the longest control table.
const BYTES: usize = 662;
/// Default firmware version: the first one of X330 with fast reads.
const FIRMWARE_VERSION: i64 = 46;
/// The goal items, which the bus watchdog locks when it trips.
const GOALS: [Item; 4] = [GOAL_PWM, GOAL_CURRENT, GOAL_VELOCITY, GOAL_POSITION];
/// The gains, which the backup includes besides the profile and the indirect addresses.
const GAINS: std::ops::RangeInclusive<u16> = 76..=90;
/// Startup configuration bit that restores the RAM from the backup.
const RESTORE_RAM: i64 = 2;

/// The values of Operating Mode (address 11).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Current = 0,
    Velocity = 1,
    Position = 3,
    ExtendedPosition = 4,
    CurrentBasedPosition = 5,
    Pwm = 16,
}

impl Mode {
    fn from_number(number: i64) -> Option<Self> {
        use Mode::{Current, CurrentBasedPosition, ExtendedPosition, Position, Pwm, Velocity};
        let all = [Current, Velocity, Position, ExtendedPosition, CurrentBasedPosition, Pwm];
        all.into_iter().find(|mode| *mode as i64 == number)
    }

    /// Whether the mode controls the position.
    pub(super) const fn has_position(self) -> bool {
        matches!(self, Self::Position | Self::ExtendedPosition | Self::CurrentBasedPosition)
    }
}

/// The content of the control table.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    model: Model,
    bytes: [u8; BYTES],
    backup: Option<Box<[u8; BYTES]>>,
    indirect: Indirect,
    /// Hardware errors that are latched until a reboot.
    pub(super) latched: i64,
}

/// The address ranges of a write.
#[derive(Clone, Debug)]
pub(super) struct WrittenRanges {
    first: std::ops::Range<usize>,
    /// The targets of indirect data.
    others: Vec<std::ops::Range<usize>>,
}

impl WrittenRanges {
    pub(super) fn covers(&self, item: Item) -> bool {
        let item = range(item.address, usize::from(item.length));
        let holds = |range: &std::ops::Range<usize>| range.start <= item.start && item.end <= range.end;
        holds(&self.first) || self.others.iter().any(holds)
    }
}

impl Memory {
    pub(super) fn new(model: Model) -> Self {
        let mut memory =
            Self { model, bytes: [0; BYTES], backup: None, indirect: Indirect::new(model), latched: 0 };
        for entry in entries(model) {
            memory.set(entry.item, entry.initial);
        }
        memory.set(MODEL_NUMBER, i64::from(model.number()));
        memory.set(FIRMWARE, FIRMWARE_VERSION);
        memory
    }

    /// Resets the RAM to its power-on state.
    pub(super) fn reset_ram(&mut self) {
        for entry in entries(self.model).filter(|entry| entry.area() == Area::Ram) {
            self.set(entry.item, entry.initial);
        }
        if self.get(STARTUP_CONFIGURATION) & RESTORE_RAM != 0
            && let Some(backup) = self.backup.clone()
        {
            self.take(&backup, is_backed_up_ram);
        }
        self.set(BACKUP_READY, i64::from(self.backup.is_some()));
        self.latched = 0;
        self.reset_goals();
        self.indirect.update_used(&self.bytes);
        self.refresh();
    }

    /// Resets the EEPROM to its defaults.
    pub(super) fn reset(&mut self, reset: Reset) {
        let kept: &[Item] = match reset {
            Reset::All => &[],
            Reset::KeepId => &[ID],
            Reset::KeepIdAndBaud => &[ID, BAUD_RATE],
        };
        for entry in entries(self.model).filter(|entry| {
            entry.area() == Area::Eeprom && entry.access == Access::ReadWrite && !kept.contains(&entry.item)
        }) {
            self.set(entry.item, entry.initial);
        }
        self.backup = None;
    }

    /// Stores everything in the backup.
    pub(super) fn store(&mut self) {
        self.backup = Some(Box::new(self.bytes));
        self.set(BACKUP_READY, 1);
    }

    /// Restores the EEPROM from the backup; returns whether there is one.
    pub(super) fn restore(&mut self) -> bool {
        let Some(backup) = self.backup.clone() else { return false };
        self.take(&backup, |entry| entry.area() == Area::Eeprom);
        true
    }

    fn take(&mut self, from: &[u8; BYTES], which: fn(&Entry) -> bool) {
        for entry in entries(self.model).filter(which) {
            let range = range(entry.item.address, usize::from(entry.item.length));
            if let (Some(to), Some(from)) = (self.bytes.get_mut(range.clone()), from.get(range)) {
                to.copy_from_slice(from);
            }
        }
    }

    /// Resets the goals as after power-on or a mode change: each to its limit, and to zero if the mode controls it.
    pub(super) fn reset_goals(&mut self) {
        let mode = self.mode();
        for (goal, limit, moves) in [
            (GOAL_PWM, PWM_LIMIT, Mode::Pwm),
            (GOAL_CURRENT, CURRENT_LIMIT, Mode::Current),
            (GOAL_VELOCITY, VELOCITY_LIMIT, Mode::Velocity),
        ] {
            let value = if mode == moves { 0 } else { self.get(limit) };
            self.set(goal, value);
        }
    }

    pub(super) fn bytes(&self, address: u16, length: u16) -> Option<&[u8]> {
        let range = range(address, usize::from(length));
        (range.end <= self.length()).then(|| self.bytes.get(range)).flatten()
    }

    fn length(&self) -> usize {
        usize::from(length(self.model))
    }

    pub(super) fn mode(&self) -> Mode {
        Mode::from_number(self.get(OPERATING_MODE)).unwrap_or(Mode::Position)
    }

    /// The value of an item; items longer than one byte are signed.
    pub(super) fn get(&self, item: Item) -> i64 {
        match *self.bytes(item.address, item.length).unwrap_or_default() {
            [a, b, c, d] => i64::from(i32::from_le_bytes([a, b, c, d])),
            [a, b] => i64::from(i16::from_le_bytes([a, b])),
            [a] => i64::from(a),
            _ => 0,
        }
    }

    /// Sets an item without checks.
    pub(super) fn set(&mut self, item: Item, value: i64) {
        let range = range(item.address, usize::from(item.length));
        if let Some(place) = self.bytes.get_mut(range) {
            for (byte, place) in value.to_le_bytes().into_iter().zip(place) {
                *place = byte;
            }
        }
    }

    /// Copies the targets of indirect addresses to the indirect data.
    pub(super) fn refresh(&mut self) {
        self.indirect.refresh(&mut self.bytes);
    }

    /// Checks whether these bytes may be written.
    pub(super) fn check(&self, address: u16, data: &[u8], tripped: bool) -> Result<(), Fault> {
        if usize::from(address) + data.len() > self.length() {
            return Err(Fault::Access);
        }
        if !self.indirect.is_used {
            return self.check_items(address, data, tripped);
        }
        let runs = self.indirect.runs(address, data, &self.bytes);
        runs.iter().try_for_each(|(at, data)| self.check_items(*at, data, tripped))
    }

    /// Writes complete items, all or none. Writes to indirect data go to their targets.
    pub(super) fn write(&mut self, address: u16, data: &[u8], tripped: bool) -> Result<WrittenRanges, Fault> {
        self.check(address, data, tripped)?;
        let written = if self.indirect.is_used {
            let runs = self.indirect.runs(address, data, &self.bytes);
            let others = runs.iter().map(|(at, data)| self.put(*at, data)).collect();
            WrittenRanges { first: 0..0, others }
        } else {
            WrittenRanges { first: self.put(address, data), others: Vec::new() }
        };
        self.indirect.update_used(&self.bytes);
        self.refresh();
        Ok(written)
    }

    fn put(&mut self, address: u16, data: &[u8]) -> std::ops::Range<usize> {
        let range = range(address, data.len());
        if let Some(place) = self.bytes.get_mut(range.clone()) {
            place.copy_from_slice(data);
        }
        range
    }

    fn check_items(&self, address: u16, data: &[u8], tripped: bool) -> Result<(), Fault> {
        let torque = self.get(TORQUE_ENABLE) == 1;
        let (mut at, mut rest) = (address, data);
        while !rest.is_empty() {
            let entry = by_address(self.model, at).ok_or(Fault::Access)?;
            let (bytes, behind) =
                rest.split_at_checked(usize::from(entry.item.length)).ok_or(Fault::Length)?;
            if entry.access == Access::Read || (torque && at < EEPROM_END) {
                return Err(Fault::Access);
            }
            if tripped && GOALS.contains(&entry.item) {
                return Err(Fault::Range);
            }
            self.check_value(&entry, entry.value(bytes).ok_or(Fault::Length)?)?;
            (at, rest) = (at + entry.item.length, behind);
        }
        self.check_position_limits(address, data)
    }

    /// Rejects a minimum position above the maximum one, given the values after the write.
    fn check_position_limits(&self, address: u16, data: &[u8]) -> Result<(), Fault> {
        let written = |item: Item| {
            let from = usize::from(item.address.checked_sub(address)?);
            let bytes = data.get(from..from + usize::from(item.length))?;
            Some(i64::from(i32::from_le_bytes(*bytes.first_chunk()?)))
        };
        let (low, high) = (written(MIN_POSITION_LIMIT), written(MAX_POSITION_LIMIT));
        if low.is_none() && high.is_none() {
            return Ok(());
        }
        let low = low.unwrap_or_else(|| self.get(MIN_POSITION_LIMIT));
        let high = high.unwrap_or_else(|| self.get(MAX_POSITION_LIMIT));
        if low > high { Err(Fault::Limit) } else { Ok(()) }
    }

    fn check_value(&self, entry: &Entry, value: i64) -> Result<(), Fault> {
        if !(entry.low..=entry.high).contains(&value) {
            return Err(Fault::Range);
        }
        let within = match entry.item {
            // Position limits apply in position mode, within one turn.
            GOAL_POSITION if self.mode() == Mode::Position => {
                (self.get(MIN_POSITION_LIMIT)..=self.get(MAX_POSITION_LIMIT)).contains(&value)
            }
            GOAL_VELOCITY => value.abs() <= self.get(VELOCITY_LIMIT),
            GOAL_CURRENT => value.abs() <= self.get(CURRENT_LIMIT),
            GOAL_PWM => value.abs() <= self.get(PWM_LIMIT),
            _ => true,
        };
        if !within {
            return Err(Fault::Limit);
        }
        match entry.item {
            OPERATING_MODE if Mode::from_number(value).is_none() => Err(Fault::Range),
            // Only 0 clears a tripped watchdog; a timeout may be set again afterwards.
            BUS_WATCHDOG if value != 0 && self.get(BUS_WATCHDOG) == 0xFF => Err(Fault::Range),
            // After a shutdown, torque requires a reboot.
            TORQUE_ENABLE if value == 1 && self.latched & self.get(SHUTDOWN) != 0 => Err(Fault::Access),
            _ => Ok(()),
        }
    }
}

/// Whether the backup includes this RAM item.
fn is_backed_up_ram(entry: &Entry) -> bool {
    GAINS.contains(&entry.item.address)
        || [PROFILE_ACCELERATION, PROFILE_VELOCITY].contains(&entry.item)
        || entry.name == "indirect_address"
}

fn range(address: u16, length: usize) -> std::ops::Range<usize> {
    let start = usize::from(address);
    start..start + length
}

use crate::table::{
    Access, BUS_WATCHDOG, EEPROM_END, FIRMWARE, GOAL_POSITION, Item, LENGTH, MAX_POSITION_LIMIT,
    MIN_POSITION_LIMIT, RULES, Rule, SHUTDOWN, TORQUE_ENABLE, VELOCITY_LIMIT,
};
use crate::{Fault, Model};

/// Goals: what the bus watchdog locks once it tripped.
const GOALS: std::ops::Range<u16> = 100..120;

/// The control table's bytes.
#[derive(Clone, Debug)]
pub(super) struct Memory {
    bytes: [u8; LENGTH],
}

/// A range of addresses that was written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Written {
    start: u16,
    end: u16,
}

impl Written {
    pub(super) fn covers(self, item: Item) -> bool {
        self.start <= item.address && item.address + item.length <= self.end
    }
}

impl Memory {
    pub(super) fn new(model: Model) -> Self {
        let mut memory = Self { bytes: [0; LENGTH] };
        for rule in RULES {
            memory.set(rule.item, rule.initial);
        }
        memory.set(FIRMWARE, 46);
        memory.set(VELOCITY_LIMIT, i64::from(model.velocity_limit()));
        memory.set(SHUTDOWN, if model == Model::Xl330M288 { 53 } else { 52 });
        memory
    }

    /// Puts everything but the EEPROM back to what it is when power comes on.
    pub(super) fn forget(&mut self) {
        for rule in RULES.iter().filter(|rule| rule.item.address >= EEPROM_END) {
            self.set(rule.item, rule.initial);
        }
    }

    pub(super) fn bytes(&self, address: u16, length: u16) -> Option<&[u8]> {
        let start = usize::from(address);
        self.bytes.get(start..start + usize::from(length))
    }

    /// The value of an item; what is four bytes long is signed, as is a current.
    pub(super) fn get(&self, item: Item) -> i64 {
        number(self.bytes(item.address, item.length).unwrap_or_default())
    }

    /// Sets an item, whatever its rules.
    pub(super) fn set(&mut self, item: Item, value: i64) {
        let start = usize::from(item.address);
        if let Some(place) = self.bytes.get_mut(start..start + usize::from(item.length)) {
            for (byte, place) in value.to_le_bytes().into_iter().zip(place) {
                *place = byte;
            }
        }
    }

    /// Writes whole items, all or none.
    pub(super) fn write(&mut self, address: u16, data: &[u8], tripped: bool) -> Result<Written, Fault> {
        let end = u16::try_from(data.len()).ok().and_then(|length| address.checked_add(length));
        let end = end.ok_or(Fault::Access)?;
        let torque = self.get(TORQUE_ENABLE) == 1;
        let mut at = address;
        let mut rest = data;
        while at < end {
            let rule = RULES.iter().find(|rule| rule.item.address == at).ok_or(Fault::Access)?;
            let length = usize::from(rule.item.length);
            let (bytes, behind) = rest.split_at_checked(length).ok_or(Fault::Length)?;
            if rule.access == Access::Read || (torque && at < EEPROM_END) {
                return Err(Fault::Access);
            }
            if tripped && GOALS.contains(&at) {
                return Err(Fault::Range);
            }
            self.check(rule, number(bytes))?;
            (at, rest) = (at + rule.item.length, behind);
        }
        if let Some(place) = self.bytes.get_mut(usize::from(address)..usize::from(end)) {
            place.copy_from_slice(data);
        }
        Ok(Written { start: address, end })
    }

    fn check(&self, rule: &Rule, value: i64) -> Result<(), Fault> {
        if !(rule.low..=rule.high).contains(&value) {
            return Err(Fault::Range);
        }
        let limits = self.get(MIN_POSITION_LIMIT)..=self.get(MAX_POSITION_LIMIT);
        if rule.item == GOAL_POSITION && !limits.contains(&value) {
            return Err(Fault::Limit);
        }
        // Only 0 clears a watchdog that has tripped; a unit may be set again afterwards.
        if rule.item == BUS_WATCHDOG && value != 0 && self.get(BUS_WATCHDOG) == 0xFF {
            return Err(Fault::Range);
        }
        Ok(())
    }
}

fn number(bytes: &[u8]) -> i64 {
    match *bytes {
        [a, b, c, d] => i64::from(i32::from_le_bytes([a, b, c, d])),
        [a, b] => i64::from(i16::from_le_bytes([a, b])),
        [a] => i64::from(a),
        _ => 0,
    }
}

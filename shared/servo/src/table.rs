//! The control table of the X series
//! (<https://emanual.robotis.com/docs/en/dxl/x/xm430-w350/#control-table>).

mod entry;

use std::fmt;

use crate::Model;

pub use entry::{Access, Area, Entry, Unit};

/// An item (register) of the control table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Address of its first byte.
    pub address: u16,
    /// Length in bytes.
    pub length: u16,
}

/// Displays the manual's name and the address: `pwm_limit (item 36)`.
impl fmt::Display for Item {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(row) = ROWS.iter().find(|row| row.item == *self) {
            write!(out, "{} ", row.name)?;
        }
        write!(out, "(item {})", self.address)
    }
}

/// End of the EEPROM area: items below this address persist without power and are writable only with torque off.
pub const EEPROM_END: u16 = 64;

/// The physical unit of an item, where the scale may depend on the model.
#[derive(Clone, Copy, Debug)]
enum Scale {
    None,
    ReturnDelay,
    Watchdog,
    Tick,
    Position,
    Velocity,
    Acceleration,
    Current,
    Duty,
    Voltage,
    Temperature,
}

/// An item in both tables, with minimum, maximum and default value for each model.
#[derive(Clone, Copy, Debug)]
struct Row {
    name: &'static str,
    item: Item,
    access: Access,
    signed: bool,
    scale: Scale,
    x430: Option<[i64; 3]>,
    x330: Option<[i64; 3]>,
}

impl Row {
    const fn read(name: &'static str, address: u16, length: u16, scale: Scale) -> Self {
        Self { access: Access::Read, ..Self::write(name, address, length, scale, [0; 3]) }
    }

    const fn write(name: &'static str, address: u16, length: u16, scale: Scale, values: [i64; 3]) -> Self {
        let item = Item { address, length };
        let (x430, x330) = (Some(values), Some(values));
        Self { name, item, access: Access::ReadWrite, signed: false, scale, x430, x330 }
    }

    const fn signed(self) -> Self {
        Self { signed: true, ..self }
    }

    const fn x330(self, values: [i64; 3]) -> Self {
        Self { x330: Some(values), ..self }
    }

    const fn x330_alone(self) -> Self {
        Self { x430: None, ..self }
    }

    fn entry(&self, model: Model) -> Option<Entry> {
        let [low, high, initial] = match model {
            Model::Xm430W350 => self.x430?,
            Model::Xl330M288 => self.x330?,
        };
        let unit = self.scale.unit(model);
        let (name, item, access, signed) = (self.name, self.item, self.access, self.signed);
        Some(Entry { name, number: None, item, access, signed, low, high, initial, unit })
    }
}

impl Scale {
    const fn unit(self, model: Model) -> Option<Unit> {
        let (per_count, symbol) = match self {
            Self::None => return None,
            Self::ReturnDelay => (2.0, "us"),
            Self::Watchdog => (20.0, "ms"),
            Self::Tick => (1.0, "ms"),
            Self::Position => (360.0 / 4096.0, "deg"),
            Self::Velocity => (0.229, "rev/min"),
            Self::Acceleration => (214.577, "rev/min2"),
            Self::Current => (model.amperes_per_count(), "A"),
            Self::Duty => (0.113, "%"),
            Self::Voltage => (0.1, "V"),
            Self::Temperature => (1.0, "degC"),
        };
        Some(Unit { per_count, symbol })
    }
}

macro_rules! rows {
    ($($(#[$doc:meta])* $name:ident = $row:expr;)+) => {
        $($(#[$doc])* pub const $name: Item = $row.item;)+

        /// Every item below the indirect addresses, ordered by address.
        const ROWS: &[Row] = &[$($row,)+];
    };
}

// From the e-manual, for firmware 46.
rows! {
    /// Model number.
    MODEL_NUMBER = Row::read("model_number", 0, 2, Scale::None);
    /// Model information.
    MODEL_INFORMATION = Row::read("model_information", 2, 4, Scale::None);
    /// Firmware version.
    FIRMWARE = Row::read("firmware_version", 6, 1, Scale::None);
    /// The servo's ID.
    ID = Row::write("id", 7, 1, Scale::None, [0, 252, 1]);
    /// 0 = 9600 bit/s, 1 = 57600, 2 = 115200, 3 = 1 million, 4 = 2, 5 = 3, 6 = 4, 7 = 4.5.
    BAUD_RATE = Row::write("baud_rate", 8, 1, Scale::None, [0, 7, 1]).x330([0, 6, 1]);
    /// Return delay time before a status packet, in 2 µs.
    RETURN_DELAY = Row::write("return_delay_time", 9, 1, Scale::ReturnDelay, [0, 254, 250]);
    /// Bit 0 = reverse mode, bit 2 = time-based profiles, bit 3 = torque on by goal update.
    DRIVE_MODE = Row::write("drive_mode", 10, 1, Scale::None, [0, 13, 0]);
    /// 0 = current, 1 = velocity, 3 = position, 4 = extended position, 5 = current-based position,
    /// 16 = PWM.
    OPERATING_MODE = Row::write("operating_mode", 11, 1, Scale::None, [0, 16, 3]);
    /// Secondary (shadow) ID: the servo also obeys it, without a status packet; 253 and above for none.
    SECONDARY_ID = Row::write("secondary_id", 12, 1, Scale::None, [0, 255, 255]);
    /// 2 = Dynamixel Protocol 2.0, the only one that this crate speaks.
    PROTOCOL_TYPE = Row::write("protocol_type", 13, 1, Scale::None, [1, 2, 2]).x330([2, 22, 2]);
    /// Offset added to the position, in counts.
    HOMING_OFFSET = Row::write("homing_offset", 20, 4, Scale::Position, [-1_044_479, 1_044_479, 0]).signed();
    /// Velocity below which the servo does not count as moving, in 0.229 rev/min.
    MOVING_THRESHOLD = Row::write("moving_threshold", 24, 4, Scale::Velocity, [0, 1023, 10]);
    /// Maximum temperature, in °C.
    TEMPERATURE_LIMIT = Row::write("temperature_limit", 31, 1, Scale::Temperature, [0, 100, 80])
        .x330([0, 100, 70]);
    /// Maximum input voltage, in 0.1 V.
    MAX_VOLTAGE_LIMIT = Row::write("max_voltage_limit", 32, 2, Scale::Voltage, [95, 160, 160])
        .x330([31, 70, 70]);
    /// Minimum input voltage, in 0.1 V.
    MIN_VOLTAGE_LIMIT = Row::write("min_voltage_limit", 34, 2, Scale::Voltage, [95, 160, 95])
        .x330([31, 70, 35]);
    /// Maximum PWM duty, in 0.113 %.
    PWM_LIMIT = Row::write("pwm_limit", 36, 2, Scale::Duty, [0, 885, 885]);
    /// Maximum goal current.
    CURRENT_LIMIT = Row::write("current_limit", 38, 2, Scale::Current, [0, 1193, 1193]).x330([0, 1750, 1750]);
    /// Maximum goal velocity, in 0.229 rev/min.
    VELOCITY_LIMIT = Row::write("velocity_limit", 44, 4, Scale::Velocity, [0, 1023, 200])
        .x330([0, 2047, 445]);
    /// Maximum goal position, in counts.
    MAX_POSITION_LIMIT = Row::write("max_position_limit", 48, 4, Scale::Position, [0, 4095, 4095]);
    /// Minimum goal position, in counts.
    MIN_POSITION_LIMIT = Row::write("min_position_limit", 52, 4, Scale::Position, [0, 4095, 0]);
    /// Bit 0 = torque on at startup, bit 1 = restore the RAM from the backup.
    STARTUP_CONFIGURATION = Row::write("startup_configuration", 60, 1, Scale::None, [0, 3, 0]);
    /// Slope of the PWM, in 1.977 mV/ms.
    PWM_SLOPE = Row::write("pwm_slope", 62, 1, Scale::None, [1, 255, 140]).x330_alone();
    /// The hardware errors that switch the torque off.
    SHUTDOWN = Row::write("shutdown", 63, 1, Scale::None, [0, 63, 52]).x330([0, 63, 53]);
    /// 1 = torque on.
    TORQUE_ENABLE = Row::write("torque_enable", 64, 1, Scale::None, [0, 1, 0]);
    /// 1 = the LED is on.
    LED = Row::write("led", 65, 1, Scale::None, [0, 1, 0]);
    /// 0 = status packets to pings only, 1 = also to reads, 2 = to all instructions.
    STATUS_RETURN_LEVEL = Row::write("status_return_level", 68, 1, Scale::None, [0, 2, 2]);
    /// 1 = a registered write waits for an Action.
    REGISTERED_INSTRUCTION = Row::read("registered_instruction", 69, 1, Scale::None);
    /// Hardware errors, one bit each: 0 input voltage, 2 overheating, 3 encoder, 4 electrical shock,
    /// 5 overload.
    HARDWARE_ERROR_STATUS = Row::read("hardware_error_status", 70, 1, Scale::None);
    /// I gain of the velocity controller, times 65536.
    VELOCITY_I_GAIN = Row::write("velocity_i_gain", 76, 2, Scale::None, [0, 16_383, 1920])
        .x330([0, 16_383, 1600]);
    /// P gain of the velocity controller, times 128.
    VELOCITY_P_GAIN = Row::write("velocity_p_gain", 78, 2, Scale::None, [0, 16_383, 100])
        .x330([0, 16_383, 180]);
    /// D gain of the position controller, times 16.
    POSITION_D_GAIN = Row::write("position_d_gain", 80, 2, Scale::None, [0, 16_383, 0]);
    /// I gain of the position controller, times 65536.
    POSITION_I_GAIN = Row::write("position_i_gain", 82, 2, Scale::None, [0, 16_383, 0]);
    /// P gain of the position controller, times 128.
    POSITION_P_GAIN = Row::write("position_p_gain", 84, 2, Scale::None, [0, 16_383, 800])
        .x330([0, 16_383, 400]);
    /// Feedforward gain of the acceleration, times 4.
    FEEDFORWARD_2ND_GAIN = Row::write("feedforward_2nd_gain", 88, 2, Scale::None, [0, 16_383, 0]);
    /// Feedforward gain of the velocity, times 4.
    FEEDFORWARD_1ST_GAIN = Row::write("feedforward_1st_gain", 90, 2, Scale::None, [0, 16_383, 0]);
    /// Timeout on the bus while torque is on, in 20 ms; 0 = disabled; 255 = tripped.
    BUS_WATCHDOG = Row::write("bus_watchdog", 98, 1, Scale::Watchdog, [0, 127, 0]).signed();
    /// PWM duty, in 0.113 %; the maximum in position modes.
    GOAL_PWM = Row::write("goal_pwm", 100, 2, Scale::Duty, [-885, 885, 885]).signed();
    /// Goal current; the maximum in current-based position mode.
    GOAL_CURRENT = Row::write("goal_current", 102, 2, Scale::Current, [-1193, 1193, 1193])
        .signed().x330([-1750, 1750, 1750]);
    /// Goal velocity, in 0.229 rev/min.
    GOAL_VELOCITY = Row::write("goal_velocity", 104, 4, Scale::Velocity, [-1023, 1023, 200])
        .signed().x330([-2047, 2047, 445]);
    /// Profile acceleration, in 214.577 rev/min²; 0 = unlimited.
    PROFILE_ACCELERATION = Row::write("profile_acceleration", 108, 4, Scale::Acceleration, [0, 32_767, 0]);
    /// Profile velocity, in 0.229 rev/min; 0 = unlimited.
    PROFILE_VELOCITY = Row::write("profile_velocity", 112, 4, Scale::Velocity, [0, 32_767, 0]);
    /// Goal position, in counts.
    GOAL_POSITION = Row::write("goal_position", 116, 4, Scale::Position, [-1_048_575, 1_048_575, 0]).signed();
    /// Milliseconds since startup, modulo 32768.
    REALTIME_TICK = Row::read("realtime_tick", 120, 2, Scale::Tick);
    /// 1 = moving.
    MOVING = Row::read("moving", 122, 1, Scale::None);
    /// Bit 0 = in position, bit 1 = profile ongoing, bit 3 = following error, bits 4 and 5 = profile type.
    MOVING_STATUS = Row::read("moving_status", 123, 1, Scale::None);
    /// PWM duty, in 0.113 %.
    PRESENT_PWM = Row::read("present_pwm", 124, 2, Scale::Duty).signed();
    /// Measured current.
    PRESENT_CURRENT = Row::read("present_current", 126, 2, Scale::Current).signed();
    /// Measured velocity, in 0.229 rev/min.
    PRESENT_VELOCITY = Row::read("present_velocity", 128, 4, Scale::Velocity).signed();
    /// Measured position, in counts.
    PRESENT_POSITION = Row::read("present_position", 132, 4, Scale::Position).signed();
    /// Target velocity of the profile.
    VELOCITY_TRAJECTORY = Row::read("velocity_trajectory", 136, 4, Scale::Velocity).signed();
    /// Target position of the profile.
    POSITION_TRAJECTORY = Row::read("position_trajectory", 140, 4, Scale::Position).signed();
    /// Input voltage, in 0.1 V.
    PRESENT_INPUT_VOLTAGE = Row::read("present_input_voltage", 144, 2, Scale::Voltage);
    /// Temperature, in °C.
    PRESENT_TEMPERATURE = Row::read("present_temperature", 146, 1, Scale::Temperature);
    /// 1 = a backup exists.
    BACKUP_READY = Row::read("backup_ready", 147, 1, Scale::None);
}

/// A block of indirect addresses and their data, numbered from `first`.
struct Indirect {
    first: u16,
    count: u16,
    addresses: u16,
    data: u16,
}

const X430_INDIRECT: [Indirect; 2] = [
    Indirect { first: 1, count: 28, addresses: 168, data: 224 },
    Indirect { first: 29, count: 28, addresses: 578, data: 634 },
];
const X330_INDIRECT: [Indirect; 1] = [Indirect { first: 1, count: 20, addresses: 168, data: 208 }];
/// The lowest address that an indirect address may point to.
const INDIRECT_LOW: i64 = 64;

impl Indirect {
    const fn of(model: Model) -> &'static [Self] {
        match model {
            Model::Xm430W350 => &X430_INDIRECT,
            Model::Xl330M288 => &X330_INDIRECT,
        }
    }

    fn entries(&'static self, model: Model) -> impl Iterator<Item = Entry> {
        let high = i64::from(length(model)) - 1;
        let addresses = (0..self.count).map(move |index| {
            let item = Item { address: self.addresses + 2 * index, length: 2 };
            let values = [INDIRECT_LOW, high, i64::from(self.data + index)];
            self.entry("indirect_address", index, item, values)
        });
        let data = (0..self.count).map(|index| {
            let item = Item { address: self.data + index, length: 1 };
            self.entry("indirect_data", index, item, [0, 255, 0])
        });
        addresses.chain(data)
    }

    const fn entry(&self, name: &'static str, index: u16, item: Item, values: [i64; 3]) -> Entry {
        let ([low, high, initial], number) = (values, Some(self.first + index));
        let access = Access::ReadWrite;
        Entry { name, number, item, access, signed: false, low, high, initial, unit: None }
    }
}

/// Every item of a model's control table, ordered by address.
pub fn entries(model: Model) -> impl Iterator<Item = Entry> {
    let indirect = Indirect::of(model).iter().flat_map(move |indirect| indirect.entries(model));
    ROWS.iter().filter_map(move |row| row.entry(model)).chain(indirect)
}

/// Finds an item by name, such as `goal_position` or `indirect_address_7`.
#[must_use]
pub fn by_name(model: Model, name: &str) -> Option<Entry> {
    let numbered = name.rsplit_once('_').and_then(|(base, number)| Some((base, number.parse().ok()?)));
    entries(model).find(|entry| match entry.number {
        None => entry.name == name,
        Some(number) => numbered == Some((entry.name, number)),
    })
}

/// Finds the item that begins at an address.
#[must_use]
pub fn by_address(model: Model, address: u16) -> Option<Entry> {
    let row = ROWS.iter().find(|row| row.item.address == address);
    row.and_then(|row| row.entry(model)).or_else(|| {
        let mut indirect = Indirect::of(model).iter().flat_map(|indirect| indirect.entries(model));
        indirect.find(|entry| entry.item.address == address)
    })
}

/// Length of a model's control table in bytes, gaps included.
#[must_use]
pub const fn length(model: Model) -> u16 {
    match model {
        Model::Xm430W350 => 662,
        Model::Xl330M288 => 228,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_contiguous_and_found_by_name_and_address() {
        for (model, count) in [(Model::Xm430W350, 53 + 112), (Model::Xl330M288, 54 + 40)] {
            let mut seen = 0;
            let mut end = 0;
            for entry in entries(model) {
                assert!(entry.item.address >= end, "{entry}");
                end = entry.item.address + entry.item.length;
                assert_eq!(by_name(model, &entry.to_string()), Some(entry));
                assert_eq!(by_address(model, entry.item.address), Some(entry));
                assert!(entry.low <= entry.initial && entry.initial <= entry.high, "{entry}");
                seen += 1;
            }
            assert_eq!((end, seen), (length(model), count), "{model:?}");
        }
        assert_eq!(by_name(Model::Xm430W350, "pwm_slope"), None);
        assert_eq!(by_name(Model::Xl330M288, "indirect_address_21"), None);
        assert_eq!(by_name(Model::Xm430W350, "indirect_address_56").unwrap().initial, 661);
    }

    #[test]
    fn models_differ_as_in_the_manual() {
        let initial = |model, item: Item| by_address(model, item.address).unwrap().initial;
        assert_eq!(initial(Model::Xm430W350, SHUTDOWN), 52);
        assert_eq!(initial(Model::Xl330M288, SHUTDOWN), 53);
        for model in Model::ALL {
            assert_eq!(initial(model, VELOCITY_LIMIT), i64::from(model.velocity_limit()));
        }
        assert_eq!(by_name(Model::Xl330M288, "baud_rate").unwrap().high, 6);
    }

    #[test]
    fn values_have_signs_ranges_and_units() {
        let goal = by_name(Model::Xm430W350, "goal_position").unwrap();
        assert_eq!((goal.item, goal.area(), goal.access), (GOAL_POSITION, Area::Ram, Access::ReadWrite));
        assert_eq!(goal.value(&[0xFF; 4]), Some(-1));
        assert_eq!(goal.value(&[0xFF; 2]), None);
        assert_eq!(goal.bytes(-2), Some([0xFE, 0xFF, 0xFF, 0xFF]));
        assert_eq!(goal.bytes(1_048_576), None);
        assert!((goal.in_unit(1024) - 90.0).abs() < 1e-12);
        let current = by_address(Model::Xm430W350, PRESENT_CURRENT.address).unwrap();
        assert!((current.in_unit(current.value(&[0xFF, 0xFF]).unwrap()) + 0.002_69).abs() < 1e-12);
        assert_eq!(by_name(Model::Xl330M288, "bus_watchdog").unwrap().value(&[0xFF]), Some(-1));
        assert_eq!(by_name(Model::Xl330M288, "id").unwrap().area(), Area::Eeprom);
    }
}

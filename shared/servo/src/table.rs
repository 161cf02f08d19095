//! The control table of the X series
//! (<https://emanual.robotis.com/docs/en/dxl/x/xm430-w350/#control-table>).

/// One item of the control table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Address of its first byte.
    pub address: u16,
    /// Bytes.
    pub length: u16,
}

/// Items below this address are kept without power and may be written only with torque off.
pub const EEPROM_END: u16 = 64;

macro_rules! items {
    ($($(#[$doc:meta])* $name:ident = $address:literal, $length:literal;)+) => {
        $($(#[$doc])* pub const $name: Item = Item { address: $address, length: $length };)+
    };
}

items! {
    /// Which model it is.
    MODEL_NUMBER = 0, 2;
    /// Version of its firmware.
    FIRMWARE = 6, 1;
    /// Its identifier.
    ID = 7, 1;
    /// 3 = 1 Mbit/s, 4 = 2, 5 = 3, 6 = 4, 7 = 4.5.
    BAUD_RATE = 8, 1;
    /// Time before an answer, in 2 µs.
    RETURN_DELAY = 9, 1;
    /// Direction, kind of profile and others.
    DRIVE_MODE = 10, 1;
    /// 3 = position.
    OPERATING_MODE = 11, 1;
    /// Highest temperature, in °C.
    TEMPERATURE_LIMIT = 31, 1;
    /// Lowest input voltage without an error, in 0.1 V.
    MIN_VOLTAGE_LIMIT = 34, 2;
    /// Highest goal velocity, in 0.229 rev/min.
    VELOCITY_LIMIT = 44, 4;
    /// Highest goal position, in counts.
    MAX_POSITION_LIMIT = 48, 4;
    /// Lowest goal position, in counts.
    MIN_POSITION_LIMIT = 52, 4;
    /// Which hardware errors switch the torque off.
    SHUTDOWN = 63, 1;
    /// 1 = torque on.
    TORQUE_ENABLE = 64, 1;
    /// 0 = answer pings, 1 = reads too, 2 = everything.
    STATUS_RETURN_LEVEL = 68, 1;
    /// Hardware errors, one bit each.
    HARDWARE_ERROR_STATUS = 70, 1;
    /// Longest silence on the bus while torque is on, in 20 ms; 0 = any; 255 = it was longer.
    BUS_WATCHDOG = 98, 1;
    /// Highest acceleration, in 214.577 rev/min²; 0 = any.
    PROFILE_ACCELERATION = 108, 4;
    /// Highest velocity, in 0.229 rev/min; 0 = any.
    PROFILE_VELOCITY = 112, 4;
    /// Commanded position, in counts.
    GOAL_POSITION = 116, 4;
    /// Milliseconds since it started, modulo 32768.
    REALTIME_TICK = 120, 2;
    /// 1 = it moves.
    MOVING = 122, 1;
    /// Measured current.
    PRESENT_CURRENT = 126, 2;
    /// Measured velocity, in 0.229 rev/min.
    PRESENT_VELOCITY = 128, 4;
    /// Measured position, in counts.
    PRESENT_POSITION = 132, 4;
    /// Velocity that the profile asks for.
    VELOCITY_TRAJECTORY = 136, 4;
    /// Position that the profile asks for.
    POSITION_TRAJECTORY = 140, 4;
    /// In 0.1 V.
    PRESENT_INPUT_VOLTAGE = 144, 2;
    /// In °C.
    PRESENT_TEMPERATURE = 146, 1;
}

/// Whom an item may be written by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Read,
    Write,
}

/// An item with its rules: access, lowest and highest value, value after power came on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    pub(crate) item: Item,
    pub(crate) access: Access,
    pub(crate) low: i64,
    pub(crate) high: i64,
    pub(crate) initial: i64,
}

const fn rule(address: u16, length: u16, access: Access, low: i64, high: i64, initial: i64) -> Rule {
    Rule { item: Item { address, length }, access, low, high, initial }
}

const fn read(address: u16, length: u16) -> Rule {
    rule(address, length, Access::Read, 0, 0, 0)
}

const fn write(address: u16, length: u16, low: i64, high: i64, initial: i64) -> Rule {
    rule(address, length, Access::Write, low, high, initial)
}

/// Bytes of the table up to the last item below the indirect addresses, which are not kept here.
pub(crate) const LENGTH: usize = 148;

/// Every item below the indirect addresses, in the order of the addresses. The values are those
/// of the XM430-W350; where another model differs, see [`crate::Model`].
pub(crate) const RULES: [Rule; 53] = [
    read(0, 2),
    read(2, 4),
    read(6, 1),
    write(7, 1, 0, 252, 1),
    write(8, 1, 0, 7, 3),
    write(9, 1, 0, 254, 250),
    write(10, 1, 0, 13, 0),
    write(11, 1, 0, 16, 3),
    write(12, 1, 0, 255, 255),
    write(13, 1, 1, 2, 2),
    write(20, 4, -1_044_479, 1_044_479, 0),
    write(24, 4, 0, 1023, 10),
    write(31, 1, 0, 100, 80),
    write(32, 2, 31, 160, 160),
    write(34, 2, 31, 160, 95),
    write(36, 2, 0, 885, 885),
    write(38, 2, 0, 1193, 1193),
    write(44, 4, 0, 1023, 200),
    write(48, 4, 0, 4095, 4095),
    write(52, 4, 0, 4095, 0),
    write(60, 1, 0, 3, 0),
    write(63, 1, 0, 255, 52),
    write(64, 1, 0, 1, 0),
    write(65, 1, 0, 1, 0),
    write(68, 1, 0, 2, 2),
    read(69, 1),
    read(70, 1),
    write(76, 2, 0, 16383, 1920),
    write(78, 2, 0, 16383, 100),
    write(80, 2, 0, 16383, 0),
    write(82, 2, 0, 16383, 0),
    write(84, 2, 0, 16383, 800),
    write(88, 2, 0, 16383, 0),
    write(90, 2, 0, 16383, 0),
    write(98, 1, 0, 127, 0),
    write(100, 2, -885, 885, 885),
    write(102, 2, -1193, 1193, 1193),
    write(104, 4, -1023, 1023, 200),
    write(108, 4, 0, 32767, 0),
    write(112, 4, 0, 32767, 0),
    write(116, 4, -1_048_575, 1_048_575, 0),
    read(120, 2),
    read(122, 1),
    read(123, 1),
    read(124, 2),
    read(126, 2),
    read(128, 4),
    read(132, 4),
    read(136, 4),
    read(140, 4),
    read(144, 2),
    read(146, 1),
    read(147, 1),
];

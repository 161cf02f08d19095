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
    /// 0 = 9600 bit/s, 1 = 57600, 2 = 115200, 3 = 1 million, 4 = 2, 5 = 3, 6 = 4, 7 = 4.5.
    BAUD_RATE = 8, 1;
    /// Time before an answer, in 2 µs.
    RETURN_DELAY = 9, 1;
    /// Bit 0 = it turns the other way, bit 2 = profiles are times, bit 3 = a goal switches torque on.
    DRIVE_MODE = 10, 1;
    /// 0 = current, 1 = velocity, 3 = position, 4 = extended position, 5 = current-based position,
    /// 16 = PWM.
    OPERATING_MODE = 11, 1;
    /// An identifier to which it listens too, without answering; 253 and above for none.
    SECONDARY_ID = 12, 1;
    /// What is added to the position, in counts.
    HOMING_OFFSET = 20, 4;
    /// Below this velocity it does not count as moving, in 0.229 rev/min.
    MOVING_THRESHOLD = 24, 4;
    /// Highest temperature, in °C.
    TEMPERATURE_LIMIT = 31, 1;
    /// Highest input voltage, in 0.1 V.
    MAX_VOLTAGE_LIMIT = 32, 2;
    /// Lowest input voltage, in 0.1 V.
    MIN_VOLTAGE_LIMIT = 34, 2;
    /// Highest duty, in 0.113 %.
    PWM_LIMIT = 36, 2;
    /// Highest goal current.
    CURRENT_LIMIT = 38, 2;
    /// Highest goal velocity, in 0.229 rev/min.
    VELOCITY_LIMIT = 44, 4;
    /// Highest goal position, in counts.
    MAX_POSITION_LIMIT = 48, 4;
    /// Lowest goal position, in counts.
    MIN_POSITION_LIMIT = 52, 4;
    /// Bit 0 = torque on at the start, bit 1 = take the RAM from the backup.
    STARTUP_CONFIGURATION = 60, 1;
    /// Which hardware errors switch the torque off.
    SHUTDOWN = 63, 1;
    /// 1 = torque on.
    TORQUE_ENABLE = 64, 1;
    /// 0 = answer pings, 1 = reads too, 2 = everything.
    STATUS_RETURN_LEVEL = 68, 1;
    /// 1 = a write waits for an action.
    REGISTERED_INSTRUCTION = 69, 1;
    /// Hardware errors, one bit each: 0 input voltage, 2 overheating, 3 encoder, 4 electrical shock,
    /// 5 overload.
    HARDWARE_ERROR_STATUS = 70, 1;
    /// Longest silence on the bus while torque is on, in 20 ms; 0 = any; 255 = it was longer.
    BUS_WATCHDOG = 98, 1;
    /// Duty, in 0.113 %; in position modes the highest.
    GOAL_PWM = 100, 2;
    /// Commanded current; in current-based position mode the highest.
    GOAL_CURRENT = 102, 2;
    /// Commanded velocity, in 0.229 rev/min.
    GOAL_VELOCITY = 104, 4;
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
    /// Bit 0 = arrived, bit 1 = the profile is under way, bit 3 = it cannot follow, bits 4 and 5 = kind
    /// of profile.
    MOVING_STATUS = 123, 1;
    /// Duty, in 0.113 %.
    PRESENT_PWM = 124, 2;
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
    /// 1 = there is a backup.
    BACKUP_READY = 147, 1;
}

mod entry;
mod rows;

pub use entry::{Access, Area, Entry, Unit};
pub use rows::{by_address, by_name, entries, length};

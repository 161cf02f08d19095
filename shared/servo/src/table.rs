//! The control table of the X series
//! (<https://emanual.robotis.com/docs/en/dxl/x/xm430-w350/#control-table>).

/// An item (register) of the control table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// Address of its first byte.
    pub address: u16,
    /// Length in bytes.
    pub length: u16,
}

/// End of the EEPROM area: items below this address persist without power and are writable only with torque off.
pub const EEPROM_END: u16 = 64;

macro_rules! items {
    ($($(#[$doc:meta])* $name:ident = $address:literal, $length:literal;)+) => {
        $($(#[$doc])* pub const $name: Item = Item { address: $address, length: $length };)+
    };
}

items! {
    /// Model number.
    MODEL_NUMBER = 0, 2;
    /// Firmware version.
    FIRMWARE = 6, 1;
    /// The servo's ID.
    ID = 7, 1;
    /// 0 = 9600 bit/s, 1 = 57600, 2 = 115200, 3 = 1 million, 4 = 2, 5 = 3, 6 = 4, 7 = 4.5.
    BAUD_RATE = 8, 1;
    /// Return delay time before a status packet, in 2 µs.
    RETURN_DELAY = 9, 1;
    /// Bit 0 = reverse mode, bit 2 = time-based profiles, bit 3 = torque on by goal update.
    DRIVE_MODE = 10, 1;
    /// 0 = current, 1 = velocity, 3 = position, 4 = extended position, 5 = current-based position,
    /// 16 = PWM.
    OPERATING_MODE = 11, 1;
    /// Secondary (shadow) ID: the servo also obeys it, without a status packet; 253 and above for none.
    SECONDARY_ID = 12, 1;
    /// Offset added to the position, in counts.
    HOMING_OFFSET = 20, 4;
    /// Velocity below which the servo does not count as moving, in 0.229 rev/min.
    MOVING_THRESHOLD = 24, 4;
    /// Maximum temperature, in °C.
    TEMPERATURE_LIMIT = 31, 1;
    /// Maximum input voltage, in 0.1 V.
    MAX_VOLTAGE_LIMIT = 32, 2;
    /// Minimum input voltage, in 0.1 V.
    MIN_VOLTAGE_LIMIT = 34, 2;
    /// Maximum PWM duty, in 0.113 %.
    PWM_LIMIT = 36, 2;
    /// Maximum goal current.
    CURRENT_LIMIT = 38, 2;
    /// Maximum goal velocity, in 0.229 rev/min.
    VELOCITY_LIMIT = 44, 4;
    /// Maximum goal position, in counts.
    MAX_POSITION_LIMIT = 48, 4;
    /// Minimum goal position, in counts.
    MIN_POSITION_LIMIT = 52, 4;
    /// Bit 0 = torque on at startup, bit 1 = restore the RAM from the backup.
    STARTUP_CONFIGURATION = 60, 1;
    /// The hardware errors that switch the torque off.
    SHUTDOWN = 63, 1;
    /// 1 = torque on.
    TORQUE_ENABLE = 64, 1;
    /// 0 = status packets to pings only, 1 = also to reads, 2 = to all instructions.
    STATUS_RETURN_LEVEL = 68, 1;
    /// 1 = a registered write waits for an Action.
    REGISTERED_INSTRUCTION = 69, 1;
    /// Hardware errors, one bit each: 0 input voltage, 2 overheating, 3 encoder, 4 electrical shock,
    /// 5 overload.
    HARDWARE_ERROR_STATUS = 70, 1;
    /// Timeout on the bus while torque is on, in 20 ms; 0 = disabled; 255 = tripped.
    BUS_WATCHDOG = 98, 1;
    /// PWM duty, in 0.113 %; the maximum in position modes.
    GOAL_PWM = 100, 2;
    /// Goal current; the maximum in current-based position mode.
    GOAL_CURRENT = 102, 2;
    /// Goal velocity, in 0.229 rev/min.
    GOAL_VELOCITY = 104, 4;
    /// Profile acceleration, in 214.577 rev/min²; 0 = unlimited.
    PROFILE_ACCELERATION = 108, 4;
    /// Profile velocity, in 0.229 rev/min; 0 = unlimited.
    PROFILE_VELOCITY = 112, 4;
    /// Goal position, in counts.
    GOAL_POSITION = 116, 4;
    /// Milliseconds since startup, modulo 32768.
    REALTIME_TICK = 120, 2;
    /// 1 = moving.
    MOVING = 122, 1;
    /// Bit 0 = in position, bit 1 = profile ongoing, bit 3 = following error, bits 4 and 5 = profile type.
    MOVING_STATUS = 123, 1;
    /// PWM duty, in 0.113 %.
    PRESENT_PWM = 124, 2;
    /// Measured current.
    PRESENT_CURRENT = 126, 2;
    /// Measured velocity, in 0.229 rev/min.
    PRESENT_VELOCITY = 128, 4;
    /// Measured position, in counts.
    PRESENT_POSITION = 132, 4;
    /// Target velocity of the profile.
    VELOCITY_TRAJECTORY = 136, 4;
    /// Target position of the profile.
    POSITION_TRAJECTORY = 140, 4;
    /// Input voltage, in 0.1 V.
    PRESENT_INPUT_VOLTAGE = 144, 2;
    /// Temperature, in °C.
    PRESENT_TEMPERATURE = 146, 1;
    /// 1 = a backup exists.
    BACKUP_READY = 147, 1;
}

mod entry;
mod rows;

pub use entry::{Access, Area, Entry, Unit};
pub use rows::{by_address, by_name, entries, length};

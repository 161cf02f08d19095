use std::path::{Path, PathBuf};

use config::motor::{Device, Motor};

/// A servo bus on which torque can be switched off.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bus {
    /// Its name in `motor.toml`.
    pub name: String,
    /// Its serial device.
    pub path: PathBuf,
    /// Bits per second.
    pub baud: u32,
    /// The servos that should be on it.
    pub servos: Vec<Servo>,
}

/// A servo on a bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Servo {
    /// The joint that it drives.
    pub joint: String,
    /// Its identifier on the bus.
    pub id: u8,
}

/// The buses of a robot: its serial devices, and the existing links of its mock servo bus in the domain's folder. The
/// mock servo bus is a process: if it has ended, its servos have ended with it.
#[must_use]
pub fn buses(robot: &Motor, domain: Option<&Path>) -> Vec<Bus> {
    let path = |bus: &config::motor::Bus| match &bus.device {
        Device::Tty(path) => Some(path.clone()),
        Device::Mock => {
            domain.map(|folder| folder.join(format!("bus-{}", bus.name))).filter(|link| link.exists())
        }
    };
    let servos = |number: usize| {
        let joints = robot.joints.iter().filter(move |joint| joint.bus == number);
        joints.map(|joint| Servo { joint: joint.name.clone(), id: joint.id }).collect()
    };
    let all = robot.buses.iter().enumerate();
    all.filter_map(|(number, bus)| {
        Some(Bus { name: bus.name.clone(), path: path(bus)?, baud: bus.baud, servos: servos(number) })
    })
    .collect()
}

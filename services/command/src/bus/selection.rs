//! Selection of the bus and the servo.

use std::fmt;
use std::path::PathBuf;

use clap::Args;
use config::motor::{Device, Joint, Motor};

use super::line::Line;
use crate::configuration::GlobalSetValues;
use crate::failure::CommandError;

/// The options that select a bus.
#[derive(Args, Clone, Debug)]
pub(super) struct BusArgs {
    /// The robot's leo.toml, for the buses and joints in the motor.toml beside it [default: built in]
    #[arg(long, value_name = "FILE", global = true)]
    pub(super) config: Option<PathBuf>,
    #[command(flatten)]
    pub(super) set: GlobalSetValues,
    /// Only this bus of motor.toml
    #[arg(long, value_name = "NAME", global = true)]
    bus: Option<String>,
    /// The tty, instead of the one in motor.toml
    #[arg(long, value_name = "PATH", global = true)]
    device: Option<PathBuf>,
    /// Bits per second [default: as in motor.toml, or 1000000 with --device alone]
    #[arg(long, value_name = "N", global = true, value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
}

/// A servo, by its joint or its identifier.
#[derive(Args, Clone, Debug)]
pub(super) struct Target {
    /// The joint
    #[arg(value_name = "JOINT", conflicts_with = "id")]
    joint: Option<String>,
    /// The servo's identifier on the one bus that --bus or --device names
    #[arg(long, value_name = "N")]
    id: Option<u8>,
}

impl Target {
    /// The target and the remaining words: without an identifier, the first word is the joint.
    pub(super) fn split(id: Option<u8>, words: &[String]) -> (Self, &[String]) {
        match (id, words.split_first()) {
            (None, Some((joint, rest))) => (Self { joint: Some(joint.clone()), id }, rest),
            (_, _) => (Self { joint: None, id }, words),
        }
    }

    /// Whether one servo is named.
    pub(super) const fn is_named(&self) -> bool {
        self.joint.is_some() || self.id.is_some()
    }
}

/// A bus that can be opened.
#[derive(Clone, Debug)]
pub(super) struct BusAddress<'a> {
    pub(super) name: String,
    /// Path of its tty; `None` for a mock servo bus without a known path.
    path: Option<PathBuf>,
    pub(super) baud: u32,
    /// Its joints, as far as they are configured.
    pub(super) joints: Vec<&'a Joint>,
}

/// The selected buses.
pub(super) struct BusSelection<'a> {
    buses: Vec<BusAddress<'a>>,
}

/// The selected servo.
pub(super) struct SelectedServo<'a> {
    pub(super) id: u8,
    pub(super) name: String,
    /// Its joint, if it was named by one.
    pub(super) joint: Option<&'a Joint>,
}

impl fmt::Display for SelectedServo<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.name)
    }
}

impl fmt::Display for BusAddress<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => path.display().fmt(out),
            None => write!(out, "bus `{}`", self.name),
        }
    }
}

impl<'a> BusAddress<'a> {
    /// What to do about servos that answer at another speed. `is_silent`: no servo answers at the speed of the bus, which
    /// is then more probably wrong than the servos.
    pub(super) fn advice_for_other_speed(&self, baud: u32, is_silent: bool) -> String {
        let change_servo = format!(
            "`leo bus set-baud --baud {baud} --id N --to {}` changes the speed of a servo",
            self.baud
        );
        match (is_silent, self.joints.is_empty()) {
            (false, _) => change_servo,
            (true, true) => format!("`--baud {baud}` is their speed; {change_servo}"),
            (true, false) => {
                format!("`baud = {baud}` in motor.toml gives the bus their speed; {change_servo}")
            }
        }
    }

    /// The same bus at another speed.
    pub(super) fn at(&self, baud: u32) -> Self {
        Self { baud, ..self.clone() }
    }

    /// The joint with an identifier.
    pub(super) fn joint(&self, id: u8) -> Option<&'a Joint> {
        self.joints.iter().copied().find(|joint| joint.id == id)
    }

    pub(super) fn open(&self) -> Result<Line, CommandError> {
        let path = self.path.as_ref().ok_or_else(|| {
            CommandError::usage(format!(
                "{self} is a mock servo bus: start `leo mock-bus`, and name the path that it prints with --bus {} \
                 --device PATH",
                self.name
            ))
        })?;
        Line::open(path, self.baud)
    }

    /// Whether its path is known.
    pub(super) const fn is_placed(&self) -> bool {
        self.path.is_some()
    }
}

impl<'a> BusSelection<'a> {
    pub(super) fn new(robot: &'a Motor, args: &BusArgs) -> Result<Self, CommandError> {
        if let Some(name) = &args.bus
            && !robot.buses.iter().any(|bus| bus.name == *name)
        {
            let names: Vec<_> = robot.buses.iter().map(|bus| bus.name.as_str()).collect();
            return Err(CommandError::usage(format!(
                "there is no bus `{name}`: use one of {}",
                names.join(", ")
            )));
        }
        if let (Some(device), None) = (&args.device, &args.bus) {
            let baud = args.baud.unwrap_or(1_000_000);
            let name = device.display().to_string();
            return Ok(Self {
                buses: vec![BusAddress { name, path: Some(device.clone()), baud, joints: Vec::new() }],
            });
        }
        let mut buses = Vec::new();
        for (index, bus) in robot.buses.iter().enumerate() {
            if args.bus.as_ref().is_some_and(|name| *name != bus.name) {
                continue;
            }
            let path = match (&args.device, &bus.device) {
                (Some(path), _) | (None, Device::Tty(path)) => Some(path.clone()),
                (None, Device::Mock) => None,
            };
            let joints = robot.joints.iter().filter(|joint| joint.bus == index).collect();
            let baud = args.baud.unwrap_or(bus.baud);
            buses.push(BusAddress { name: bus.name.clone(), path, baud, joints });
        }
        Ok(Self { buses })
    }

    /// The same buses at another speed.
    pub(super) fn at(&self, baud: u32) -> Self {
        Self { buses: self.buses.iter().map(|bus| bus.at(baud)).collect() }
    }

    /// The buses.
    pub(super) fn buses(&self) -> &[BusAddress<'a>] {
        &self.buses
    }

    /// The selected servo, with its open bus.
    pub(super) fn one(&self, target: &Target) -> Result<(Line, SelectedServo<'a>), CommandError> {
        if let Some(name) = &target.joint {
            for bus in &self.buses {
                if let Some(joint) = bus.joints.iter().find(|joint| joint.name == *name) {
                    return Ok((
                        bus.open()?,
                        SelectedServo { id: joint.id, name: name.clone(), joint: Some(*joint) },
                    ));
                }
            }
            return Err(CommandError::usage(format!(
                "there is no joint `{name}` on the selected buses; motor.toml has the names, and --id needs --device"
            )));
        }
        match (target.id, self.buses.as_slice()) {
            (Some(id), [bus]) => {
                Ok((bus.open()?, SelectedServo { id, name: format!("id {id}"), joint: None }))
            }
            (Some(_), _) => Err(CommandError::usage("an id needs its bus: add --bus or --device")),
            (None, _) => {
                Err(CommandError::usage("name the servo: its joint, or --id with --bus or --device"))
            }
        }
    }
}

/// The name of a joint and its servo, for messages.
pub(super) fn called(joint: &Joint) -> String {
    format!("{} (id {})", joint.name, joint.id)
}

//! `leo bus`: bench tool for servos, for the mock servo bus or hardware.

mod commission;
mod item;
mod line;
mod motion;
mod scan;
mod selection;
mod set_up;
mod torque;
mod value;
mod write;

use std::io::IsTerminal as _;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Subcommand};
use reports::text_table::{Align, TextTable};
use servo::table;
use servo::{HardwareErrors, Instruction};

use self::line::{Line, tell_alert};
use self::motion::MotionSafety;
use self::selection::{BusArgs, BusSelection, Target};
use self::value::entry;
pub(crate) use self::value::escape_negative;
use crate::failure::CommandError;
use crate::output;

/// What `leo bus monitor` shows of a servo.
const MONITOR_COLUMNS: [(&str, Align); 8] = [
    ("joint", Align::Left),
    ("position", Align::Right),
    ("velocity", Align::Right),
    ("current", Align::Right),
    ("degC", Align::Right),
    ("volts", Align::Right),
    ("torque", Align::Left),
    ("errors", Align::Left),
];
/// Time until a servo answers again after a reboot, with a margin.
const REBOOT: Duration = Duration::from_millis(600);

/// Talk to servos by hand.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo bus scan\n  leo bus read neck_yaw_joint present_position present_temperature\n  \
    leo bus torque on neck_yaw_joint\n  leo bus write neck_yaw_joint goal_position 10deg\n  leo bus torque off\n  \
    leo bus scan --device /dev/ttyUSB0 --baud 1000000\n\n\
    A servo is named by its joint in motor.toml, or by --id on one bus. While Leo runs, its buses are its own: stop \
    it, or switch everything off with `leo emergency-stop`. For the mock servo bus, start `leo mock-bus` and name \
    the path that it prints with --device."
)]
pub(crate) struct Bus {
    #[command(subcommand)]
    what: BusCommand,
    #[command(flatten)]
    args: BusArgs,
}

#[derive(Clone, Debug, Subcommand)]
enum BusCommand {
    /// List the servos that answer, and compare them with motor.toml
    Scan {
        /// Print one JSON document
        #[arg(long)]
        json: bool,
        /// Scan every other speed too; the default if no servo answers at the speed of the bus
        #[arg(long)]
        all_speeds: bool,
    },
    /// Read items of a servo's control table by their names, with their units
    Read {
        /// The joint, unless --id is given, and items by the manual's names, such as goal_position;
        /// all items if none is named
        #[arg(value_name = "[JOINT] [ITEM]...")]
        words: Vec<String>,
        /// The servo's identifier on the one bus that --bus or --device names
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=252))]
        id: Option<u8>,
    },
    /// Write an item of a servo's control table; `JOINT goal_position 10deg` moves the joint slowly to that angle,
    /// within its limits, and waits until it stops
    Write {
        /// The joint, unless --id is given; the item by the manual's name, such as profile_velocity; and a
        /// count or a number with the item's unit: 20, 10deg, 20rev/min, 11.5V
        #[arg(value_name = "[JOINT] ITEM VALUE", allow_negative_numbers = true, required = true)]
        words: Vec<String>,
        /// The servo's identifier on the one bus that --bus or --device names
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=252))]
        id: Option<u8>,
        #[command(flatten)]
        raw: RawArgs,
    },
    /// Switch torque on or off: off for all servos if none is named, on for one at its present position
    Torque {
        /// on or off
        #[arg(value_name = "on|off", value_parser = ["on", "off"])]
        to: String,
        #[command(flatten)]
        target: Target,
        #[command(flatten)]
        raw: RawArgs,
    },
    /// Reboot a servo, which clears a hardware alert
    Reboot {
        #[command(flatten)]
        target: Target,
    },
    /// Show the state of the servos continuously
    Monitor {
        #[command(flatten)]
        target: Target,
        /// Show it once
        #[arg(long)]
        once: bool,
    },
    /// Change the identifier of a servo; connect it alone if two have the same
    SetId {
        #[command(flatten)]
        target: Target,
        /// The new identifier
        #[arg(long, value_name = "0..252", value_parser = clap::value_parser!(u8).range(0..=252))]
        to: u8,
        /// Do not ask for confirmation
        #[arg(long)]
        yes: bool,
    },
    /// Run trials on real servos before Leo drives a body, and report what was tried, expected and measured
    Commission(commission::Commission),
    /// Change the bus speed of a servo
    SetBaud {
        #[command(flatten)]
        target: Target,
        /// Bits per second
        #[arg(long, value_name = "N")]
        to: u32,
        /// Do not ask for confirmation
        #[arg(long)]
        yes: bool,
    },
}

/// Options to address a servo directly, without the limits of its joint.
#[derive(Args, Clone, Copy, Debug)]
struct RawArgs {
    /// The servo's own counts, past the limits of its joint, without a profile
    #[arg(long)]
    raw: bool,
    /// Do not ask for confirmation of --raw
    #[arg(long)]
    yes: bool,
}

impl Bus {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let robot = self.args.set.robot(self.args.config.as_deref())?;
        let selection = BusSelection::new(&robot.motor, &self.args)?;
        let care = |RawArgs { raw, yes }| MotionSafety { raw, yes, motor: &robot.leo.motor };
        match &self.what {
            BusCommand::Scan { json, all_speeds } => scan::scan(&selection, *json, *all_speeds),
            BusCommand::Read { words, id } => {
                let (target, items) = Target::split(*id, words);
                read(&selection, &target, items)
            }
            BusCommand::Write { words, id, raw } => match Target::split(*id, words) {
                (target, [item, value]) => write::write(&selection, &target, item, value, &care(*raw)),
                _ => Err(CommandError::usage("name the item and the value: leo bus write JOINT ITEM VALUE")),
            },
            BusCommand::Torque { to, target, raw } => {
                torque::torque(&selection, target, to == "on", &care(*raw))
            }
            BusCommand::Commission(commission) => commission.run(&selection, &robot),
            BusCommand::Reboot { target } => reboot(&selection, target),
            BusCommand::Monitor { target, once } => monitor(&selection, target, *once),
            BusCommand::SetId { target, to, yes } => set_up::set_id(&selection, target, *to, *yes),
            BusCommand::SetBaud { target, to, yes } => set_up::set_baud(&selection, target, *to, *yes),
        }
    }
}

fn read(selection: &BusSelection<'_>, target: &Target, items: &[String]) -> Result<ExitCode, CommandError> {
    let (mut line, joint) = selection.one(target)?;
    let model = line.model(joint.id)?;
    let entries = if items.is_empty() {
        table::entries(model).filter(|entry| entry.number.is_none()).collect()
    } else {
        items.iter().map(|item| entry(model, item)).collect::<Result<Vec<_>, _>>()?
    };
    for entry in entries {
        let instruction = Instruction::Read { address: entry.item.address, length: entry.item.length };
        let said = line.ask(joint.id, instruction)?;
        let value = entry.value(&said.data).ok_or_else(|| {
            CommandError::runtime(format!(
                "{joint} answers {} bytes to {entry}: look for noise",
                said.data.len()
            ))
        })?;
        output::print(&format!("{:<24} {}\n", entry.to_string(), value::show(&entry, value)))?;
    }
    tell_alert(&mut line, joint.id)?;
    Ok(ExitCode::SUCCESS)
}

fn reboot(selection: &BusSelection<'_>, target: &Target) -> Result<ExitCode, CommandError> {
    let (mut line, joint) = selection.one(target)?;
    line.ask(joint.id, Instruction::Reboot)?;
    clock::sleep_until(clock::now() + REBOOT);
    if line.ping(joint.id)?.is_none() {
        return Err(CommandError::runtime(format!("{joint} has not come back after a reboot")));
    }
    output::print(&format!("{joint} has rebooted\n"))?;
    tell_alert(&mut line, joint.id)?;
    Ok(ExitCode::SUCCESS)
}

fn monitor(selection: &BusSelection<'_>, target: &Target, once: bool) -> Result<ExitCode, CommandError> {
    let mut open = Vec::new();
    if target.is_named() {
        let (line, joint) = selection.one(target)?;
        open.push((line, vec![(joint.id, joint.name)]));
    } else {
        for bus in selection.buses() {
            let mut line = bus.open()?;
            let servos = line.scan()?;
            let name = |id| {
                let joint = bus.joints.iter().find(|joint| joint.id == id);
                joint.map_or_else(|| format!("id {id}"), |joint| joint.name.clone())
            };
            let named = servos.iter().map(|servo| (servo.id, name(servo.id))).collect();
            open.push((line, named));
        }
    }
    let clear = if std::io::stdout().is_terminal() && !once { "\x1b[H\x1b[2J" } else { "" };
    loop {
        let mut table = TextTable::new(&MONITOR_COLUMNS);
        for (line, servos) in &mut open {
            for (id, name) in servos {
                table.add(row(line, *id, name));
            }
        }
        output::print(&(clear.to_owned() + &table.to_text()))?;
        if once || clear.is_empty() {
            return Ok(ExitCode::SUCCESS);
        }
        clock::sleep_until(clock::now() + Duration::from_millis(200));
    }
}

/// The entries of a servo, or why it cannot be read.
fn row(line: &mut Line, id: u8, name: &str) -> Vec<String> {
    let mut measured = || -> Result<Vec<String>, CommandError> {
        let model = line.model(id)?;
        let mut get = |item: &str| -> Result<f64, CommandError> {
            let entry = entry(model, item)?;
            Ok(entry.in_unit(line.value(model, id, item)?))
        };
        let (position, velocity) = (get("present_position")?, get("present_velocity")?);
        let (current, temperature) = (get("present_current")?, get("present_temperature")?);
        let volts = get("present_input_voltage")?;
        let torque = line.value(model, id, "torque_enable")?;
        let errors = line.value(model, id, "hardware_error_status")?;
        let errors = HardwareErrors(u8::try_from(errors).unwrap_or(u8::MAX));
        Ok(vec![
            name.to_owned(),
            format!("{position:.1} deg"),
            format!("{velocity:.1} /min"),
            format!("{current:.3} A"),
            format!("{temperature:.0}"),
            format!("{volts:.1}"),
            if torque == 1 { "on" } else { "off" }.to_owned(),
            if errors.is_none() { String::new() } else { errors.to_string() },
        ])
    };
    measured().unwrap_or_else(|error| {
        let unread = std::iter::repeat_n(String::new(), MONITOR_COLUMNS.len() - 2);
        std::iter::once(name.to_owned()).chain(unread).chain([error.text]).collect()
    })
}

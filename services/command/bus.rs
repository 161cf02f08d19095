//! `leo bus`: what an engineer needs at the bench, against the mock servo bus or hardware.

mod line;
mod value;
mod whom;

use std::fmt::Write as _;
use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Subcommand};
use config::Robot;
use config::motor::Joint;
use servo::table::{self, Access, Area, Entry};
use servo::{HardwareErrors, Instruction, Model};

use self::line::{Line, Said};
use self::whom::{Opening, Target, Where};
use super::failure::Failed;
use super::output;

/// How long a servo says nothing after a reboot, and some more.
const REBOOT: Duration = Duration::from_millis(600);

/// Speeds in bits per second, by their code in item 8 of the control table.
const SPEEDS: [u32; 8] = [9600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000];

/// Talk to servos by hand.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo bus scan\n  leo bus read neck_yaw_joint present_position present_temperature\n  \
    leo bus write --bus torso --id 1 profile_velocity 20\n  leo bus torque off\n  \
    leo bus scan --device /dev/ttyUSB0 --baud 1000000\n\n\
    A servo is named by its joint in motor.toml, or by --id on one bus. While Leo runs, its buses are its own: stop \
    it, or switch everything off with `leo emergency-stop`. For the mock servo bus, start `leo mock-bus` and name \
    the path that it prints with --device."
)]
pub(crate) struct Bus {
    #[command(subcommand)]
    what: What,
    #[command(flatten)]
    place: Place,
}

#[derive(Args, Clone, Debug)]
struct Place {
    /// The robot's leo.toml, for the buses and joints in the motor.toml beside it [default: built in]
    #[arg(long, value_name = "FILE", global = true)]
    config: Option<PathBuf>,
    /// Only this bus of motor.toml
    #[arg(long, value_name = "NAME", global = true)]
    bus: Option<String>,
    /// The tty, instead of the one in motor.toml
    #[arg(long, value_name = "PATH", global = true)]
    device: Option<PathBuf>,
    /// Bits per second [default: as in motor.toml, or 1000000 with --device alone]
    #[arg(long, value_name = "N", global = true)]
    baud: Option<u32>,
}

#[derive(Clone, Debug, Subcommand)]
enum What {
    /// Say which servos answer, and whether they are those of motor.toml
    Scan {
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Read items of a servo's control table by their names, with their units
    Read {
        /// The joint, unless --id is said, and items by the manual's names, such as goal_position;
        /// all of them where none is named
        #[arg(value_name = "[JOINT] [ITEM]...")]
        words: Vec<String>,
        /// The servo's identifier on the one bus that --bus or --device names
        #[arg(long, value_name = "N")]
        id: Option<u8>,
    },
    /// Write an item of a servo's control table
    Write {
        /// The joint, unless --id is said; the item by the manual's name, such as goal_position; and a
        /// count or a number with the item's unit: 2048, 90deg, 20rev/min, 11.5V
        #[arg(value_name = "[JOINT] ITEM VALUE", allow_negative_numbers = true, required = true)]
        words: Vec<String>,
        /// The servo's identifier on the one bus that --bus or --device names
        #[arg(long, value_name = "N")]
        id: Option<u8>,
    },
    /// Switch torque on or off: off of all servos where none is named, on of one
    Torque {
        /// on or off
        #[arg(value_name = "on|off", value_parser = ["on", "off"])]
        to: String,
        #[command(flatten)]
        target: Target,
    },
    /// Let a servo begin anew, which clears a hardware alert
    Reboot {
        #[command(flatten)]
        target: Target,
    },
    /// Show how servos are, over and over
    Monitor {
        #[command(flatten)]
        target: Target,
        /// Show it once
        #[arg(long)]
        once: bool,
    },
    /// Give a servo another identifier; connect it alone where two have the same
    SetId {
        #[command(flatten)]
        target: Target,
        /// The identifier that it gets
        #[arg(long, value_name = "0..252", value_parser = clap::value_parser!(u8).range(0..=252))]
        to: u8,
        /// Do not ask
        #[arg(long)]
        yes: bool,
    },
    /// Give a servo another speed of its bus
    SetBaud {
        #[command(flatten)]
        target: Target,
        /// Bits per second
        #[arg(long, value_name = "N")]
        to: u32,
        /// Do not ask
        #[arg(long)]
        yes: bool,
    },
}

impl Bus {
    pub(crate) fn run(&self) -> Result<ExitCode, Failed> {
        let robot = Robot::load(self.place.config.as_deref()).map_err(Failed::usage)?;
        let place = Where::new(&robot.motor, &self.place)?;
        match &self.what {
            What::Scan { json } => scan(&place, *json),
            What::Read { words, id } => {
                let (target, items) = Target::split(*id, words);
                read(&place, &target, items)
            }
            What::Write { words, id } => match Target::split(*id, words) {
                (target, [item, value]) => write(&place, &target, item, value),
                _ => Err(Failed::usage("say which item and which value: leo bus write JOINT ITEM VALUE")),
            },
            What::Torque { to, target } => torque(&place, target, to == "on"),
            What::Reboot { target } => reboot(&place, target),
            What::Monitor { target, once } => monitor(&place, target, *once),
            What::SetId { target, to, yes } => set_id(&place, target, *to, *yes),
            What::SetBaud { target, to, yes } => set_baud(&place, target, *to, *yes),
        }
    }
}

fn set_id(place: &Where<'_>, target: &Target, to: u8, yes: bool) -> Result<ExitCode, Failed> {
    let (mut line, joint) = place.one(target)?;
    if line.ping(to)?.is_some() {
        return Err(Failed::because(format!(
            "a servo answers to id {to} already: two of one id would talk at once"
        )));
    }
    unlocked(&mut line, joint.id, "id")?;
    confirm(yes, &format!("{joint} gets id {to}"))?;
    line.tell(joint.id, Instruction::Write { address: table::ID.address, data: &[to] })?;
    if line.ping(to)?.is_none() {
        return Err(Failed::because(format!("{joint} does not answer to id {to}: see `leo bus scan`")));
    }
    output::print(&format!("{joint} answers to id {to} now\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn set_baud(place: &Where<'_>, target: &Target, to: u32, yes: bool) -> Result<ExitCode, Failed> {
    let Some((code, _)) = (0..).zip(SPEEDS).find(|(_, speed)| *speed == to) else {
        let speeds = SPEEDS.map(|speed| speed.to_string()).join(", ");
        return Err(Failed::usage(format!("{to} is no speed of a servo: say one of {speeds}")));
    };
    let (mut line, joint) = place.one(target)?;
    unlocked(&mut line, joint.id, "baud_rate")?;
    confirm(yes, &format!("{joint} gets {to} baud, and is not heard at another speed any more"))?;
    line.tell(joint.id, Instruction::Write { address: table::BAUD_RATE.address, data: &[code] })?;
    drop(line);
    if place.at(to).one(target)?.0.ping(joint.id)?.is_none() {
        return Err(Failed::because(format!(
            "{joint} does not answer at {to} baud: see `leo bus scan --baud N`"
        )));
    }
    output::print(&format!("{joint} answers at {to} baud now\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// Whether the EEPROM of a servo may be written: an error that says what to do if not.
fn unlocked(line: &mut Line, id: u8, item: &str) -> Result<(), Failed> {
    let model = line.model(id)?;
    if line.value(model, id, "torque_enable")? != 0 {
        return Err(Failed::because(format!(
            "{item} is locked while torque is on: first `leo bus torque off`"
        )));
    }
    Ok(())
}

/// Asks a person at a terminal; elsewhere `--yes` must have been said.
fn confirm(yes: bool, what: &str) -> Result<(), Failed> {
    if yes {
        return Ok(());
    }
    if !std::io::stdin().is_terminal() {
        return Err(Failed::usage(format!("{what}: say --yes if that is meant")));
    }
    output::print(&format!("{what}. Go on? [y/N] "))?;
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer).map_err(Failed::because)?;
    if answer.trim().eq_ignore_ascii_case("y") { Ok(()) } else { Err(Failed::because("nothing was changed")) }
}

fn scan(place: &Where<'_>, json: bool) -> Result<ExitCode, Failed> {
    let mut rows = Vec::new();
    let mut text = String::new();
    let mut missing = 0;
    for bus in place.buses() {
        let mut line = bus.open()?;
        let found = line.scan()?;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{bus} at {} baud: {} servos", bus.baud, found.len());
        for servo in &found {
            let joint = bus.joints.iter().find(|joint| joint.id == servo.id);
            let model = Model::from_number(servo.model);
            let name =
                model.map_or_else(|| format!("model {}", servo.model), |model| model.name().to_owned());
            let note = match joint {
                Some(joint) if Model::from(joint.model).number() == servo.model => joint.name.clone(),
                Some(joint) => format!("{}, but another model than motor.toml says", joint.name),
                None if bus.joints.is_empty() => String::new(),
                None => "not in motor.toml".to_owned(),
            };
            let _ = writeln!(text, "  id {:>3}  {name:<11} firmware {:<3} {note}", servo.id, servo.firmware);
            rows.push(serde_json::json!({
                "bus": bus.name, "id": servo.id, "model": servo.model, "firmware": servo.firmware,
                "joint": joint.map(|joint| &joint.name),
            }));
        }
        for joint in bus.joints.iter().filter(|joint| !found.iter().any(|servo| servo.id == joint.id)) {
            missing += 1;
            let _ = writeln!(text, "  id {:>3}  does not answer: {}", joint.id, joint.name);
            rows.push(
                serde_json::json!({ "bus": bus.name, "id": joint.id, "joint": joint.name, "missing": true }),
            );
        }
    }
    if json {
        output::print_json(&rows)?;
    } else {
        output::print(&text)?;
    }
    Ok(ExitCode::from(u8::from(missing > 0)))
}

fn read(place: &Where<'_>, target: &Target, items: &[String]) -> Result<ExitCode, Failed> {
    let (mut line, joint) = place.one(target)?;
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
            Failed::because(format!("{joint} answers {} bytes to {entry}: look for noise", said.data.len()))
        })?;
        output::print(&format!("{:<24} {}\n", entry.to_string(), value::show(&entry, value)))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write(place: &Where<'_>, target: &Target, item: &str, value: &str) -> Result<ExitCode, Failed> {
    let (mut line, joint) = place.one(target)?;
    let model = line.model(joint.id)?;
    let entry = entry(model, item)?;
    let count = value::parse(&entry, value).map_err(Failed::usage)?;
    set(&mut line, joint.id, item, count)
}

/// Writes an item, and reads it back.
fn set(line: &mut Line, id: u8, item: &str, count: i64) -> Result<ExitCode, Failed> {
    let model = line.model(id)?;
    let entry = entry(model, item)?;
    if entry.access == Access::Read {
        return Err(Failed::usage(format!("{entry} is measured by the servo and not written")));
    }
    let bytes = entry.bytes(count).ok_or_else(|| {
        Failed::usage(format!(
            "{entry} goes from {} to {}: {count} is out of its range",
            entry.low, entry.high
        ))
    })?;
    if ["id", "baud_rate"].contains(&entry.name) {
        return Err(Failed::usage(
            "say `leo bus set-id` or `leo bus set-baud`: they look whether it went well",
        ));
    }
    if entry.area() == Area::Eeprom {
        unlocked(line, id, item)?;
    }
    let data = bytes.get(..usize::from(entry.item.length)).unwrap_or_default();
    line.ask(id, Instruction::Write { address: entry.item.address, data })?;
    let told = format!("{entry} of id {id} is now {}\n", value::show(&entry, count));
    if line.value(model, id, item)? != count {
        return Err(Failed::because(format!(
            "{entry} of id {id} did not take the value: is something else writing it?"
        )));
    }
    output::print(&told)?;
    Ok(ExitCode::SUCCESS)
}

fn torque(place: &Where<'_>, target: &Target, on: bool) -> Result<ExitCode, Failed> {
    if on || target.is_named() {
        let (mut line, joint) = place.one(target)?;
        return set(&mut line, joint.id, "torque_enable", i64::from(on));
    }
    // Where no bus is one that can be opened, what was said was not meant so.
    if let [first, ..] = place.buses()
        && !place.buses().iter().any(Opening::is_placed)
    {
        first.open()?;
    }
    // First it is said on every bus, and only then is looked what came of it; what goes wrong on one bus
    // keeps no other from either.
    let told: Vec<_> = place
        .buses()
        .iter()
        .map(|bus| (bus, bus.open().and_then(|mut line| line.torque_off().map(|()| line))))
        .collect();
    let (mut said, mut failed) = (String::new(), Vec::new());
    for (bus, line) in told {
        let looked = line.and_then(|mut line| look_for_torque(&mut line, bus));
        let Torque { off, doubtful } = looked.unwrap_or_else(|error| {
            failed.push(format!("{}: {}", bus.name, error.text));
            Torque { off: 0, doubtful: bus.joints.iter().map(|joint| called(joint)).collect() }
        });
        if off > 0 {
            // Writing to a string cannot fail.
            let _ = writeln!(said, "{bus}: {off} servos say that their torque is off");
        }
        if !doubtful.is_empty() {
            failed.push(format!(
                "{bus}: torque may still be on of {}: cut the power if anything moves",
                doubtful.join(", ")
            ));
        } else if off == 0 && bus.joints.is_empty() {
            failed.push(format!("{bus}: nobody answers, so that nobody says that torque is off"));
        }
    }
    let printed = output::print(&said);
    if failed.is_empty() {
        printed.map(|()| ExitCode::SUCCESS)
    } else {
        Err(Failed::because(failed.join("\n")))
    }
}

/// What the servos of a bus say of their torque.
struct Torque {
    /// How many say that it is off.
    off: usize,
    /// Those that do not, or say nothing.
    doubtful: Vec<String>,
}

/// Asks all who answer on a bus, and all who should, whether their torque is off.
fn look_for_torque(line: &mut Line, bus: &Opening<'_>) -> Result<Torque, Failed> {
    let mut servos = line.scan()?;
    for joint in &bus.joints {
        // An answer to a question to all is lost more easily than one to a question of its own.
        if !servos.iter().any(|servo| servo.id == joint.id) {
            servos.extend(line.ping(joint.id)?);
        }
    }
    let mut torque = Torque { off: 0, doubtful: Vec::new() };
    for servo in &servos {
        let model = Model::from_number(servo.model);
        if matches!(model.map(|model| line.value(model, servo.id, "torque_enable")), Some(Ok(0))) {
            torque.off += 1;
        } else {
            let joint = bus.joints.iter().find(|joint| joint.id == servo.id);
            torque.doubtful.push(joint.map_or_else(|| format!("id {}", servo.id), |joint| called(joint)));
        }
    }
    let silent = bus.joints.iter().filter(|joint| !servos.iter().any(|servo| servo.id == joint.id));
    torque.doubtful.extend(silent.map(|joint| format!("{}, which does not answer", called(joint))));
    Ok(torque)
}

/// A joint and its servo, for people.
fn called(joint: &Joint) -> String {
    format!("{} (id {})", joint.name, joint.id)
}

fn reboot(place: &Where<'_>, target: &Target) -> Result<ExitCode, Failed> {
    let (mut line, joint) = place.one(target)?;
    line.ask(joint.id, Instruction::Reboot)?;
    clock::sleep_until(clock::now() + REBOOT);
    if line.ping(joint.id)?.is_none() {
        return Err(Failed::because(format!("{joint} has not come back after a reboot")));
    }
    output::print(&format!("{joint} began anew\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn monitor(place: &Where<'_>, target: &Target, once: bool) -> Result<ExitCode, Failed> {
    let mut open = Vec::new();
    if target.is_named() {
        let (line, joint) = place.one(target)?;
        open.push((line, vec![(joint.id, joint.name)]));
    } else {
        for bus in place.buses() {
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
        let mut text = format!(
            "{clear}{:<28} {:>9} {:>10} {:>8} {:>5} {:>6}  torque  errors\n",
            "joint", "position", "velocity", "current", "degC", "volts"
        );
        for (line, servos) in &mut open {
            for (id, name) in servos {
                let _ = writeln!(text, "{}", row(line, *id, name));
            }
        }
        output::print(&text)?;
        if once || clear.is_empty() {
            return Ok(ExitCode::SUCCESS);
        }
        clock::sleep_until(clock::now() + Duration::from_millis(200));
    }
}

fn row(line: &mut Line, id: u8, name: &str) -> String {
    let mut told = || -> Result<String, Failed> {
        let model = line.model(id)?;
        let mut get = |item: &str| -> Result<f64, Failed> {
            let entry = entry(model, item)?;
            Ok(entry.in_unit(line.value(model, id, item)?))
        };
        let (position, velocity) = (get("present_position")?, get("present_velocity")?);
        let (current, temperature) = (get("present_current")?, get("present_temperature")?);
        let volts = get("present_input_voltage")?;
        let torque = line.value(model, id, "torque_enable")?;
        let errors = line.value(model, id, "hardware_error_status")?;
        let errors = HardwareErrors(u8::try_from(errors).unwrap_or(u8::MAX));
        let errors = if errors.is_none() { String::new() } else { errors.to_string() };
        Ok(format!(
            "{name:<28} {position:>5.1} deg {velocity:>4.1} /min {current:>6.3} A {temperature:>5.0} {volts:>6.1}  {:<6}  {errors}",
            if torque == 1 { "on" } else { "off" }
        ))
    };
    told().unwrap_or_else(|error| format!("{name:<28} {}", error.text))
}

fn entry(model: Model, item: &str) -> Result<Entry, Failed> {
    table::by_name(model, item).ok_or_else(|| {
        let near =
            table::entries(model).map(|entry| entry.to_string()).filter(|name| value::alike(name, item));
        let near: Vec<_> = near.take(4).collect();
        let hint = if near.is_empty() {
            "`leo bus read` without an item names all".to_owned()
        } else {
            near.join(", ")
        };
        Failed::usage(format!("`{item}` is no item of an {}: {hint}", model.name()))
    })
}

/// What went wrong with an answer, for people.
fn refused(id: u8, said: &Said) -> Option<Failed> {
    let fault = said.fault?;
    Some(Failed::because(format!("id {id}: {fault}")))
}

//! Scans a bus for servos, at its speed or at others.

use std::fmt::Write as _;
use std::process::ExitCode;

use servo::Model;

use super::line::{FoundServo, Line, clears, clears_at};
use super::selection::{BusAddress, BusSelection};
use crate::failure::CommandError;
use crate::output;

/// Speeds of servos in bits per second, the most common first.
pub(super) const SPEEDS: [u32; 8] =
    [1_000_000, 57_600, 2_000_000, 3_000_000, 4_000_000, 4_500_000, 115_200, 9600];

/// The result of a scan, as text and as rows of a JSON document.
#[derive(Default)]
struct Report {
    text: String,
    rows: Vec<serde_json::Value>,
    /// Whether a joint of motor.toml, or a whole bus, does not reply.
    lacks: bool,
}

/// The result of a scan at the speeds that are not the bus's.
#[derive(Default)]
struct OtherSpeeds {
    /// Whether a servo replies at one of them.
    is_heard: bool,
    /// Whether the adapter does not support one of them.
    is_incomplete: bool,
}

pub(super) fn scan(
    selection: &BusSelection<'_>,
    json: bool,
    all_speeds: bool,
) -> Result<ExitCode, CommandError> {
    let mut report = Report::default();
    for bus in selection.buses() {
        report.look_at(bus, all_speeds)?;
    }
    if json {
        output::print_json(&report.rows)?;
    } else {
        output::print(&report.text)?;
    }
    Ok(ExitCode::from(u8::from(report.lacks)))
}

impl Report {
    fn say(&mut self, line: &str) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }

    fn look_at(&mut self, bus: &BusAddress<'_>, all_speeds: bool) -> Result<(), CommandError> {
        let mut line = bus.open()?;
        let found = line.scan()?;
        if found.is_empty() {
            self.say(&format!(
                "{bus}: no servo answers at {} baud; the other speeds of servos are tried",
                bus.baud
            ));
            self.lacks = true;
        } else {
            self.say(&format!("{bus} at {} baud: {} servos", bus.baud, found.len()));
        }
        for servo in &found {
            self.found(&mut line, bus, servo)?;
        }
        if line.echoes() {
            self.say("  the line echoes transmitted bytes: its receiver reads its own transmitter");
        }
        // A serial port cannot be open twice.
        drop(line);
        let others = if all_speeds || found.is_empty() {
            self.try_other_speeds(bus, found.is_empty())?
        } else {
            OtherSpeeds::default()
        };
        if found.is_empty() && !others.is_heard {
            let which = if others.is_incomplete { " that the adapter supports" } else { "" };
            self.say(&format!(
                "  no servo answers at any speed{which}: check its power and cable, and the direction control of the \
                 adapter"
            ));
        }
        for joint in bus.joints.iter().filter(|joint| !found.iter().any(|servo| servo.id == joint.id)) {
            self.lacks = true;
            self.say(&format!("  id {:>3}  does not answer: {}", joint.id, joint.name));
            self.rows.push(
                serde_json::json!({ "bus": bus.name, "id": joint.id, "joint": joint.name, "missing": true }),
            );
        }
        Ok(())
    }

    fn found(
        &mut self,
        line: &mut Line,
        bus: &BusAddress<'_>,
        servo: &FoundServo,
    ) -> Result<(), CommandError> {
        let joint = bus.joint(servo.id);
        let note = match joint {
            Some(joint) if joint.model.number() == servo.model => joint.name.clone(),
            Some(joint) => format!("{}, but another model than motor.toml says", joint.name),
            None if bus.joints.is_empty() => String::new(),
            None => "not in motor.toml".to_owned(),
        };
        let (id, name, firmware) = (servo.id, model_name(servo.model), servo.firmware);
        self.say(format!("  id {id:>3}  {name:<11} firmware {firmware:<3} {note}").trim_end());
        let alert = if servo.alert { line.alert(id)? } else { None };
        let alert = alert.map(|errors| {
            self.say(&format!("  {}", clears(id, errors)));
            errors.to_string()
        });
        self.rows.push(serde_json::json!({
            "bus": bus.name, "id": id, "model": servo.model, "firmware": firmware, "baud": bus.baud,
            "joint": joint.map(|joint| &joint.name), "alert": alert,
            "echo": line.echoes(),
        }));
        Ok(())
    }

    /// Reports the hardware alert of a servo that replies at another speed. An alert that cannot be read is reported,
    /// and the scan continues.
    fn alert_at(&mut self, baud: u32, line: &mut Line, servo: &FoundServo) -> Option<String> {
        if !servo.alert {
            return None;
        }
        match line.alert(servo.id) {
            Ok(alert) => alert.map(|errors| {
                self.say(&format!("  {}", clears_at(baud, servo.id, errors)));
                errors.to_string()
            }),
            Err(_) => {
                self.say(&format!("  id {}: hardware alert, whose kind cannot be read", servo.id));
                None
            }
        }
    }

    /// Scans at the speeds that are not the bus's. `is_silent`: no servo answers at its own speed.
    fn try_other_speeds(
        &mut self,
        bus: &BusAddress<'_>,
        is_silent: bool,
    ) -> Result<OtherSpeeds, CommandError> {
        let mut others = OtherSpeeds::default();
        for baud in SPEEDS.into_iter().filter(|baud| *baud != bus.baud) {
            // If the adapter does not support a speed, nothing is known about servos at it.
            let Ok(mut line) = bus.at(baud).open() else {
                self.say(&format!("  the adapter does not support {baud} baud"));
                others.is_incomplete = true;
                continue;
            };
            let found = line.scan()?;
            if found.is_empty() {
                continue;
            }
            others.is_heard = true;
            let servos: Vec<_> = found.iter().map(|servo| called(bus, servo)).collect();
            let count = quantity::number::counted(u32::try_from(servos.len()).unwrap_or(u32::MAX), "servo");
            let answer = if servos.len() == 1 { "answers" } else { "answer" };
            self.say(&format!("  {count} {answer} at {baud}: {}", servos.join(", ")));
            self.say(&format!("  {}", bus.advice_for_other_speed(baud, is_silent)));
            for servo in &found {
                let alert = self.alert_at(baud, &mut line, servo);
                self.rows.push(serde_json::json!({
                    "bus": bus.name, "id": servo.id, "model": servo.model, "firmware": servo.firmware, "baud": baud,
                    "joint": bus.joint(servo.id).map(|joint| &joint.name), "alert": alert, "echo": line.echoes(),
                }));
            }
        }
        Ok(others)
    }
}

fn called(bus: &BusAddress<'_>, servo: &FoundServo) -> String {
    let name = bus.joint(servo.id).map_or_else(|| model_name(servo.model), |joint| joint.name.clone());
    format!("{name} (id {})", servo.id)
}

fn model_name(number: u16) -> String {
    Model::from_number(number).map_or_else(|| format!("model {number}"), |model| model.name().to_owned())
}

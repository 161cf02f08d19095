//! Writes items of a control table and verifies them.

use std::process::ExitCode;

use servo::table::{self, Access, Area, Entry};
use servo::{Instruction, Model};

use super::line::Line;
use super::motion::TRIPPED;
use super::value::{entry, show};
use crate::failure::CommandError;
use crate::output;

/// Checks that the EEPROM of a servo can be written, or returns an error with the remedy.
pub(super) fn unlocked(line: &mut Line, id: u8, item: &str) -> Result<(), CommandError> {
    let model = line.model(id)?;
    if line.value(model, id, "torque_enable")? != 0 {
        return Err(CommandError::runtime(format!(
            "{item} is locked while torque is on: first `leo bus torque off`"
        )));
    }
    Ok(())
}

/// Writes an item and reads it back.
pub(super) fn set(line: &mut Line, id: u8, item: &str, count: i64) -> Result<ExitCode, CommandError> {
    let model = line.model(id)?;
    let entry = entry(model, item)?;
    if entry.access == Access::Read {
        return Err(CommandError::usage(format!("{entry} is measured by the servo and not written")));
    }
    let bytes = entry.bytes(count).ok_or_else(|| {
        CommandError::usage(format!(
            "{entry} goes from {} to {}: {count} is out of its range",
            entry.low, entry.high
        ))
    })?;
    if ["id", "baud_rate"].contains(&entry.name) {
        return Err(CommandError::usage(
            "use `leo bus set-id` or `leo bus set-baud`: they verify the result",
        ));
    }
    if entry.area() == Area::Eeprom {
        unlocked(line, id, item)?;
    }
    let data = bytes.get(..usize::from(entry.item.length)).unwrap_or_default();
    line.ask(id, Instruction::Write { address: entry.item.address, data })
        .map_err(|error| because_tripped(line, model, id, &entry, error))?;
    let told = format!("{entry} of id {id} is now {}\n", show(&entry, count));
    if line.value(model, id, item)? != count {
        return Err(CommandError::runtime(format!(
            "{entry} of id {id} did not take the value: is something else writing it?"
        )));
    }
    output::print(&told)?;
    Ok(ExitCode::SUCCESS)
}

/// Whether writing the item can move a servo with torque: goals, torque enable, and indirect data that may alias
/// them.
pub(super) fn moves(entry: &Entry) -> bool {
    let goals =
        ["goal_position", "goal_velocity", "goal_pwm", "goal_current", "torque_enable", "indirect_data"];
    goals.contains(&entry.name)
}

/// Adds the remedy to an error that a tripped bus watchdog causes.
fn because_tripped(
    line: &mut Line,
    model: Model,
    id: u8,
    entry: &Entry,
    error: CommandError,
) -> CommandError {
    let tripped = moves(entry) && matches!(line.get(model, id, table::BUS_WATCHDOG), Ok(TRIPPED));
    if tripped {
        return CommandError::runtime(format!(
            "{}; its bus watchdog has tripped: `leo bus write --id {id} bus_watchdog 0` clears it",
            error.text
        ));
    }
    error
}

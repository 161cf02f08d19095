//! Sets a servo's identifier and its speed.

use std::process::ExitCode;

use servo::{Instruction, table};

use super::item::unlocked;
use super::scan::SPEEDS;
use super::selection::{BusSelection, Target};
use crate::failure::CommandError;
use crate::output::{self, confirm};

pub(super) fn set_id(
    selection: &BusSelection<'_>,
    target: &Target,
    to: u8,
    yes: bool,
) -> Result<ExitCode, CommandError> {
    let (mut line, joint) = selection.one(target)?;
    if line.ping(to)?.is_some() {
        return Err(CommandError::runtime(format!(
            "a servo answers to id {to} already: two servos with one id would reply at once"
        )));
    }
    unlocked(&mut line, joint.id, "id")?;
    confirm(yes, &format!("{joint} gets id {to}"))?;
    line.tell(joint.id, Instruction::Write { address: table::ID.address, data: &[to] })?;
    if line.ping(to)?.is_none() {
        return Err(CommandError::runtime(format!("{joint} does not answer to id {to}: see `leo bus scan`")));
    }
    output::print(&format!("{joint} answers to id {to} now\n"))?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn set_baud(
    selection: &BusSelection<'_>,
    target: &Target,
    to: u32,
    yes: bool,
) -> Result<ExitCode, CommandError> {
    let Some(code) = servo::baud_number(to) else {
        let speeds = SPEEDS.map(|speed| speed.to_string()).join(", ");
        return Err(CommandError::usage(format!("{to} is not a speed of a servo: use one of {speeds}")));
    };
    let (mut line, joint) = selection.one(target)?;
    unlocked(&mut line, joint.id, "baud_rate")?;
    confirm(yes, &format!("{joint} gets {to} baud, and no longer answers at another speed"))?;
    line.tell(joint.id, Instruction::Write { address: table::BAUD_RATE.address, data: &[code] })?;
    drop(line);
    if selection.at(to).one(target)?.0.ping(joint.id)?.is_none() {
        return Err(CommandError::runtime(format!(
            "{joint} does not answer at {to} baud: see `leo bus scan --baud N`"
        )));
    }
    output::print(&format!("{joint} answers at {to} baud now\n"))?;
    Ok(ExitCode::SUCCESS)
}

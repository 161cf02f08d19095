//! Report of a motor process to the torque guard that torque is off.

use std::fs::File;
use std::io::{self, Write as _};
use std::os::fd::AsFd as _;

/// The line on the guard's pipe that reports that torque is off.
pub const TORQUE_OFF_MESSAGE: &str = "torque is off";

/// Reports to the guard, through the pipe at standard input, that every servo has confirmed torque off. To be called
/// by a motor process that its supervisor started.
pub fn report_torque_off() {
    let word = io::stdin()
        .as_fd()
        .try_clone_to_owned()
        .and_then(|pipe| File::from(pipe).write_all(format!("{TORQUE_OFF_MESSAGE}\n").as_bytes()));
    // If all buses are mocks, there is no guard and the write has no effect. If the report fails, the guard switches
    // torque off itself.
    let _unread = word;
}

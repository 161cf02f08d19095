//! How a motor process tells the guard that torque is off.

use std::fs::File;
use std::io::{self, Write as _};
use std::os::fd::AsFd as _;

/// The word that stands on the guard's pipe, in a line of its own, once torque is off.
pub const TORQUE_IS_OFF: &str = "torque is off";

/// Tells the guard, at the other end of standard input, that every servo has said that its torque is off. To be called
/// by a motor process that its supervisor started.
pub fn tell_torque_is_off() {
    let told = io::stdin()
        .as_fd()
        .try_clone_to_owned()
        .and_then(|pipe| File::from(pipe).write_all(format!("{TORQUE_IS_OFF}\n").as_bytes()));
    // Where every bus is a mock there is no guard, and nothing to write to. Where it cannot be told, it looks itself.
    let _untold = told;
}

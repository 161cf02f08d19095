//! Instructions that a person carries out during a trial.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use crate::failure::CommandError;
use crate::output;

/// Interval of checks for Ctrl-C while a prompt waits.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// A person's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    Done,
    Skip,
}

/// Prints an instruction, and waits until the person confirms it with Enter or skips it. Every other answer repeats the
/// prompt. `stop` ends the waiting with an error.
pub(super) fn instruct(text: &str, stop: &AtomicBool) -> Result<Reply, CommandError> {
    output::print(&format!("  {text}.\n"))?;
    loop {
        output::print("  Press Enter when it is done, or type `skip`: ")?;
        let answer = answer(stop)?;
        if answer.trim().is_empty() {
            return Ok(Reply::Done);
        }
        if answer.trim().eq_ignore_ascii_case("skip") {
            return Ok(Reply::Skip);
        }
    }
}

/// A line of standard input. A thread reads it, because a signal does not interrupt the read.
fn answer(stop: &AtomicBool) -> Result<String, CommandError> {
    let (sender, answers) = channel();
    std::thread::Builder::new()
        .name("answer".to_owned())
        .spawn(move || sender.send(output::answer()))
        .map_err(CommandError::runtime)?;
    let answer = loop {
        match answers.recv_timeout(POLL_INTERVAL) {
            Ok(answer) => break answer?,
            Err(RecvTimeoutError::Timeout) if !stop.load(Ordering::Relaxed) => {}
            Err(_) => return Err(CommandError::runtime("interrupted")),
        }
    };
    answer.ok_or_else(|| CommandError::runtime("standard input has ended without an answer"))
}

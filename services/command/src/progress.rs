//! The progress of long work: a bar with an estimate on a terminal, and nothing elsewhere.

use std::fmt;
use std::fs::File;
use std::io::{IsTerminal as _, Read, stderr, stdout};

use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};

/// Work that is known in advance is shown from this length on, in bytes: a second of it, or more.
const MIN_BYTES: u64 = 1 << 20;
/// What is left is estimated from what was done.
const STYLE: &str = "{wide_bar} {percent:>3} %{left}  {msg}";
/// Without an end, there is nothing to estimate.
const ENDLESS_STYLE: &str = "{spinner} {msg}";

/// The progress of a command on standard error. Dropping it clears the bar.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// No bar.
    pub(crate) fn hidden() -> Self {
        Self(ProgressBar::hidden())
    }

    /// Of a number of steps.
    pub(crate) fn of_steps(total: u64) -> Self {
        if !stderr().is_terminal() {
            return Self::hidden();
        }
        let bar = ProgressBar::new(total);
        if let Ok(style) = ProgressStyle::with_template(STYLE) {
            // Nothing is estimated before something is done.
            bar.set_style(style.with_key("left", |state: &ProgressState, out: &mut dyn fmt::Write| {
                if state.pos() > 0 {
                    // A terminal that takes no text has no bar.
                    let _ = write!(out, " {:>5} left", HumanDuration(state.eta()));
                }
            }));
        }
        Self(bar)
    }

    /// Of a number of steps, for a command that prints as it works: the bar would be among its lines on a terminal.
    pub(crate) fn of_steps_beside_output(total: u64) -> Self {
        if stdout().is_terminal() { Self::hidden() } else { Self::of_steps(total) }
    }

    /// Of work without a known end: what was done so far.
    pub(crate) fn without_end() -> Self {
        if !stderr().is_terminal() {
            return Self::hidden();
        }
        let bar = ProgressBar::no_length();
        if let Ok(style) = ProgressStyle::with_template(ENDLESS_STYLE) {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Of the bytes of a file, for a command that prints as it reads: the bar would be among its lines on a terminal.
    pub(crate) fn beside_output(file: &File) -> Self {
        if stdout().is_terminal() { Self::hidden() } else { Self::of_file(file) }
    }

    /// Of the bytes of a file. A pipe has no size.
    pub(crate) fn of_file(file: &File) -> Self {
        match file.metadata() {
            Ok(there) if there.is_file() && there.len() >= MIN_BYTES => Self::of_steps(there.len()),
            Ok(_) | Err(_) => Self::hidden(),
        }
    }

    /// A source whose bytes are counted as they are read.
    pub(crate) fn counting<R: Read>(&self, source: R) -> impl Read + use<R> {
        self.0.wrap_read(source)
    }

    /// One more step is done.
    pub(crate) fn step(&self) {
        self.0.inc(1);
    }

    /// So many steps are done.
    pub(crate) fn set(&self, done: u64) {
        self.0.set_position(done);
    }

    /// What is done now.
    pub(crate) fn say(&self, what: impl Into<String>) {
        self.0.set_message(what.into());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn nothing_is_drawn_where_standard_error_is_no_terminal() {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&vec![0; 2 << 20]).unwrap();
        // A terminal draws it.
        for progress in [Progress::of_steps(5), Progress::of_file(&file), Progress::hidden()] {
            progress.step();
            progress.say("a step");
            assert_eq!(progress.0.is_hidden(), !stderr().is_terminal() || progress.0.length().is_none());
        }
    }

    #[test]
    fn what_is_read_is_counted() {
        let progress = Progress(ProgressBar::hidden());
        progress.0.set_length(5);
        let mut text = String::new();
        progress.counting(&b"abcde"[..]).read_to_string(&mut text).unwrap();
        assert_eq!((text.as_str(), progress.0.position()), ("abcde", 5));
    }
}

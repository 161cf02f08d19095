//! Lines for standard error. The journal takes its lines for news, unless each says how urgent it is: `<4>` in front of
//! a warning, as sd-daemon(3) has it. People who read a terminal or a file are spared that.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsFd as _;
use std::os::unix::fs::MetadataExt as _;

use process::Aside;
use tracing::{Level, Metadata};
use tracing_subscriber::fmt::MakeWriter;

/// Whether standard error is the journal. systemd says which stream is, and who is started by Leo is told the same; but
/// standard error may have been led elsewhere since.
pub(super) fn is_listening() -> bool {
    let announced = std::env::var("JOURNAL_STREAM").ok();
    announced.is_some() && announced == stream().ok()
}

/// Standard error, as `JOURNAL_STREAM` names it.
fn stream() -> io::Result<String> {
    let about = File::from(io::stderr().as_fd().try_clone_to_owned()?).metadata()?;
    Ok(format!("{}:{}", about.dev(), about.ino()))
}

/// What stands before a line of this level.
pub(super) const fn mark(level: Level) -> &'static str {
    match level {
        Level::ERROR => "<3>",
        Level::WARN => "<4>",
        Level::INFO => "<6>",
        Level::DEBUG | Level::TRACE => "<7>",
    }
}

/// The text with a mark before each of its lines: the journal knows no other kind of entry than a line.
pub(super) fn marked(text: &str, level: Level) -> String {
    text.lines().map(|line| format!("{}{line}\n", mark(level))).collect()
}

/// Has a panic say how urgent it is: its message stands only here.
pub(super) fn mark_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        let mut text = format!("thread `{}` {panic}", thread.name().unwrap_or("without a name"));
        let trace = Backtrace::capture();
        if trace.status() == BacktraceStatus::Captured {
            text = format!("{text}\n{trace}");
        }
        let _written = io::stderr().lock().write_all(marked(&text, Level::ERROR).as_bytes());
    }));
}

/// Takes what is said, for whoever listens.
#[derive(Clone, Debug)]
pub(super) struct Voice {
    pub(super) aside: Aside,
    pub(super) is_journal: bool,
}

/// What is said at once.
#[derive(Debug)]
pub(super) struct Saying {
    aside: Aside,
    /// How urgent it is, where that is to be said.
    marked: Option<Level>,
}

impl MakeWriter<'_> for Voice {
    type Writer = Saying;

    fn make_writer(&self) -> Saying {
        Saying { aside: self.aside.clone(), marked: None }
    }

    fn make_writer_for(&self, about: &Metadata<'_>) -> Saying {
        Saying { aside: self.aside.clone(), marked: self.is_journal.then_some(*about.level()) }
    }
}

impl Write for Saying {
    /// Whatever an event says comes in one piece.
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        match self.marked {
            Some(level) => self.aside.write_all(marked(&String::from_utf8_lossy(text), level).as_bytes())?,
            None => self.aside.write_all(text)?,
        }
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.aside.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_a_text_is_marked() {
        assert_eq!(marked("one\ntwo\n", Level::WARN), "<4>one\n<4>two\n");
        assert_eq!(marked("", Level::ERROR), "");
    }
}

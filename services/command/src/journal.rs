//! The log on standard error. The systemd journal takes every line as a notice unless a prefix gives its level, such as
//! `<4>` for a warning (sd-daemon(3)). Terminals and files get no prefix.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::fs::File;
use std::io::{self, IsTerminal as _, Write};
use std::os::fd::AsFd as _;
use std::os::unix::fs::MetadataExt as _;

use process::NonBlockingWriter;
use tracing::{Level, Metadata};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

/// Directs the log to standard error, in the journal's format if that is the journal. Returns the writer, which the
/// caller finishes at the end. Default: warnings; with `-v`: debug messages; otherwise as `RUST_LOG` demands.
pub(super) fn start(verbose: bool, json: bool) -> NonBlockingWriter {
    let is_journal = is_listening();
    let aside = NonBlockingWriter::over(io::stderr(), if is_journal { mark(Level::WARN) } else { "" });
    if is_journal {
        mark_panics();
    }
    // quinn logs every packet and connection attempt; the link process reports its own state once.
    let default = if verbose { "debug,quinn=warn,quinn_proto=warn" } else { "warn" };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
    let colour = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let subscriber = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(LogWriter { aside: aside.clone(), is_journal })
        .with_target(false)
        .with_ansi(colour)
        .without_time();
    if json {
        subscriber.json().init();
    } else {
        subscriber.init();
    }
    aside
}

/// Whether standard error is the journal. `JOURNAL_STREAM` names the journal's stream, but it is inherited by child
/// processes, whose standard error may be redirected.
pub(super) fn is_listening() -> bool {
    let announced = std::env::var("JOURNAL_STREAM").ok();
    announced.is_some() && announced == stream().ok()
}

/// Standard error in the format of `JOURNAL_STREAM`.
fn stream() -> io::Result<String> {
    let about = File::from(io::stderr().as_fd().try_clone_to_owned()?).metadata()?;
    Ok(format!("{}:{}", about.dev(), about.ino()))
}

/// The prefix of a level.
const fn mark(level: Level) -> &'static str {
    match level {
        Level::ERROR => "<3>",
        Level::WARN => "<4>",
        Level::INFO => "<6>",
        Level::DEBUG | Level::TRACE => "<7>",
    }
}

/// Prefixes each line of a text, because the journal takes each line as an entry.
pub(super) fn marked(text: &str, level: Level) -> String {
    text.lines().map(|line| format!("{}{line}\n", mark(level))).collect()
}

/// Installs a panic hook that prefixes the panic message.
fn mark_panics() {
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

/// The log writer.
#[derive(Clone, Debug)]
struct LogWriter {
    aside: NonBlockingWriter,
    is_journal: bool,
}

/// The writer of one event.
#[derive(Debug)]
struct EventWriter {
    aside: NonBlockingWriter,
    /// The level for the prefix; `None` for no prefix.
    marked: Option<Level>,
}

impl MakeWriter<'_> for LogWriter {
    type Writer = EventWriter;

    fn make_writer(&self) -> EventWriter {
        EventWriter { aside: self.aside.clone(), marked: None }
    }

    fn make_writer_for(&self, about: &Metadata<'_>) -> EventWriter {
        EventWriter { aside: self.aside.clone(), marked: self.is_journal.then_some(*about.level()) }
    }
}

impl Write for EventWriter {
    /// The subscriber writes each event in one call.
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

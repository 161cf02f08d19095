//! The log on standard error. The systemd journal takes every line as a notice unless a prefix gives its level, such as
//! `<4>` for a warning (sd-daemon(3)). Terminals and files get no prefix.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::env::VarError;
use std::fs::File;
use std::io::{self, IsTerminal as _, Write};
use std::os::fd::AsFd as _;
use std::os::unix::fs::MetadataExt as _;

use process::NonBlockingWriter;
use tracing::{Level, Metadata};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

/// The variable with the filter of the log.
const FILTER: &str = "RUST_LOG";
/// The levels, from silent to everything.
const LEVELS: [&str; 6] = ["off", "error", "warn", "info", "debug", "trace"];

/// Directs the log to standard error, in the journal's format if that is the journal. Returns the writer, which the
/// caller finishes at the end. Default: warnings; with `-v`: debug messages; otherwise as `RUST_LOG` demands, if that is understood ([`warn_of_filter`]).
pub(super) fn start(verbose: bool, json: bool) -> NonBlockingWriter {
    let is_journal = is_listening();
    let aside = NonBlockingWriter::over(io::stderr(), if is_journal { mark(Level::WARN) } else { "" });
    if is_journal {
        mark_panics();
    }
    // quinn logs every packet and connection attempt; the link process reports its own state once.
    let default = if verbose { "debug,quinn=warn,quinn_proto=warn" } else { "warn" };
    let demanded = std::env::var(FILTER).ok().filter(|demanded| filter_fault(demanded).is_none());
    let filter = demanded.filter(|demanded| !demanded.trim().is_empty());
    let filter = EnvFilter::new(filter.as_deref().unwrap_or(default));
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

/// Warns on standard error of a `RUST_LOG` that was ignored.
pub(super) fn warn_of_filter() {
    let fault = match std::env::var(FILTER) {
        Ok(demanded) => filter_fault(&demanded),
        Err(VarError::NotPresent) => None,
        Err(VarError::NotUnicode(_)) => Some("it is no text".to_owned()),
    };
    if let Some(fault) = fault {
        tracing::warn!(
            "{FILTER} is ignored: {fault}; write a level ({}), or TARGET=LEVEL for a part of the program, separated by \
             commas",
            LEVELS.join(", ")
        );
    }
}

/// What is wrong with a filter; `None` for one that is understood. A word that is no level would be taken as the name of
/// a part of the program, and would silence all others.
fn filter_fault(demanded: &str) -> Option<String> {
    let is_level = |word: &str| {
        LEVELS.iter().any(|level| level.eq_ignore_ascii_case(word))
            || word.parse::<u8>().is_ok_and(|level| level <= 5)
    };
    for part in demanded.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        // A span's fields are in brackets, and may have their own `=`.
        let (target, level) = part.rsplit_once(']').map_or(part, |(_, rest)| rest).split_once('=').unzip();
        let word = level.unwrap_or(part);
        if !part.contains('[') && target.is_some_and(|target| target.trim().is_empty()) {
            return Some(format!("no part of the program is named before the `=` of `{part}`"));
        }
        if !part.contains('[') && !is_level(word) {
            let near = config::closest(word, LEVELS);
            let near = near.map_or_else(String::new, |level| format!("; did you mean `{level}`?"));
            return Some(format!("`{word}` is no level{near}"));
        }
    }
    EnvFilter::try_new(demanded).err().map(|_library| format!("`{demanded}` is no filter"))
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
    fn a_filter_that_means_nothing_is_a_fault() {
        for known in
            ["", "debug", "WARN", "info,quinn=debug", "quinn::connection=off", "3", "[cycle{n=3}]=debug"]
        {
            assert_eq!(filter_fault(known), None, "{known}");
        }
        for (unknown, word) in [
            ("nonsense", "`nonsense` is no level"),
            ("debgu", "did you mean `debug`?"),
            ("leo=loud", "`loud` is no level"),
            ("warn,quinn=", "`` is no level"),
            ("=debug", "no part of the program"),
            ("7", "`7` is no level"),
        ] {
            assert!(filter_fault(unknown).is_some_and(|fault| fault.contains(word)), "{unknown}");
        }
    }

    #[test]
    fn every_line_of_a_text_is_marked() {
        assert_eq!(marked("one\ntwo\n", Level::WARN), "<4>one\n<4>two\n");
        assert_eq!(marked("", Level::ERROR), "");
    }
}

//! Reports for the journal. A thread of its own formats them, because the network thread carries frames.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use clock::{Duration, Instant};
use quinn::ConnectionError;

use super::handshakes::HANDSHAKE_TIMEOUT;
use super::refusal::KeyFiles;
use super::verifier::RefusalRecord;

/// Capacity of the queue to the thread, in reports. A report is dropped if the queue is full.
const MAX_WAITING: usize = 64;
/// Maximum number of different lines within `LOGGED_FOR`; each is logged once in that time. Foreign machines
/// cannot flood the journal.
const MAX_LINES: usize = 64;
const LOGGED_FOR: Duration = Duration::from_secs(3600);

/// A report for the journal.
#[derive(Debug)]
pub(crate) enum Report {
    /// A connection was refused or ended, by either side.
    Ended { peer: String, record: RefusalRecord, ended: ConnectionError },
    /// The handshake took too long.
    HandshakeTimeout { peer: String },
    /// The certificate of a connected peer has expired.
    Expired { peer: String },
    /// This machine cannot use its own network or keys.
    Fault(String),
}

impl Report {
    fn line(self, files: &KeyFiles) -> String {
        match self {
            Self::Ended { peer, record, ended } => files.explain(&peer, &record, &ended),
            Self::HandshakeTimeout { peer } => {
                let seconds = HANDSHAKE_TIMEOUT.as_secs();
                format!("no connection with {peer}: the handshake took longer than {seconds} s")
            }
            Self::Expired { peer } => KeyFiles::expired(&peer),
            Self::Fault(line) => line,
        }
    }
}

/// Queue to the thread that reports. Sending never blocks. The thread ends when the queue is dropped.
#[derive(Debug)]
pub(crate) struct Reports(SyncSender<Report>);

impl Reports {
    /// Starts the thread, which gives each line to `log`.
    pub(crate) fn start(
        files: KeyFiles,
        log: impl FnMut(&str) + Send + 'static,
    ) -> Result<(Self, JoinHandle<()>), String> {
        let (to, reports) = sync_channel(MAX_WAITING);
        let thread = std::thread::Builder::new().name("link-reports".to_owned());
        let thread =
            thread.spawn(move || report(&reports, &files, log)).map_err(|error| error.to_string())?;
        Ok((Self(to), thread))
    }

    /// Queues a report.
    pub(crate) fn send(&self, report: Report) {
        let _dropped = self.0.try_send(report);
    }
}

fn report(reports: &Receiver<Report>, files: &KeyFiles, mut log: impl FnMut(&str)) {
    let mut logged = LoggedLines::default();
    for report in reports {
        let line = report.line(files);
        if logged.is_new(clock::now(), &line) {
            log(&line);
        }
    }
}

/// The lines that were logged recently, with their times.
#[derive(Debug, Default)]
struct LoggedLines(BTreeMap<String, Instant>);

impl LoggedLines {
    /// Whether a line has to be logged; it counts as logged then.
    fn is_new(&mut self, now: Instant, line: &str) -> bool {
        self.0.retain(|_, at| now.since(*at) < LOGGED_FOR);
        let is_new = self.0.len() < MAX_LINES && !self.0.contains_key(line);
        if is_new {
            self.0.insert(line.to_owned(), now);
        }
        is_new
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn another_thread_formats_each_line_once() {
        let link = config::Robot::load(None).unwrap().leo.link;
        let (logged, lines) = channel();
        let log = move |line: &str| {
            logged.send((std::thread::current().name().map(str::to_owned), line.to_owned())).unwrap();
        };
        let (reports, thread) = Reports::start(KeyFiles::of(&link), log).unwrap();
        let ended = |peer: &str| Report::Ended {
            peer: peer.to_owned(),
            record: RefusalRecord::default(),
            ended: ConnectionError::TimedOut,
        };
        [ended("a"), ended("a"), Report::HandshakeTimeout { peer: "a".to_owned() }, ended("b")]
            .into_iter()
            .for_each(|report| reports.send(report));
        drop(reports);
        thread.join().unwrap();
        let lines: Vec<(Option<String>, String)> = lines.iter().collect();
        assert!(lines.iter().all(|(thread, _)| thread.as_deref() == Some("link-reports")), "{lines:?}");
        let begins = [
            "no connection with a: no answer",
            "no connection with a: the handshake took longer",
            "no connection with b: no answer",
        ];
        assert!(lines.iter().map(|(_, line)| line).zip(begins).all(|(line, begin)| line.starts_with(begin)));
        assert_eq!(lines.len(), begins.len(), "{lines:?}");
    }

    #[test]
    fn a_line_is_logged_again_after_an_hour_within_a_bound() {
        let mut lines = LoggedLines::default();
        let at = |s: u64| Instant::from_nanos(1_000_000_000 * (1 + s));
        let logged = (0..999).filter(|number| lines.is_new(at(0), &number.to_string()));
        assert_eq!(logged.count(), MAX_LINES);
        assert_eq!([3599, 3600, 3601].map(|s| lines.is_new(at(s), "0")), [false, true, false]);
    }
}

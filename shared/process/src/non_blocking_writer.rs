//! Non-blocking output: a separate thread writes messages to a terminal or pipe, so that a blocked reader never
//! delays a control loop.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

/// Capacity of the queue in lines; further lines are dropped and counted.
const LINES: usize = 256;
/// Stack size of the writing thread; small, because a process may lock all its memory.
const STACK: usize = 128 << 10;
/// Timeout for writing the queued lines at the end of the program.
const FLUSH_TIMEOUT: Duration = Duration::from_millis(500);

/// A writer that queues lines and never blocks.
#[derive(Clone, Debug)]
pub struct NonBlockingWriter {
    to: SyncSender<Message>,
    dropped_lines: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Message {
    Line(Vec<u8>),
    /// A request for a notification once everything before it is written.
    Mark(SyncSender<()>),
}

impl NonBlockingWriter {
    /// Writes everything to `out`, with `mark` before a report of dropped lines. If the thread cannot be started,
    /// nothing is written.
    #[must_use]
    pub fn over(mut out: impl Write + Send + 'static, mark: &'static str) -> Self {
        let (to, words) = sync_channel(LINES);
        let dropped_lines = Arc::new(AtomicU64::new(0));
        let left_out = Arc::clone(&dropped_lines);
        let _thread = thread::Builder::new()
            .name("aside".to_owned())
            .stack_size(STACK)
            .spawn(move || say(&words, &left_out, mark, &mut out));
        Self { to, dropped_lines }
    }

    /// Waits until everything is written, up to a short timeout.
    pub fn finish(&self) {
        let (done, is_done) = sync_channel(1);
        if self.to.try_send(Message::Mark(done)).is_ok() {
            let _in_time = is_done.recv_timeout(FLUSH_TIMEOUT);
        }
    }
}

impl Write for NonBlockingWriter {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.to.try_send(Message::Line(line.to_vec())).is_err() {
            self.dropped_lines.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn say(words: &Receiver<Message>, dropped_lines: &AtomicU64, mark: &str, out: &mut impl Write) {
    while let Ok(word) = words.recv() {
        // Write errors are ignored: the reader has closed its end.
        let _written = match word {
            Message::Line(line) => out.write_all(&line),
            Message::Mark(done) => {
                let _heard = done.try_send(());
                Ok(())
            }
        };
        let left_out = dropped_lines.swap(0, Ordering::Relaxed);
        if left_out > 0 {
            let were = if left_out == 1 { "line was" } else { "lines were" };
            let line = format!("{mark}({left_out} {were} dropped here: the output was not read in time)\n");
            // As one write call, because other processes write to the same pipe.
            let _written = out.write_all(line.as_bytes());
        }
        let _flushed = out.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A writer that blocks until released, then records what it was given.
    struct Terminal {
        go: Receiver<()>,
        went: bool,
        shown: SyncSender<String>,
    }

    impl Write for Terminal {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if !self.went {
                self.went = self.go.recv().is_ok();
            }
            self.shown.send(String::from_utf8_lossy(bytes).into_owned()).unwrap();
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_blocked_terminal_delays_no_writer_and_gets_the_missed_lines() {
        let (release, go) = sync_channel(1);
        let (shown, screen) = sync_channel(10 * LINES);
        let mut aside = NonBlockingWriter::over(Terminal { go, went: false, shown }, "<4>");
        for line in 0..2 * LINES {
            aside.write_all(format!("{line}\n").as_bytes()).unwrap();
        }
        // All lines were accepted, and the terminal has shown none.
        assert!(screen.try_recv().is_err());
        release.send(()).unwrap();
        let mut heard = String::new();
        while !heard.contains("dropped here") {
            heard += &screen.recv().unwrap();
        }
        assert!(heard.starts_with("0\n") && heard.contains("\n<4>("), "{heard}");
        while !heard.contains(&format!("\n{}\n", LINES - 1)) {
            heard += &screen.recv().unwrap();
        }
    }

    #[test]
    fn pending_lines_are_written_before_the_end() {
        let (release, go) = sync_channel(1);
        let (shown, screen) = sync_channel(10);
        let mut aside = NonBlockingWriter::over(Terminal { go, went: false, shown }, "");
        release.send(()).unwrap();
        aside.write_all(b"last words\n").unwrap();
        aside.finish();
        assert_eq!(screen.try_recv().as_deref(), Ok("last words\n"));
    }
}

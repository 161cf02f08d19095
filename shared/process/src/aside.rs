//! What is said to people is written by a thread of its own: a terminal that stands still, or a
//! pipe that nobody reads, must not hold up a loop that drives motors.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

/// Lines that wait to be written; further ones are left out and counted.
const LINES: usize = 256;
/// Writing needs little, and a process may have all its memory locked.
const STACK: usize = 128 << 10;
/// How long the end of the program waits for what was said to be written.
const PATIENCE: Duration = Duration::from_millis(500);

/// Takes lines and never waits.
#[derive(Clone, Debug)]
pub struct Aside {
    to: SyncSender<Word>,
    unsaid: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Word {
    Line(Vec<u8>),
    /// Somebody wants to know when everything before this is written.
    Mark(SyncSender<()>),
}

impl Aside {
    /// Says everything on `out`, and that lines were left out behind `mark`. Where there can be no further thread,
    /// nothing is said.
    #[must_use]
    pub fn over(mut out: impl Write + Send + 'static, mark: &'static str) -> Self {
        let (to, words) = sync_channel(LINES);
        let unsaid = Arc::new(AtomicU64::new(0));
        let left_out = Arc::clone(&unsaid);
        let _thread = thread::Builder::new()
            .name("aside".to_owned())
            .stack_size(STACK)
            .spawn(move || say(&words, &left_out, mark, &mut out));
        Self { to, unsaid }
    }

    /// Waits until everything was written, but not for long.
    pub fn finish(&self) {
        let (done, is_done) = sync_channel(1);
        if self.to.try_send(Word::Mark(done)).is_ok() {
            let _in_time = is_done.recv_timeout(PATIENCE);
        }
    }
}

impl Write for Aside {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.to.try_send(Word::Line(line.to_vec())).is_err() {
            self.unsaid.fetch_add(1, Ordering::Relaxed);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn say(words: &Receiver<Word>, unsaid: &AtomicU64, mark: &str, out: &mut impl Write) {
    while let Ok(word) = words.recv() {
        // Nobody reads any more: there is nobody to tell.
        let _written = match word {
            Word::Line(line) => out.write_all(&line),
            Word::Mark(done) => {
                let _heard = done.try_send(());
                Ok(())
            }
        };
        let left_out = unsaid.swap(0, Ordering::Relaxed);
        if left_out > 0 {
            let line = format!("{mark}({left_out} lines were left out here: nobody read them)\n");
            // In one piece: others write to the same pipe.
            let _written = out.write_all(line.as_bytes());
        }
        let _flushed = out.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stands still until it is let go, and then writes down what it was told.
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
    fn a_terminal_that_stands_still_holds_nobody_up_and_hears_what_it_missed() {
        let (release, go) = sync_channel(1);
        let (shown, screen) = sync_channel(10 * LINES);
        let mut aside = Aside::over(Terminal { go, went: false, shown }, "<4>");
        for line in 0..2 * LINES {
            aside.write_all(format!("{line}\n").as_bytes()).unwrap();
        }
        // All were taken, and the terminal has shown none.
        assert!(screen.try_recv().is_err());
        release.send(()).unwrap();
        let mut heard = String::new();
        while !heard.contains("left out here") {
            heard += &screen.recv().unwrap();
        }
        assert!(heard.starts_with("0\n") && heard.contains("\n<4>("), "{heard}");
        while !heard.contains(&format!("\n{}\n", LINES - 1)) {
            heard += &screen.recv().unwrap();
        }
    }

    #[test]
    fn what_was_said_is_written_before_the_end() {
        let (release, go) = sync_channel(1);
        let (shown, screen) = sync_channel(10);
        let mut aside = Aside::over(Terminal { go, went: false, shown }, "");
        release.send(()).unwrap();
        aside.write_all(b"last words\n").unwrap();
        aside.finish();
        assert_eq!(screen.try_recv().as_deref(), Ok("last words\n"));
    }
}

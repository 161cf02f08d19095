//! The terminal of a live view: raw mode, keys, output, and its end.
//!
//! A view ends with its terminal. No call here blocks longer than its time-out: a thread of its own writes the output,
//! because a terminal that is stopped or not read accepts none.

use std::io::{self, Write};
use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use std::{panic, thread};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl};
use rustix::io::{Errno, read, write};
use rustix::process::getpgrp;
use rustix::stdio::{stderr, stdin, stdout};
use rustix::termios::{Action, OptionalActions, Termios, isatty, tcflow, tcgetattr, tcgetpgrp, tcsetattr};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGWINCH};
use signal_hook::low_level::pipe::register;

/// Switches to the alternate screen.
const ENTER: &[u8] = b"\x1b[?1049h";
/// Shows the cursor, and returns from the alternate screen.
const LEAVE: &[u8] = b"\x1b[?25h\x1b[?1049l";
/// Time-out for writing the pending output at the end.
const LAST_OUTPUT_TIMEOUT: Duration = Duration::from_millis(200);
/// Maximum number of bytes that one read takes from the terminal.
const READ_BYTES: usize = 256;

/// Why a wait ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TerminalEvent {
    /// Keys were pressed.
    Keys,
    /// The time-out expired, or the size of the terminal changed.
    Redraw,
    /// The terminal is gone, or `SIGTERM`, `SIGINT`, `SIGHUP` or `SIGQUIT` was received.
    End,
}

/// The terminal of this process, in raw mode on its alternate screen. Dropping it restores the terminal.
#[derive(Debug)]
pub struct Terminal {
    keys: BorrowedFd<'static>,
    /// What the terminal is polled for: only for its end if it was opened for writing alone.
    polled: PollFlags,
    saved: Termios,
    /// Readable after a signal that ends the view.
    end: UnixStream,
    /// Readable after a change of the terminal's size.
    resized: UnixStream,
    /// Hangs up when the terminal has refused output.
    accepts_output: UnixStream,
    output: TerminalOutput,
}

impl Terminal {
    /// Puts the terminal into raw mode, and switches to its alternate screen. Keys are read from standard input if it is
    /// a terminal, otherwise from the terminal of standard output.
    ///
    /// # Errors
    ///
    /// Standard output is no terminal or is gone, or signals cannot be watched.
    pub fn open() -> io::Result<Self> {
        let keys = if isatty(stdin()) { stdin() } else { stdout() };
        // Changes nothing, but stops a job in the background until it is in the foreground. Signals still end it here.
        tcflow(keys, Action::OOn)?;
        let (end, on_end) = UnixStream::pair()?;
        let (resized, on_resize) = UnixStream::pair()?;
        for stream in [&end, &resized] {
            stream.set_nonblocking(true)?;
        }
        // Before raw mode, so that no signal ends this process without restoring the terminal.
        for signal in [SIGTERM, SIGINT, SIGHUP, SIGQUIT] {
            register(signal, on_end.try_clone()?)?;
        }
        register(SIGWINCH, on_resize)?;
        let is_readable = !fcntl_getfl(keys)?.contains(OFlags::WRONLY);
        let (accepts_output, writer_lives) = UnixStream::pair()?;
        let output = TerminalOutput::start(writer_lives)?;
        let saved = tcgetattr(keys)?;
        let mut raw = saved.clone();
        raw.make_raw();
        restore_on_panic(keys, saved.clone(), output.clone());
        let polled = if is_readable { PollFlags::IN } else { PollFlags::empty() };
        let mut terminal = Self { keys, polled, saved, end, resized, accepts_output, output };
        tcsetattr(keys, OptionalActions::Now, &raw)?;
        terminal.output.write_all(ENTER)?;
        terminal.output.flush()?;
        Ok(terminal)
    }

    /// A writer to the terminal. It only queues.
    #[must_use]
    pub fn output(&self) -> TerminalOutput {
        self.output.clone()
    }

    /// Waits for keys, for a change of size, for the end, or until the time-out. Pressed keys are appended to `keys` as
    /// the terminal sends them.
    ///
    /// # Errors
    ///
    /// The system cannot wait, or the terminal has refused output although it is there.
    pub fn wait(&mut self, timeout: Duration, keys: &mut Vec<u8>) -> io::Result<TerminalEvent> {
        let mut fds = [
            PollFd::new(&self.end, PollFlags::IN),
            PollFd::new(&self.accepts_output, PollFlags::IN),
            PollFd::from_borrowed_fd(self.keys, self.polled),
            PollFd::new(&self.resized, PollFlags::IN),
        ];
        match poll(&mut fds, Timespec::try_from(timeout).ok().as_ref()) {
            Ok(_) => {}
            // The handler has made its pipe readable: the next wait sees it.
            Err(Errno::INTR) => return Ok(TerminalEvent::Redraw),
            Err(error) => return Err(error.into()),
        }
        let [end, accepts_output, terminal, resized] = fds.map(|fd| fd.revents());
        let is_gone = terminal.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL);
        if is_gone || !end.is_empty() {
            return Ok(TerminalEvent::End);
        }
        if !accepts_output.is_empty() {
            return self.output.refusal().map_or(Ok(TerminalEvent::End), |error| Err(error.into()));
        }
        if !resized.is_empty() {
            let mut bytes = [0; READ_BYTES];
            let _drained = read(&self.resized, &mut bytes);
        }
        if !terminal.contains(PollFlags::IN) {
            return Ok(TerminalEvent::Redraw);
        }
        let mut bytes = [0; READ_BYTES];
        match read(self.keys, &mut bytes) {
            Ok(count) if count > 0 => {
                keys.extend_from_slice(bytes.get(..count).unwrap_or_default());
                Ok(TerminalEvent::Keys)
            }
            Err(Errno::INTR | Errno::AGAIN) => Ok(TerminalEvent::Redraw),
            // A terminal that has hung up is at its end, or gives EIO.
            Ok(_) | Err(_) => Ok(TerminalEvent::End),
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _in_time = leave(self.keys, &self.saved, &mut self.output);
    }
}

/// Leaves the alternate screen and restores the mode. Returns whether the terminal has taken the output in time.
fn leave(keys: BorrowedFd<'_>, saved: &Termios, output: &mut TerminalOutput) -> bool {
    let _queued = output.write_all(LEAVE).and_then(|()| output.flush());
    let in_time = output.finish(LAST_OUTPUT_TIMEOUT);
    // The mode belongs to the job in the foreground: to change it in the background stops this process (SIGTTOU).
    // A terminal that does not control this process has no such job.
    let is_in_background = tcgetpgrp(keys).is_ok_and(|foreground| foreground != getpgrp());
    if !is_in_background {
        // A terminal that is gone has no mode to restore.
        let _restored = tcsetattr(keys, OptionalActions::Now, saved);
    }
    in_time
}

/// Restores the terminal before a panic is reported, so that the report is readable.
fn restore_on_panic(keys: BorrowedFd<'static>, saved: Termios, output: TerminalOutput) {
    let report = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        let takes_output = leave(keys, &saved, &mut output.clone());
        // A terminal that takes no output would block the report, and with it the end.
        if takes_output || !isatty(stderr()) {
            report(panic);
        }
    }));
}

/// A writer to standard output that never blocks: a thread writes what is queued.
#[derive(Clone, Debug)]
pub struct TerminalOutput {
    queue: Arc<Queue>,
}

#[derive(Debug, Default)]
struct Queue {
    pending: Mutex<Pending>,
    /// Notified of output that is to be written, and of output that is written.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Pending {
    bytes: Vec<u8>,
    is_writing: bool,
    failure: Option<Errno>,
}

impl Pending {
    fn is_busy(&self) -> bool {
        self.failure.is_none() && (self.is_writing || !self.bytes.is_empty())
    }
}

impl TerminalOutput {
    /// `lives` is closed when the terminal has refused output.
    fn start(lives: UnixStream) -> io::Result<Self> {
        let out: OwnedFd = io::stdout().as_fd().try_clone_to_owned()?;
        let queue = Arc::new(Queue::default());
        let of_writer = Arc::clone(&queue);
        thread::Builder::new().name("screen".to_owned()).spawn(move || {
            let _closed_at_end = lives;
            while of_writer.write_next(out.as_fd()).is_ok() {}
        })?;
        Ok(Self { queue })
    }

    /// Whether earlier output is not written yet. A view draws nothing meanwhile, so that the queue stays short.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.queue.lock().is_busy()
    }

    /// Waits until everything is written or refused, up to a time-out. Returns whether it is.
    fn finish(&self, timeout: Duration) -> bool {
        let pending = self.queue.lock();
        let waited = self.queue.changed.wait_timeout_while(pending, timeout, |pending| pending.is_busy());
        let (pending, _) = waited.unwrap_or_else(PoisonError::into_inner);
        !pending.is_busy()
    }

    /// Why the terminal has refused output. `None` if it is gone: that is the end of a view, and no error.
    fn refusal(&self) -> Option<Errno> {
        self.queue.lock().failure.filter(|failure| !matches!(*failure, Errno::IO | Errno::PIPE))
    }
}

impl Write for TerminalOutput {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.queue.lock().bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    /// Wakes the thread that writes: once for a frame, not for each of its parts.
    fn flush(&mut self) -> io::Result<()> {
        self.queue.changed.notify_all();
        Ok(())
    }
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Pending> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for output and writes it.
    fn write_next(&self, out: BorrowedFd<'_>) -> Result<(), Errno> {
        let mut pending = self.lock();
        while pending.bytes.is_empty() {
            pending = self.changed.wait(pending).unwrap_or_else(PoisonError::into_inner);
        }
        let bytes = std::mem::take(&mut pending.bytes);
        pending.is_writing = true;
        drop(pending);
        let written = write_whole(out, &bytes);
        let mut pending = self.lock();
        pending.is_writing = false;
        pending.failure = written.err();
        self.changed.notify_all();
        written
    }
}

/// Writes all bytes. Another program may have left the terminal non-blocking: then this waits for room.
fn write_whole(out: BorrowedFd<'_>, mut bytes: &[u8]) -> Result<(), Errno> {
    while !bytes.is_empty() {
        match write(out, bytes) {
            Ok(0) => return Err(Errno::IO),
            Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
            Err(Errno::AGAIN) => match poll(&mut [PollFd::from_borrowed_fd(out, PollFlags::OUT)], None) {
                Ok(_) | Err(Errno::INTR) => {}
                Err(error) => return Err(error),
            },
            Err(Errno::INTR) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    #[test]
    fn a_non_blocking_terminal_is_waited_for() {
        let (mut screen, mut line) = UnixStream::pair().unwrap();
        line.set_nonblocking(true).unwrap();
        let part = [b'.'; 4096];
        let mut filled = 0;
        let refused = loop {
            match line.write(&part) {
                Ok(count) => filled += count,
                Err(error) => break error,
            }
        };
        assert_eq!(refused.kind(), io::ErrorKind::WouldBlock);
        // More than the line takes at once.
        let frame = vec![b'x'; 4 * filled];
        let reader = thread::spawn(move || {
            let mut seen = Vec::new();
            screen.read_to_end(&mut seen).map(|_| seen)
        });
        let queue = Queue::default();
        queue.lock().bytes.extend_from_slice(&frame);
        assert_eq!(queue.write_next(line.as_fd()), Ok(()));
        assert!(!queue.lock().is_busy());
        drop(line);
        assert_eq!(reader.join().unwrap().unwrap().get(filled..), Some(&*frame));
    }

    #[test]
    fn refused_output_is_an_error_unless_the_terminal_is_gone() {
        let output = TerminalOutput { queue: Arc::default() };
        output.queue.lock().bytes.push(b'x');
        let (line, screen) = UnixStream::pair().unwrap();
        drop(screen);
        assert_eq!(output.queue.write_next(line.as_fd()), Err(Errno::PIPE));
        assert_eq!((output.refusal(), output.is_busy()), (None, false));
        output.queue.lock().bytes.push(b'x');
        let unwritable = std::fs::File::open("/dev/null").unwrap();
        assert_eq!(output.queue.write_next(unwritable.as_fd()), Err(Errno::BADF));
        assert_eq!(output.refusal(), Some(Errno::BADF));
        assert!(output.finish(Duration::ZERO));
    }
}

use std::io::{self, Read as _};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::net::UnixStream;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::low_level::pipe::register;

/// The signals that end a run, by kind.
#[derive(Debug)]
pub(crate) struct Signals {
    requests: UnixStream,
    hang_ups: UnixStream,
    /// Readable after any of the signals.
    wake: UnixStream,
}

/// Signals received since the last call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Received {
    /// Number of `SIGINT` and `SIGTERM`: stop requests of a person or of the service manager.
    pub(crate) requests: usize,
    /// Whether `SIGHUP` was received: the terminal has closed. Both the shell and the kernel may send it for the same
    /// event.
    pub(crate) has_hung_up: bool,
}

impl Signals {
    pub(crate) fn watch() -> io::Result<Self> {
        let (requests, on_request) = UnixStream::pair()?;
        let (hang_ups, on_hang_up) = UnixStream::pair()?;
        let (wake, on_any) = UnixStream::pair()?;
        for stream in [&requests, &hang_ups, &wake] {
            stream.set_nonblocking(true)?;
        }
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            let kind = if signal == SIGHUP { &on_hang_up } else { &on_request };
            register(signal, kind.try_clone()?)?;
            // Handlers run in the order of registration: the kind is stored before the pipe wakes the reader.
            register(signal, on_any.try_clone()?)?;
        }
        Ok(Self { requests, hang_ups, wake })
    }

    /// Readable when a signal has arrived.
    pub(crate) fn as_fd(&self) -> BorrowedFd<'_> {
        self.wake.as_fd()
    }

    pub(crate) fn receive(&mut self) -> Received {
        drain(&mut self.wake);
        Received { requests: drain(&mut self.requests), has_hung_up: drain(&mut self.hang_ups) > 0 }
    }
}

/// Number of bytes read, one for each signal.
fn drain(stream: &mut UnixStream) -> usize {
    let mut bytes = [0; 16];
    let mut all = 0;
    while let Ok(count) = stream.read(&mut bytes)
        && count > 0
    {
        all += count;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_hang_ups_are_one_event_and_requests_are_counted() {
        let mut signals = Signals::watch().unwrap();
        assert_eq!(signals.receive(), Received::default());
        for signal in [SIGHUP, SIGINT, SIGHUP, SIGTERM] {
            signal_hook::low_level::raise(signal).unwrap();
        }
        assert_eq!(signals.receive(), Received { requests: 2, has_hung_up: true });
        assert_eq!(signals.receive(), Received::default());
    }
}

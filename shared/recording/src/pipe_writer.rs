use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::FileTypeExt as _;

use clock::Duration;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

/// A pipe that can be written has space for this many bytes (`PIPE_BUF`), so a write of them does not block.
const PIPE_BYTES: usize = 4096;
/// Interval at which a full pipe is asked how long to wait on.
const ASK_INTERVAL: Duration = Duration::from_millis(50);

/// A file, or a pipe whose reader may stop to read: `limit` says for how long a write may wait for the reader. It is
/// asked again while a write waits, so that the end of a recording does not depend on another program.
pub(crate) struct PipeWriter<L> {
    file: File,
    is_pipe: bool,
    limit: L,
}

impl<L: Fn() -> Option<Duration>> PipeWriter<L> {
    pub(crate) fn new(file: File, limit: L) -> Self {
        let is_pipe =
            file.metadata().is_ok_and(|there| there.file_type().is_fifo() || there.file_type().is_socket());
        Self { file, is_pipe, limit }
    }

    /// Waits until the pipe has space.
    fn await_space(&self) -> io::Result<()> {
        let began = clock::now();
        loop {
            let mut waited = [PollFd::new(&self.file, PollFlags::OUT)];
            let time = Timespec::try_from(ASK_INTERVAL).map_err(|_long| ErrorKind::InvalidInput)?;
            match poll(&mut waited, Some(&time)) {
                Ok(0) | Err(Errno::INTR) => {}
                // An error of the pipe is that of the write.
                Ok(_) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            let waited = clock::now().since(began);
            if (self.limit)().is_some_and(|limit| waited >= limit) {
                let reason = format!("its reader has read nothing for {} s", waited.as_secs());
                return Err(io::Error::new(ErrorKind::TimedOut, reason));
            }
        }
    }
}

impl<L: Fn() -> Option<Duration>> Write for PipeWriter<L> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !self.is_pipe {
            return self.file.write(bytes);
        }
        self.await_space()?;
        self.file.write(bytes.get(..PIPE_BYTES).unwrap_or(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;
    use std::os::fd::OwnedFd;

    use super::*;

    fn pipe() -> (File, File) {
        let (reader, writer) = io::pipe().unwrap();
        (OwnedFd::from(reader).into(), OwnedFd::from(writer).into())
    }

    #[test]
    fn a_pipe_that_is_read_gets_every_byte() {
        let (mut reader, writer) = pipe();
        let bytes: Vec<u8> = (0..1_000_000_u32).flat_map(u32::to_le_bytes).collect();
        let sent = bytes.clone();
        let writing = std::thread::spawn(move || {
            PipeWriter::new(writer, || Some(Duration::from_secs(600))).write_all(&sent)
        });
        let mut received = Vec::new();
        reader.read_to_end(&mut received).unwrap();
        writing.join().unwrap().unwrap();
        assert!(received == bytes);
    }

    #[test]
    fn a_pipe_that_is_not_read_ends_the_write_at_the_limit() {
        let (_reader, writer) = pipe();
        let mut writer = PipeWriter::new(writer, || Some(Duration::from_millis(1)));
        let error = writer.write_all(&[0; 1 << 20]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TimedOut, "{error}");
    }

    #[test]
    fn a_pipe_without_a_reader_is_an_error() {
        let (reader, writer) = pipe();
        drop(reader);
        let error = PipeWriter::new(writer, || None).write_all(&[0; 10]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::BrokenPipe, "{error}");
    }
}

use std::io::{self, ErrorKind, Write};

/// A writer that accepts nothing more after its first error.
///
/// After a temporary disk error, further writes would leave a hole in the middle of the file and make the rest
/// unreadable. With this writer the file ends at the error instead.
#[derive(Debug)]
pub(crate) struct FailFastWriter<W> {
    out: W,
    /// The kind of the first error.
    failed: Option<ErrorKind>,
}

impl<W> FailFastWriter<W> {
    pub(crate) fn new(out: W) -> Self {
        Self { out, failed: None }
    }

    pub(crate) fn into_inner(self) -> W {
        self.out
    }
}

impl<W: Write> FailFastWriter<W> {
    fn attempt<T>(&mut self, act: impl FnOnce(&mut W) -> io::Result<T>) -> io::Result<T> {
        if let Some(kind) = self.failed {
            return Err(kind.into());
        }
        act(&mut self.out).inspect_err(|error| {
            // An interrupted call is retried by the caller.
            if error.kind() != ErrorKind::Interrupted {
                self.failed = Some(error.kind());
            }
        })
    }
}

impl<W: Write> Write for FailFastWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.attempt(|out| out.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt(Write::flush)
    }
}

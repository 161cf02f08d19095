use std::io::{self, BufRead, Read as _};

use crate::BudgetError;

/// Reads a file or a pipe line by line, with a maximum line length. Only one line is in memory.
///
/// ```
/// let mut lines = budget::Lines::new(&b"one\ntwo"[..], "word", 8);
/// assert_eq!(lines.next_line()?, Some(&b"one\n"[..]));
/// assert_eq!(lines.next_line()?, Some(&b"two"[..]));
/// assert_eq!(lines.number(), 2);
/// assert_eq!(lines.next_line()?, None);
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct Lines<R> {
    source: R,
    line: Vec<u8>,
    number: u64,
    read_bytes: u64,
    what: &'static str,
    max_bytes: usize,
}

impl<R: BufRead> Lines<R> {
    /// Reads the lines of `source`. Each contains one `what` and has at most `max_bytes` bytes, including its line
    /// end.
    pub fn new(source: R, what: &'static str, max_bytes: usize) -> Self {
        Self { source, line: Vec::new(), number: 0, read_bytes: 0, what, max_bytes }
    }

    /// The next line including its line end, if it has one; `None` after the last.
    ///
    /// # Errors
    ///
    /// The line cannot be read, or is too long.
    pub fn next_line(&mut self) -> io::Result<Option<&[u8]>> {
        self.line.clear();
        let (line, what) = (self.number + 1, self.what);
        let max_bytes = u64::try_from(self.max_bytes).unwrap_or(u64::MAX);
        let read =
            self.source.by_ref().take(max_bytes.saturating_add(1)).read_until(b'\n', &mut self.line)?;
        if read > self.max_bytes {
            return Err(BudgetError::Line { line, what, max_bytes }.into());
        }
        if read == 0 {
            return Ok(None);
        }
        self.number = line;
        self.read_bytes = self.read_bytes.saturating_add(u64::try_from(read).unwrap_or(u64::MAX));
        Ok(Some(&self.line))
    }

    /// The last line read.
    #[must_use]
    pub fn line(&self) -> &[u8] {
        &self.line
    }

    /// Number of bytes of all lines read.
    #[must_use]
    pub fn read_bytes(&self) -> u64 {
        self.read_bytes
    }

    /// Number of the last line read, from one.
    #[must_use]
    pub fn number(&self) -> u64 {
        self.number
    }
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::*;

    #[test]
    fn an_endless_line_is_refused_by_number_without_memory() {
        let source = BufReader::new(b"{}\n\n".chain(io::repeat(b'a')));
        let mut lines = Lines::new(source, "example", 1 << 10);
        assert_eq!(lines.next_line().unwrap(), Some(&b"{}\n"[..]));
        assert_eq!(lines.next_line().unwrap(), Some(&b"\n"[..]));
        let error = lines.next_line().unwrap_err();
        let cause = error.get_ref().and_then(|cause| cause.downcast_ref());
        assert!(
            matches!(cause, Some(BudgetError::Line { line: 3, what: "example", max_bytes: 1024 })),
            "{error:?}"
        );
        assert!(lines.line.capacity() <= 4 << 10, "{}", lines.line.capacity());
    }

    #[test]
    fn a_line_may_be_as_long_as_its_bound() {
        let mut lines = Lines::new(&b"abc\nabcd"[..], "word", 4);
        assert_eq!(lines.next_line().unwrap(), Some(&b"abc\n"[..]));
        assert_eq!(lines.next_line().unwrap(), Some(&b"abcd"[..]));
        assert!(Lines::new(&b"abcd\n"[..], "word", 4).next_line().is_err());
    }
}

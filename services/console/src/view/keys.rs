//! The keys of a terminal in raw mode.

use super::screen::ESCAPE;

/// The key Ctrl-C.
const CTRL_C: u8 = 3;
/// Maximum length of a control sequence, in bytes; a longer one is dropped.
const MAX_SEQUENCE_BYTES: usize = 32;

/// Decodes what a terminal sends. An incomplete sequence waits for its rest.
#[derive(Clone, Debug, Default)]
pub(crate) struct Keys {
    pending: Vec<u8>,
}

/// The beginning of the pending bytes: its length, and its key if it has a function.
type Begin = Option<(usize, Option<char>)>;

impl Keys {
    /// The keys in bytes of one read, as characters: Enter is `h`, Ctrl-C is `q`, arrows are arrows. Other keys have no
    /// function and are left out. The byte of Esc at the end of a read is the key Esc.
    pub(crate) fn decode(&mut self, bytes: &[u8]) -> Vec<char> {
        self.pending.extend_from_slice(bytes);
        let mut keys = Vec::new();
        while let Some((length, key)) = begin(&self.pending) {
            self.pending.drain(..length.min(self.pending.len()));
            keys.extend(key);
        }
        if self.pending.len() > MAX_SEQUENCE_BYTES {
            self.pending.clear();
        }
        keys
    }
}

/// `None` if more bytes are needed.
fn begin(bytes: &[u8]) -> Begin {
    match *bytes {
        [] => None,
        [0x1b] | [0x1b, 0x1b, ..] => Some((1, Some(ESCAPE))),
        [0x1b, b'[', ref rest @ ..] => {
            let last = rest.iter().position(|byte| (0x40..=0x7e).contains(byte))?;
            Some((last + 3, rest.get(last).and_then(|byte| arrow(*byte))))
        }
        [0x1b, b'O', ref rest @ ..] => rest.first().map(|byte| (3, arrow(*byte))),
        // Alt with a key.
        [0x1b, ..] => Some((1, None)),
        [CTRL_C, ..] => Some((1, Some('q'))),
        [b'\r' | b'\n', ..] => Some((1, Some('h'))),
        [byte, ..] if byte.is_ascii() => {
            let key = char::from(byte);
            Some((1, (!key.is_control()).then_some(key)))
        }
        [first, ..] => {
            let length = match first {
                0xc0..=0xdf => 2,
                0xe0..=0xef => 3,
                0xf0..=0xf7 => 4,
                _ => return Some((1, None)),
            };
            let text = bytes.get(..length).map(str::from_utf8)?;
            Some(text.map_or((1, None), |text| (length, text.chars().next())))
        }
    }
}

fn arrow(last: u8) -> Option<char> {
    match last {
        b'A' => Some('↑'),
        b'B' => Some('↓'),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(reads: &[&[u8]]) -> String {
        let mut keys = Keys::default();
        reads.iter().flat_map(|bytes| keys.decode(bytes)).collect()
    }

    #[test]
    fn keys_arrive_in_order_and_those_without_a_function_are_left_out() {
        let cases: [(&[&[u8]], &str); 10] = [
            (&[b"bq"], "bq"),
            (&[b"\x1b"], "\x1b"),
            (&[b"\x1b", b"["], "\x1b["),
            (&[b"\x1b[A\x1b[Bj"], "↑↓j"),
            (&[b"\x1bOA\x1bOB\x1b[1;5A"], "↑↓↑"),
            (&[b"\x1b[", b"A"], "↑"),
            (&[b"\x1b[15~\x1bb"], "b"),
            (&[b"\x03\r\n\x13\x7f"], "qhh"),
            (&["äj".as_bytes()], "äj"),
            (&[b"\xc3", b"\xa4"], "ä"),
        ];
        for (reads, expected) in cases {
            assert_eq!(decoded(reads), expected, "{reads:?}");
        }
    }

    #[test]
    fn garbage_blocks_no_later_key() {
        let endless = [b"\x1b[".to_vec(), vec![b'0'; 100]].concat();
        assert_eq!(decoded(&[&endless, b"q"]), "q");
        assert_eq!(decoded(&[&[0xff, 0xfe, 0xc3], b"q", b"q"]), "qq");
    }
}

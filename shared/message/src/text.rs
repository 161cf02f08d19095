use std::fmt;

use crate::ZeroCopySend;
use crate::bytes::message;

/// Capacity of a [`Text`] in bytes.
pub const TEXT_CAPACITY: usize = 252;

message! {
    /// A short text of fixed capacity, UTF-8.
    #[derive(PartialEq, Eq)]
    pub struct Text as "leo/Text/1" {
        length: u32,
        bytes: [u8; TEXT_CAPACITY],
    }
}

impl Text {
    /// The text, truncated at a character boundary if it does not fit.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut end = text.len().min(TEXT_CAPACITY);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let mut bytes = [0; TEXT_CAPACITY];
        for (to, from) in bytes.iter_mut().zip(text.as_bytes().iter().take(end)) {
            *to = *from;
        }
        // `end` is at most TEXT_CAPACITY, which fits.
        Self { length: u32::try_from(end).unwrap_or(0), bytes }
    }

    /// The text; empty if the bytes are not UTF-8 or the length is out of range.
    #[must_use]
    pub fn as_str(&self) -> &str {
        usize::try_from(self.length)
            .ok()
            .and_then(|length| self.bytes.get(..length))
            .and_then(|bytes| std::str::from_utf8(bytes).ok())
            .unwrap_or("")
    }
}

impl Default for Text {
    fn default() -> Self {
        Self { length: 0, bytes: [0; TEXT_CAPACITY] }
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_str().fmt(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_between_characters() {
        let text = Text::new(&"é".repeat(200));
        assert_eq!(text.as_str(), "é".repeat(126));
    }

    #[test]
    fn a_text_with_a_false_length_is_empty() {
        let lie = Text { length: u32::MAX, ..Text::new("words") };
        assert_eq!(lie.as_str(), "");
    }
}

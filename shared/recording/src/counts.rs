use std::collections::BTreeMap;
use std::fmt;

use crate::Buffer;

/// How many frames of each buffer were written, and how many were lost on the way to the file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts(BTreeMap<Buffer, Count>);

/// Of one buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Frames in the file.
    pub written: u64,
    /// Frames that the recorder lost because it, or the disk, was slow.
    pub dropped: u64,
}

impl Counts {
    /// Of every buffer of which there was anything.
    pub fn iter(&self) -> impl Iterator<Item = (Buffer, Count)> + '_ {
        self.0.iter().map(|(buffer, count)| (*buffer, *count))
    }

    /// Of one buffer.
    #[must_use]
    pub fn of(&self, buffer: Buffer) -> Count {
        self.0.get(&buffer).copied().unwrap_or_default()
    }

    /// Of all buffers together.
    #[must_use]
    pub fn total(&self) -> Count {
        self.0.values().fold(Count::default(), |sum, count| Count {
            written: sum.written + count.written,
            dropped: sum.dropped + count.dropped,
        })
    }

    pub(crate) fn written(&mut self, buffer: Buffer) {
        self.0.entry(buffer).or_default().written += 1;
    }

    pub(crate) fn set_dropped(&mut self, buffer: Buffer, frames: u64) {
        if frames > 0 || self.0.contains_key(&buffer) {
            self.0.entry(buffer).or_default().dropped = frames;
        }
    }

    /// As a record of the file: of each channel the frames written, and those dropped.
    pub(crate) fn written_down(&self) -> BTreeMap<String, String> {
        let say = |(buffer, count): (&Buffer, &Count)| {
            (buffer.to_string(), format!("{} written, {} dropped", count.written, count.dropped))
        };
        self.0.iter().map(say).collect()
    }
}

/// A line for each buffer.
impl fmt::Display for Counts {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (buffer, Count { written, dropped }) in self.iter() {
            write!(out, "{:<22} {written:>9} frames", buffer.to_string())?;
            if dropped > 0 {
                write!(out, ", {dropped} dropped")?;
            }
            out.write_str("\n")?;
        }
        Ok(())
    }
}

use std::collections::BTreeMap;
use std::fmt;

use crate::Buffer;

/// Counters of written and dropped frames, per buffer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts(BTreeMap<Buffer, Count>);

/// Counters of one buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Frames in the file.
    pub written: u64,
    /// Frames that were dropped because the recorder, or the disk, was too slow.
    pub dropped: u64,
}

impl Counts {
    /// The counters of every buffer with at least one frame.
    pub fn iter(&self) -> impl Iterator<Item = (Buffer, Count)> + '_ {
        self.0.iter().map(|(buffer, count)| (*buffer, *count))
    }

    /// The counters of one buffer.
    #[must_use]
    pub fn of(&self, buffer: Buffer) -> Count {
        self.0.get(&buffer).copied().unwrap_or_default()
    }

    /// The sums over all buffers.
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

    /// The entries of the metadata record: per channel the frames written, and those dropped.
    pub(crate) fn written_down(&self) -> BTreeMap<String, String> {
        let say = |(buffer, count): (&Buffer, &Count)| {
            (buffer.to_string(), format!("{} written, {} dropped", count.written, count.dropped))
        };
        self.0.iter().map(say).collect()
    }
}

/// One line per buffer.
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

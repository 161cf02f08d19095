use std::collections::BTreeMap;
use std::fmt;

use message::TopicId;

use crate::Channel;

/// Counters of written and dropped frames, per topic.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts(BTreeMap<TopicId, Count>);

/// Counters of one topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Frames in the file.
    pub written: u64,
    /// Frames that were dropped because the recorder, or the disk, was too slow.
    pub dropped: u64,
}

impl Counts {
    /// The counters of every topic with at least one frame.
    pub fn iter(&self) -> impl Iterator<Item = (TopicId, Count)> + '_ {
        self.0.iter().map(|(topic, count)| (*topic, *count))
    }

    /// The counters of one topic.
    #[must_use]
    pub fn of(&self, topic: TopicId) -> Count {
        self.0.get(&topic).copied().unwrap_or_default()
    }

    /// The sums over all topics.
    #[must_use]
    pub fn total(&self) -> Count {
        self.0.values().fold(Count::default(), |sum, count| Count {
            written: sum.written + count.written,
            dropped: sum.dropped + count.dropped,
        })
    }

    pub(crate) fn written(&mut self, topic: TopicId) {
        self.0.entry(topic).or_default().written += 1;
    }

    pub(crate) fn set_dropped(&mut self, topic: TopicId, frames: u64) {
        if frames > 0 || self.0.contains_key(&topic) {
            self.0.entry(topic).or_default().dropped = frames;
        }
    }

    /// The entries of the metadata record: per channel the frames written, and those dropped.
    pub(crate) fn written_down(&self) -> BTreeMap<String, String> {
        let say = |(topic, count): (&TopicId, &Count)| {
            (Channel(*topic).to_string(), format!("{} written, {} dropped", count.written, count.dropped))
        };
        self.0.iter().map(say).collect()
    }
}

/// One line per topic.
impl fmt::Display for Counts {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (topic, Count { written, dropped }) in self.iter() {
            write!(out, "{:<22} {written:>9} frames", Channel(topic).to_string())?;
            if dropped > 0 {
                write!(out, ", {dropped} dropped")?;
            }
            out.write_str("\n")?;
        }
        Ok(())
    }
}

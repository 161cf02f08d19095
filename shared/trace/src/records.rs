use std::collections::BTreeSet;
use std::io::Read;

use mcap::records::Record;
use records::{RecordFilter, RecordsError, Unchecked};

use crate::json::{self, MAX_LENGTH};
use crate::{Frame, Place, TraceError};

/// The profile in the MCAP header of a trace of the known version.
const PROFILE: &str = "leo_trace/1";
/// The prefix of the profile in all versions.
const PROFILES: &str = "leo_trace/";
/// The prefix of observation topics; the source number follows.
const TOPIC: &str = "observations/";
/// The message encoding of observation topics.
const ENCODING: &str = "json";

/// The records of an MCAP file.
pub(crate) struct Records<R> {
    records: records::Records<R>,
    /// The channels with observations; other channels are ignored.
    channels: BTreeSet<u16>,
    profile: bool,
    messages: u64,
}

impl<R: Read> Records<R> {
    pub(crate) fn new(source: R) -> Self {
        let wanted = RecordFilter { header: true, ..RecordFilter::default() };
        Self {
            records: records::Records::new(source, wanted),
            channels: BTreeSet::new(),
            profile: false,
            messages: 0,
        }
    }

    /// The next frame; `None` at the end, or if the file is truncated, which sets `cut`.
    pub(crate) fn next(&mut self, name: &str, cut: &mut Option<u64>) -> Result<Option<Frame>, TraceError> {
        loop {
            let record = self.records.next_record().map_err(|error| self.unread(name, error))?;
            let Some(record) = record else {
                *cut = self.records.cut().map(|cut| cut.record_at);
                return Ok(None);
            };
            if let Some(frame) = self.take(name, record)? {
                return Ok(Some(frame));
            }
        }
    }

    pub(crate) fn read_bytes(&self) -> u64 {
        self.records.read_bytes()
    }

    pub(crate) fn place(&self) -> Place {
        Place::Message(self.messages)
    }

    /// The part read so far that has no checksum.
    pub(crate) fn unchecked(&self) -> Option<Unchecked> {
        self.records.unchecked()
    }

    fn unread(&self, name: &str, error: RecordsError) -> TraceError {
        let (name, after) = (name.to_owned(), self.messages);
        match error {
            RecordsError::Read(source) => TraceError::Read { name, source },
            RecordsError::Budget(source) => TraceError::Budget { name, place: self.place(), source },
            RecordsError::Damaged(reason) => TraceError::Damaged { name, after, reason },
        }
    }

    fn take(&mut self, name: &str, record: Record<'_>) -> Result<Option<Frame>, TraceError> {
        if let Record::Header(header) = record {
            is_trace(name, &header.profile)?;
            self.profile = true;
        } else if let Record::Channel(channel) = record {
            if channel.topic.starts_with(TOPIC) {
                is_readable(name, &channel)?;
                self.channels.insert(channel.id);
            }
        } else if let Record::Message { header, data } = record
            && self.channels.contains(&header.channel_id)
        {
            if !self.profile {
                let found = "its messages come before its header".to_owned();
                return Err(TraceError::NotATrace { name: name.to_owned(), found });
            }
            self.messages += 1;
            let place = Place::Message(self.messages);
            if data.len() > MAX_LENGTH {
                let reason = format!("longer than {} MiB: put one frame in a message", MAX_LENGTH >> 20);
                let (name, field) = (name.to_owned(), String::new());
                return Err(TraceError::Invalid { name, place, field, reason });
            }
            return json::read_frame(&data).map(Some).map_err(|error| error.at(&data, name, place));
        }
        Ok(None)
    }
}

fn is_readable(name: &str, channel: &mcap::records::Channel) -> Result<(), TraceError> {
    let mcap::records::Channel { topic, message_encoding, .. } = channel;
    if message_encoding == ENCODING {
        return Ok(());
    }
    let found =
        format!("the messages of `{topic}` are encoded as `{message_encoding}` and not as `{ENCODING}`");
    Err(TraceError::NotATrace { name: name.to_owned(), found })
}

fn is_trace(name: &str, profile: &str) -> Result<(), TraceError> {
    let name = name.to_owned();
    match profile.strip_prefix(PROFILES) {
        _ if profile == PROFILE => Ok(()),
        Some(found) => Err(TraceError::Version { name, found: found.to_owned() }),
        None => Err(TraceError::NotATrace {
            name,
            found: format!("it is an MCAP file of the profile `{profile}`"),
        }),
    }
}

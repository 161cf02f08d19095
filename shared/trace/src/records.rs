use std::collections::BTreeSet;
use std::io::{ErrorKind, Read};

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::json::{self, LONGEST};
use crate::{Frame, Place, TraceError};

/// What the header of an MCAP file says when it is a trace of the known version.
pub(crate) const PROFILE: &str = "leo_trace/1";
/// How the profiles of all versions begin.
const PROFILES: &str = "leo_trace/";
/// How the topics of observations begin; the number of the source follows.
pub(crate) const TOPIC: &str = "observations/";
/// How their messages are encoded.
pub(crate) const ENCODING: &str = "json";

/// The records of an MCAP file.
pub(crate) struct Records<R> {
    source: R,
    records: LinearReader,
    /// Those that hold observations; what else is in the file is for others.
    channels: BTreeSet<u16>,
    profile: bool,
    messages: u64,
}

/// What a record was.
enum Found {
    Frame(Frame),
    Nothing,
    End,
}

impl<R: Read> Records<R> {
    pub(crate) fn new(source: R) -> Self {
        // A chunk is checked before anything of it is believed, and nothing is read without bound.
        let options = LinearReaderOptions::default().with_record_length_limit(4 * LONGEST);
        let options = LinearReaderOptions { prevalidate_chunk_crcs: true, ..options };
        Self {
            source,
            records: LinearReader::new_with_options(options),
            channels: BTreeSet::new(),
            profile: false,
            messages: 0,
        }
    }

    /// The next frame; `None` at the end, and where the file was cut short, which sets `cut`.
    pub(crate) fn next(&mut self, name: &str, cut: &mut bool) -> Result<Option<Frame>, TraceError> {
        loop {
            match self.advance(name, cut)? {
                Found::Frame(frame) => return Ok(Some(frame)),
                Found::Nothing => {}
                Found::End => return Ok(None),
            }
        }
    }

    pub(crate) fn place(&self) -> Place {
        Place::Message(self.messages)
    }

    fn advance(&mut self, name: &str, cut: &mut bool) -> Result<Found, TraceError> {
        let damaged = |after, source| TraceError::Damaged { name: name.to_owned(), after, source };
        let record = match self.records.next_event() {
            None => return Ok(Found::End),
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                let read = loop {
                    match self.source.read(self.records.insert(wanted)) {
                        Err(error) if error.kind() == ErrorKind::Interrupted => {}
                        read => break read,
                    }
                };
                let read = read.map_err(|source| TraceError::Read { name: name.to_owned(), source })?;
                self.records.notify_read(read);
                return Ok(Found::Nothing);
            }
            Some(Err(McapError::UnexpectedEof)) => {
                *cut = true;
                return Ok(Found::End);
            }
            Some(Ok(LinearReadEvent::Record {
                opcode: opcode @ (op::HEADER | op::CHANNEL | op::MESSAGE),
                data,
            })) => mcap::parse_record(opcode, data).map_err(|source| damaged(self.messages, source))?,
            // Chunks are opened: one that is not is inside another, which has lied about its length.
            Some(Ok(LinearReadEvent::Record { opcode: op::CHUNK, .. })) => {
                return Err(damaged(self.messages, McapError::UnexpectedEoc));
            }
            Some(Ok(LinearReadEvent::Record { .. })) => return Ok(Found::Nothing),
            Some(Err(source)) => return Err(damaged(self.messages, source)),
        };
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
                return Err(TraceError::Foreign { name: name.to_owned(), found });
            }
            self.messages += 1;
            let place = Place::Message(self.messages);
            return json::read_frame(&data).map(Found::Frame).map_err(|unread| unread.at(name, place));
        }
        Ok(Found::Nothing)
    }
}

fn is_readable(name: &str, channel: &mcap::records::Channel) -> Result<(), TraceError> {
    let mcap::records::Channel { topic, message_encoding, .. } = channel;
    if message_encoding == ENCODING {
        return Ok(());
    }
    let found =
        format!("the messages of `{topic}` are encoded as `{message_encoding}` and not as `{ENCODING}`");
    Err(TraceError::Foreign { name: name.to_owned(), found })
}

fn is_trace(name: &str, profile: &str) -> Result<(), TraceError> {
    let name = name.to_owned();
    match profile.strip_prefix(PROFILES) {
        _ if profile == PROFILE => Ok(()),
        Some(found) => Err(TraceError::Version { name, found: found.to_owned() }),
        None => {
            Err(TraceError::Foreign { name, found: format!("it is an MCAP file of the profile `{profile}`") })
        }
    }
}

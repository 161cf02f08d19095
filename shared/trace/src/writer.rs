use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapResult, WriteOptions};

use crate::Frame;
use crate::json::write_frame;
use crate::lines::VERSION;
use crate::records::{ENCODING, PROFILE, TOPIC};

/// The JSON schema of a message, for viewers.
const SCHEMA: &[u8] = include_bytes!("schema.json");
/// Chunk size, in bytes; also the maximum loss if the writer is killed.
const CHUNK: u64 = 128 << 10;

/// Writes a trace frame by frame.
///
/// ```
/// # fn main() -> std::io::Result<()> {
/// use message::Observation;
/// use trace::{Frame, Reader, Writer};
///
/// let mut writer = Writer::mcap(Vec::new())?;
/// writer.write(&Frame { at_ns: 1_000, source: 0, observations: vec![Observation::object(0, 1_000)] })?;
/// let bytes = writer.finish()?;
/// assert_eq!(Reader::new(bytes.as_slice(), "example").map_err(std::io::Error::other)?.count(), 1);
/// # Ok(())
/// # }
/// ```
pub struct Writer<W: Write>(Format<W>);

enum Format<W: Write> {
    Lines(W),
    Mcap(Box<Mcap<W>>),
}

struct Mcap<W: Write> {
    out: mcap::Writer<NoSeek<W>>,
    schema: u16,
    /// The channel of each source, with its number of messages.
    channels: BTreeMap<u16, (u16, u32)>,
}

impl<W: Write> Writer<W> {
    /// A writer of JSON lines.
    ///
    /// # Errors
    ///
    /// The header cannot be written.
    pub fn json_lines(mut out: W) -> io::Result<Self> {
        writeln!(out, "{{\"leo_trace\": {VERSION}}}")?;
        Ok(Self(Format::Lines(out)))
    }

    /// A writer of an MCAP file, with the same JSON as messages and its schema.
    ///
    /// # Errors
    ///
    /// The header cannot be written.
    pub fn mcap(out: W) -> io::Result<Self> {
        // Chunks are written whole and in this thread, so the same frames give the same bytes.
        let options = WriteOptions::new()
            .profile(PROFILE)
            .chunk_size(Some(CHUNK))
            .compression_threads(0)
            .disable_seeking(true);
        let mut out = options.create(NoSeek::new(out)).map_err(failed)?;
        let schema = out.add_schema("leo.Frame", "jsonschema", SCHEMA).map_err(failed)?;
        Ok(Self(Format::Mcap(Box::new(Mcap { out, schema, channels: BTreeMap::new() }))))
    }

    /// Writes a frame. The `source` of its observations is not written; that of the frame applies to all.
    ///
    /// # Errors
    ///
    /// The frame cannot be written.
    pub fn write(&mut self, frame: &Frame) -> io::Result<()> {
        let mut json = write_frame(frame)?;
        match &mut self.0 {
            Format::Lines(out) => {
                json.push(b'\n');
                out.write_all(&json)
            }
            Format::Mcap(mcap) => mcap.write(frame, &json).map_err(failed),
        }
    }

    /// Finishes the trace and returns the underlying writer.
    ///
    /// # Errors
    ///
    /// The remaining bytes cannot be written.
    pub fn finish(self) -> io::Result<W> {
        match self.0 {
            Format::Lines(mut out) => {
                out.flush()?;
                Ok(out)
            }
            Format::Mcap(mut mcap) => {
                mcap.out.finish().map_err(failed)?;
                let mut out = mcap.out.into_inner().into_inner();
                out.flush()?;
                Ok(out)
            }
        }
    }
}

impl<W: Write> Mcap<W> {
    fn write(&mut self, frame: &Frame, json: &[u8]) -> McapResult<()> {
        let (channel_id, sequence) = match self.channels.get(&frame.source) {
            Some(channel) => *channel,
            None => {
                let topic = format!("{TOPIC}{}", frame.source);
                (self.out.add_channel(self.schema, &topic, ENCODING, &BTreeMap::new())?, 0)
            }
        };
        self.channels.insert(frame.source, (channel_id, sequence.wrapping_add(1)));
        let header = MessageHeader { channel_id, sequence, log_time: frame.at_ns, publish_time: frame.at_ns };
        self.out.write_to_known_channel(&header, json)
    }
}

fn failed(error: mcap::McapError) -> io::Error {
    if let mcap::McapError::Io(error) = error { error } else { io::Error::other(error) }
}

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::about::{ABOUT, About};
use crate::writer::ENCODING;
use crate::{Buffer, Frame, ReadError};

/// No record is longer: what claims to be is damaged.
const LONGEST: usize = 64 << 20;

/// Reads a recording frame by frame: however long it is, one chunk is in memory.
///
/// What the file claims is an allegation: a frame comes only out of a chunk whose check sum is right,
/// from a channel whose layout is this program's, and as a head and whole entries. A file that ends in
/// the middle, because who wrote it was killed or the disk was full, is read up to there
/// ([`Self::is_cut`]).
pub struct Reader<R> {
    name: String,
    source: R,
    records: LinearReader,
    /// Names and texts of the schemas.
    schemas: BTreeMap<u16, (String, Vec<u8>)>,
    channels: BTreeMap<u16, Channel>,
    about: Option<About>,
    files: BTreeMap<String, String>,
    frames: u64,
    bytes: u64,
    cut: bool,
    ended: bool,
    /// Read ahead, to have all that stands before it.
    first: Option<Frame>,
}

/// A channel of frames, with the sizes of a head and of an entry.
#[derive(Clone, Copy)]
struct Channel {
    buffer: Buffer,
    head: usize,
    entry: usize,
}

/// What a record was.
enum Found {
    Frame(Frame),
    Nothing,
    End,
}

impl Reader<BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// It cannot be read, or is no recording.
    pub fn open(file: &Path) -> Result<Self, ReadError> {
        let name = file.display().to_string();
        match File::open(file) {
            Ok(source) => Self::new(BufReader::new(source), &name),
            Err(source) => Err(ReadError::Read { name, source }),
        }
    }
}

impl<R: Read> Reader<R> {
    /// Reads from anything, up to the first frame; `name` is what errors call it.
    ///
    /// # Errors
    ///
    /// It cannot be read, or is no recording.
    pub fn new(source: R, name: &str) -> Result<Self, ReadError> {
        // A chunk is checked before anything of it is believed, and nothing is read without bound.
        let options = LinearReaderOptions::default().with_record_length_limit(LONGEST);
        let options = LinearReaderOptions { prevalidate_chunk_crcs: true, ..options };
        let mut reader = Self {
            name: name.to_owned(),
            source,
            records: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            about: None,
            files: BTreeMap::new(),
            frames: 0,
            bytes: 0,
            cut: false,
            ended: false,
            first: None,
        };
        let first = match reader.read() {
            // Not even its beginning is one of these files.
            Err(ReadError::Damaged { name, after: 0, reason }) if reader.about.is_none() => {
                let found = format!("it cannot be read as MCAP ({reason})");
                return Err(ReadError::Foreign { name, found });
            }
            read => read?,
        };
        if reader.about.is_none() {
            let found = if reader.cut {
                format!("it ends after {} bytes, before it has begun", reader.bytes)
            } else {
                format!("it is an MCAP file without a record `{ABOUT}`")
            };
            return Err(ReadError::Foreign { name: name.to_owned(), found });
        }
        reader.first = first;
        Ok(reader)
    }

    /// What the recording says of itself; `None` never after [`Self::new`].
    #[must_use]
    pub fn about(&self) -> Option<&About> {
        self.about.as_ref()
    }

    /// The files of the robot's configuration, by their names.
    #[must_use]
    pub fn files(&self) -> &BTreeMap<String, String> {
        &self.files
    }

    /// Whether the file ended in the middle.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.cut
    }

    /// Bytes read up to now: where a file that is cut ends.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    fn read(&mut self) -> Result<Option<Frame>, ReadError> {
        loop {
            match self.advance()? {
                Found::Frame(frame) => return Ok(Some(frame)),
                Found::Nothing => {}
                Found::End => return Ok(None),
            }
        }
    }

    fn advance(&mut self) -> Result<Found, ReadError> {
        let (name, after) = (self.name.clone(), self.frames);
        let damaged = |source: McapError| ReadError::Damaged { name, after, reason: source.to_string() };
        let record = match self.records.next_event() {
            None => return Ok(Found::End),
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => {
                let read = loop {
                    match self.source.read(self.records.insert(wanted)) {
                        Err(error) if error.kind() == ErrorKind::Interrupted => {}
                        read => break read,
                    }
                };
                let read = read.map_err(|source| ReadError::Read { name: self.name.clone(), source })?;
                self.bytes = self.bytes.saturating_add(u64::try_from(read).unwrap_or(0));
                self.records.notify_read(read);
                return Ok(Found::Nothing);
            }
            Some(Err(McapError::UnexpectedEof)) => {
                self.cut = true;
                return Ok(Found::End);
            }
            // Chunks are opened: one that is not is inside another, which has lied about its length.
            Some(Ok(LinearReadEvent::Record { opcode: op::CHUNK, .. })) => {
                return Err(damaged(McapError::UnexpectedEoc));
            }
            Some(Ok(LinearReadEvent::Record {
                opcode: opcode @ (op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT),
                data,
            })) => mcap::parse_record(opcode, data).map_err(damaged)?.into_owned(),
            Some(Ok(LinearReadEvent::Record { .. })) => return Ok(Found::Nothing),
            Some(Err(source)) => return Err(damaged(source)),
        };
        self.take(record)
    }

    fn take(&mut self, record: Record<'_>) -> Result<Found, ReadError> {
        if let Record::Message { header, data } = record {
            let Some(channel) = self.channels.get(&header.channel_id).copied() else {
                return Ok(Found::Nothing);
            };
            return self.frame(channel, data.into_owned()).map(Found::Frame);
        }
        if let Record::Schema { header, data } = record {
            self.schemas.insert(header.id, (header.name, data.into_owned()));
        } else if let Record::Channel(channel) = record {
            if channel.message_encoding == ENCODING
                && let Some(buffer) = Buffer::of_topic(&channel.topic)
            {
                self.is_ours(buffer, channel.schema_id)?;
                let [head, entry] = buffer.kinds().map(|kind| kind.size());
                self.channels.insert(channel.id, Channel { buffer, head, entry });
            }
        } else if let Record::Metadata(metadata) = record {
            if metadata.name == ABOUT && self.about.is_none() {
                let about = About::read(&metadata.metadata);
                let foreign = |found| ReadError::Foreign { name: self.name.clone(), found };
                self.about = Some(about.map_err(foreign)?);
            }
        } else if let Record::Attachment { header, data, .. } = record
            && let Ok(text) = String::from_utf8(data.into_owned())
        {
            self.files.insert(header.name, text);
        }
        Ok(Found::Nothing)
    }

    /// Whether a buffer was recorded as this program lays it out.
    fn is_ours(&self, buffer: Buffer, schema: u16) -> Result<(), ReadError> {
        let (found, text) = match self.schemas.get(&schema) {
            Some((name, text)) => (name.as_str(), text.as_slice()),
            None => ("a schema that is not there", &[][..]),
        };
        let known = buffer.schema_name();
        if found == known && text == buffer.schema().as_bytes() {
            return Ok(());
        }
        let found = if found == known { format!("another {found}") } else { found.to_owned() };
        Err(ReadError::Version { name: self.name.clone(), buffer, found, known })
    }

    fn frame(&mut self, channel: Channel, bytes: Vec<u8>) -> Result<Frame, ReadError> {
        let Channel { buffer, head, entry } = channel;
        let entries = bytes.len().checked_sub(head);
        if entries.is_none_or(|entries| entries % entry != 0) {
            let reason = format!("{} bytes are no frame of `{buffer}`", bytes.len());
            return Err(ReadError::Damaged { name: self.name.clone(), after: self.frames, reason });
        }
        self.frames += 1;
        let mut frame = Frame { buffer, at_ns: 0, sequence: 0, bytes };
        let header = frame.header();
        (frame.at_ns, frame.sequence) = (header.valid_at_ns, header.sequence);
        Ok(frame)
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Frame, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(first) = self.first.take() {
            return Some(Ok(first));
        }
        if self.ended {
            return None;
        }
        let read = self.read().transpose();
        self.ended = !matches!(read, Some(Ok(_)));
        read
    }
}

impl<R> std::fmt::Debug for Reader<R> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Reader({}, {} frames)", self.name, self.frames)
    }
}

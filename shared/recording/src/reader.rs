use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use budget::Budget;
use mcap::records::Record;
use records::{RecordFilter, Records, RecordsError, Unchecked};

use crate::about::{ABOUT, About};
use crate::renamed::with_new_names;
use crate::writer::ENCODING;
use crate::{Channel, Frame, ReadError};

/// Reads a recording frame by frame; only one chunk is in memory at a time.
///
/// The file is not trusted. A frame is returned only from a chunk with a correct check sum and a channel with this
/// program's layout. It must consist of a head and whole entries. A chunk without a check sum is counted
/// ([`Self::unchecked`]), or refused ([`Self::require_check_sums`]). A truncated file, left by a killed writer or a
/// full disk, is read to its end ([`Self::is_cut`]). Memory and expansion are bounded.
pub struct Reader<R> {
    name: String,
    records: Records<R>,
    /// Budget for stored schemas and files.
    memory: Budget,
    /// Names and texts of the schemas of raw frames.
    schemas: BTreeMap<u16, (String, Vec<u8>)>,
    channels: BTreeMap<u16, RawChannel>,
    about: Option<About>,
    files: BTreeMap<String, String>,
    frames: u64,
    requires_check_sums: bool,
    ended: bool,
    /// The first frame, read ahead because all metadata stands before it.
    first: Option<Frame>,
}

/// A raw channel, with the sizes of a head and of an entry in bytes.
#[derive(Clone, Copy)]
struct RawChannel {
    channel: Channel,
    head: usize,
    entry: usize,
}

impl Reader<File> {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or is no recording.
    pub fn open(file: &Path) -> Result<Self, ReadError> {
        let name = file.display().to_string();
        match File::open(file) {
            Ok(source) => Self::new(source, &name),
            Err(source) => Err(ReadError::Read { name, source }),
        }
    }
}

impl<R: Read> Reader<R> {
    /// Reads from any source, up to the first frame; `name` is used in errors.
    ///
    /// # Errors
    ///
    /// It cannot be read, or is no recording.
    pub fn new(source: R, name: &str) -> Result<Self, ReadError> {
        let wanted =
            RecordFilter { schemas: true, metadata: true, attachments: true, ..RecordFilter::default() };
        let mut reader = Self {
            name: name.to_owned(),
            records: Records::new(source, wanted),
            memory: Budget::memory("no recording of Leo needs that much; use the original file"),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            about: None,
            files: BTreeMap::new(),
            frames: 0,
            requires_check_sums: false,
            ended: false,
            first: None,
        };
        let first = match reader.read() {
            // Damage before the description means that it is not a recording at all.
            Err(ReadError::Damaged { name, after: 0, reason }) if reader.about.is_none() => {
                let found = format!("it cannot be read as MCAP ({reason})");
                return Err(ReadError::Foreign { name, found });
            }
            read => read?,
        };
        if reader.about.is_none() {
            let found = if reader.is_cut() {
                format!("it ends after {} bytes, before the first frame", reader.bytes())
            } else {
                format!("it is an MCAP file without a record `{ABOUT}`")
            };
            return Err(ReadError::Foreign { name: name.to_owned(), found });
        }
        reader.first = first;
        Ok(reader)
    }

    /// The description of the recording; never `None` after [`Self::new`].
    #[must_use]
    pub fn about(&self) -> Option<&About> {
        self.about.as_ref()
    }

    /// The files of the robot's configuration, by their names.
    #[must_use]
    pub fn files(&self) -> &BTreeMap<String, String> {
        &self.files
    }

    /// Whether the file is truncated.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.records.is_cut()
    }

    /// Number of frames read so far.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Number of bytes read so far; the end of a truncated file.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.records.read_bytes()
    }

    /// The part read so far that has no check sum, if any.
    #[must_use]
    pub fn unchecked(&self) -> Option<Unchecked> {
        self.records.unchecked()
    }

    /// From now on, a frame from a chunk without a check sum is an error. Use it for bit-by-bit comparisons, where
    /// damage would look like a difference.
    pub fn require_check_sums(&mut self) {
        self.requires_check_sums = true;
    }

    fn read(&mut self) -> Result<Option<Frame>, ReadError> {
        loop {
            let record = self.records.next_record().map_err(|error| self.read_error(error))?;
            let Some(record) = record else { return Ok(None) };
            if let Some(frame) = self.take(record)? {
                return Ok(Some(frame));
            }
        }
    }

    fn read_error(&self, error: RecordsError) -> ReadError {
        let (name, after) = (self.name.clone(), self.frames);
        match error {
            RecordsError::Read(source) => ReadError::Read { name, source },
            RecordsError::Budget(source) => ReadError::Budget { name, after, source },
            RecordsError::Damaged(reason) => ReadError::Damaged { name, after, reason },
        }
    }

    fn take(&mut self, record: Record<'static>) -> Result<Option<Frame>, ReadError> {
        if let Record::Message { header, data } = record {
            let Some(channel) = self.channels.get(&header.channel_id).copied() else { return Ok(None) };
            return self.frame(channel, data.into_owned()).map(Some);
        }
        if let Record::Schema { header, data } = record {
            // Schemas of other encodings are for viewers.
            if header.encoding == ENCODING {
                self.keep(header.name.len() + data.len())?;
                self.schemas.insert(header.id, (header.name, data.into_owned()));
            }
        } else if let Record::Channel(channel) = record {
            if channel.message_encoding == ENCODING
                && let Some(raw) = Channel::of_name(&channel.topic)
            {
                self.check_layout(raw, channel.schema_id)?;
                let [head, entry] = raw.0.frame_kinds().map(|kind| kind.size());
                self.channels.insert(channel.id, RawChannel { channel: raw, head, entry });
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
            self.keep(header.name.len() + text.len())?;
            self.files.insert(header.name, text);
        }
        Ok(None)
    }

    /// Charges `bytes` to the memory budget.
    fn keep(&mut self, bytes: usize) -> Result<(), ReadError> {
        let spent = self.memory.spend(u64::try_from(bytes).unwrap_or(u64::MAX));
        spent.map_err(|source| self.read_error(source.into()))
    }

    /// Checks that a channel was recorded with this program's layout. Fields may have their older names.
    fn check_layout(&self, channel: Channel, schema: u16) -> Result<(), ReadError> {
        let (found, text) = match self.schemas.get(&schema) {
            Some((name, text)) => (name.as_str(), String::from_utf8_lossy(text)),
            None => ("a schema that is not there", String::new().into()),
        };
        let known = channel.schema_name();
        if found == known && with_new_names(&text) == channel.schema() {
            return Ok(());
        }
        let found = if found == known { format!("another {found}") } else { found.to_owned() };
        Err(ReadError::Version { name: self.name.clone(), channel, found, known })
    }

    fn frame(&mut self, raw: RawChannel, bytes: Vec<u8>) -> Result<Frame, ReadError> {
        let RawChannel { channel, head, entry } = raw;
        let entries = bytes.len().checked_sub(head);
        if entries.is_none_or(|entries| entries % entry != 0) {
            let reason = format!("{} bytes are no frame of `{channel}`", bytes.len());
            return Err(ReadError::Damaged { name: self.name.clone(), after: self.frames, reason });
        }
        self.frames += 1;
        let mut frame = Frame { topic: channel.0, at_ns: 0, sequence: 0, bytes };
        let header = frame.header();
        (frame.at_ns, frame.sequence) = (header.valid_at_ns, header.sequence);
        Ok(frame)
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Frame, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let read = match self.first.take() {
            Some(first) => Ok(Some(first)),
            None => self.read(),
        };
        // The first frame was read before `require_check_sums` could be called, so check here too.
        let unchecked = self.unchecked().filter(|_| self.requires_check_sums);
        let read = match unchecked {
            Some(unchecked) => Err(ReadError::Unchecked { name: self.name.clone(), unchecked }),
            None => read,
        };
        self.ended = !matches!(read, Ok(Some(_)));
        read.transpose()
    }
}

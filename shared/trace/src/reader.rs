use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::fs::File;
use std::io::{BufReader, Chain, Cursor, Read};
use std::path::Path;

use budget::BudgetError;
use message::ObservationKind;

use crate::lines::Lines;
use crate::records::Records;
use crate::rejection::RejectionCounts;
use crate::{Frame, Place, Rejections, TraceError, TraceRejectReason};

/// The magic bytes of an MCAP file.
const MAGIC: &[u8] = mcap::MAGIC;
/// The UTF-8 byte order mark that some editors write.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The bytes used for format detection, followed by the rest of the source.
type DetectedSource<R> = BufReader<Chain<Cursor<Vec<u8>>, R>>;

/// Reads a trace frame by frame. Only one frame is in memory at a time (of a compressed MCAP file, one chunk), whatever
/// the length of the trace.
///
/// The frames come in the order of the file. A frame that is not later than the previous one of its source, and an
/// observation that perception could not use, are rejected and counted ([`Self::refused`]); reading continues. A parse
/// error is the last item. A truncated trace, as after a killed writer, is read up to the truncation
/// ([`Self::is_cut`]).
///
/// ```
/// let text = r#"{"leo_trace": 1}
/// {"at_ns": 1000, "observations": [{"position_m": [0.6, 0.0, 0.03], "states": {"on": 1.0}}]}
/// {"at_ns": 2000, "observations": [{"position_m": [0.6, 0.0, 0.03], "confidence": 7}]}
/// "#;
/// let mut reader = trace::Reader::new(text.as_bytes(), "example")?;
/// let frames = reader.by_ref().collect::<Result<Vec<_>, _>>()?;
/// assert_eq!((frames.len(), frames[0].observations.len(), frames[1].observations.len()), (2, 1, 0));
/// assert_eq!(reader.refused()[0].reason.to_string(), "`confidence` must be from 0 to 1");
/// # Ok::<(), trace::TraceError>(())
/// ```
pub struct Reader<R> {
    name: String,
    form: Format<DetectedSource<R>>,
    /// The latest instant of each source.
    newest: BTreeMap<u16, u64>,
    refusals: RejectionCounts,
    /// Number of frames returned.
    frames: u64,
    /// Where an incomplete record or line at the end begins, in bytes.
    cut: Option<u64>,
    ended: bool,
}

/// The end of a truncated trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Truncation {
    /// Number of bytes of the trace.
    pub bytes: u64,
    /// Where the incomplete record or line begins, in bytes. If nothing is incomplete, the number of bytes.
    pub incomplete_at: u64,
    /// Number of frames read.
    pub frames: u64,
}

impl fmt::Display for Truncation {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bytes, incomplete_at, frames } = *self;
        let noun = if bytes == 1 { "byte" } else { "bytes" };
        write!(out, "the trace is cut short after {bytes} {noun}, as by a killed writer: ")?;
        match frames {
            0 => write!(out, "it has no whole frame")?,
            1 => write!(out, "1 whole frame was read")?,
            _ => write!(out, "{frames} whole frames were read")?,
        }
        match bytes.saturating_sub(incomplete_at) {
            0 => Ok(()),
            1 => write!(out, "; its last byte was not read"),
            unread => write!(out, "; its last {unread} bytes, from byte {incomplete_at} on, were not read"),
        }
    }
}

enum Format<R> {
    Lines(Lines<R>),
    Records(Box<Records<R>>),
}

impl Reader<File> {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or does not begin like a trace.
    pub fn open(file: &Path) -> Result<Self, TraceError> {
        let name = file.display().to_string();
        let source = File::open(file).map_err(|source| TraceError::Read { name: name.clone(), source })?;
        Self::new(source, &name)
    }
}

impl<R: Read> Reader<R> {
    /// Reads from any source; errors name it as `name`. The format is detected from the first bytes.
    ///
    /// # Errors
    ///
    /// The source cannot be read, or does not begin like a trace.
    pub fn new(mut source: R, name: &str) -> Result<Self, TraceError> {
        let mut first = Vec::new();
        let length = u64::try_from(MAGIC.len()).unwrap_or(0);
        let read = source.by_ref().take(length).read_to_end(&mut first);
        read.map_err(|source| TraceError::Read { name: name.to_owned(), source })?;
        // A file that ends within its magic is a truncated one. No JSON begins like it.
        let is_mcap = !first.is_empty() && MAGIC.starts_with(&first);
        if first.starts_with(BYTE_ORDER_MARK) {
            first.drain(..BYTE_ORDER_MARK.len());
        }
        let whole = BufReader::new(Cursor::new(first).chain(source));
        let form = if is_mcap {
            Format::Records(Box::new(Records::new(whole)))
        } else {
            Format::Lines(Lines::open(whole, name)?)
        };
        Ok(Self {
            name: name.to_owned(),
            form,
            newest: BTreeMap::new(),
            refusals: RejectionCounts::default(),
            frames: 0,
            cut: None,
            ended: false,
        })
    }

    /// The rejections so far, by reason, in the order of first occurrence.
    #[must_use]
    pub fn refused(&self) -> &[Rejections] {
        self.refusals.as_slice()
    }

    /// Whether the trace is truncated: it ends within a frame, or a length in it reaches past its end.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.cut.is_some()
    }

    /// Where the trace is truncated; `None` if it is not, as far as it was read.
    #[must_use]
    pub fn truncation(&self) -> Option<Truncation> {
        self.cut.map(|incomplete_at| Truncation {
            bytes: self.read_bytes(),
            incomplete_at,
            frames: self.frames,
        })
    }

    /// The part read so far that has no checksum, in which damage goes unnoticed. `None` for JSON lines, which never
    /// have checksums.
    #[must_use]
    pub fn unchecked(&self) -> Option<records::Unchecked> {
        match &self.form {
            Format::Lines(_) => None,
            Format::Records(records) => records.unchecked(),
        }
    }

    /// Number of bytes read.
    pub(crate) fn read_bytes(&self) -> u64 {
        match &self.form {
            Format::Lines(lines) => lines.read_bytes(),
            Format::Records(records) => records.read_bytes(),
        }
    }

    /// The error that the memory budget is exceeded.
    pub(crate) fn exceeds(&self, source: BudgetError) -> TraceError {
        TraceError::Budget { name: self.name.clone(), place: self.place(), source }
    }

    fn read(&mut self) -> Result<Option<Frame>, TraceError> {
        loop {
            let read = match &mut self.form {
                Format::Lines(lines) => lines.next(&self.name, &mut self.cut)?,
                Format::Records(records) => records.next(&self.name, &mut self.cut)?,
            };
            let Some(mut frame) = read else { return Ok(None) };
            let place = self.place();
            if self.newest.get(&frame.source).is_some_and(|newest| frame.at_ns <= *newest) {
                self.refusals.count(TraceRejectReason::Stale, frame.observations.len(), place);
                continue;
            }
            self.newest.insert(frame.source, frame.at_ns);
            let (refusals, at_ns) = (&mut self.refusals, frame.at_ns);
            let mut persons = BTreeSet::new();
            frame.observations.retain(|observation| {
                let is_person =
                    observation.kind() == Some(ObservationKind::Person) && observation.detection == 0;
                let reason = TraceRejectReason::against(observation, at_ns).or_else(|| {
                    let twice = is_person
                        && !persons.insert((
                            observation.partner,
                            observation.detection,
                            observation.observed_at_ns,
                        ));
                    twice.then_some(TraceRejectReason::Twice)
                });
                if let Some(reason) = reason {
                    refusals.count(reason, 1, place);
                }
                reason.is_none()
            });
            self.frames += 1;
            return Ok(Some(frame));
        }
    }

    fn place(&self) -> Place {
        match &self.form {
            Format::Lines(lines) => lines.place(),
            Format::Records(records) => records.place(),
        }
    }
}

impl<R: Read> Iterator for Reader<R> {
    type Item = Result<Frame, TraceError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let read = self.read().transpose();
        self.ended = !matches!(read, Some(Ok(_)));
        read
    }
}

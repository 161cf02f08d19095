use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufReader, Chain, Cursor, Read};
use std::path::Path;

use budget::BudgetError;
use message::ObservationKind;

use crate::lines::Lines;
use crate::records::Records;
use crate::refusal::Refusals;
use crate::{Frame, Place, Reason, Refused, TraceError};

/// How every MCAP file begins.
const MAGIC: &[u8] = mcap::MAGIC;
/// What some editors put before a text in UTF-8.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Bytes looked at before the rest.
type Whole<R> = BufReader<Chain<Cursor<Vec<u8>>, R>>;

/// Reads a trace frame by frame: however long it is, one frame is in memory (of a compressed MCAP
/// file, one chunk).
///
/// The frames come in the order of the file. A frame that is not later than the one before it of
/// its source, and an observation whose numbers the Perception System could not use, are refused
/// and counted, and the rest goes on ([`Self::refused`]). What is no trace at all is an error, and
/// the last item. A trace that ends in the middle, because who wrote it was killed, is read up to
/// there ([`Self::is_cut`]).
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
    form: Form<Whole<R>>,
    /// The newest instant of each source.
    newest: BTreeMap<u16, u64>,
    refusals: Refusals,
    cut: bool,
    ended: bool,
}

enum Form<R> {
    Lines(Lines<R>),
    Records(Box<Records<R>>),
}

impl Reader<File> {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// It cannot be read, or begins like no trace.
    pub fn open(file: &Path) -> Result<Self, TraceError> {
        let name = file.display().to_string();
        let source = File::open(file).map_err(|source| TraceError::Read { name: name.clone(), source })?;
        Self::new(source, &name)
    }
}

impl<R: Read> Reader<R> {
    /// Reads from anything; `name` is what errors call it. Which of its two forms the trace has
    /// is told from its first bytes.
    ///
    /// # Errors
    ///
    /// It cannot be read, or begins like no trace.
    pub fn new(mut source: R, name: &str) -> Result<Self, TraceError> {
        let mut first = Vec::new();
        let length = u64::try_from(MAGIC.len()).unwrap_or(0);
        let read = source.by_ref().take(length).read_to_end(&mut first);
        read.map_err(|source| TraceError::Read { name: name.to_owned(), source })?;
        let is_mcap = first == MAGIC;
        if first.starts_with(MARK) {
            first.drain(..MARK.len());
        }
        let whole = BufReader::new(Cursor::new(first).chain(source));
        let form = if is_mcap {
            Form::Records(Box::new(Records::new(whole)))
        } else {
            Form::Lines(Lines::open(whole, name)?)
        };
        Ok(Self {
            name: name.to_owned(),
            form,
            newest: BTreeMap::new(),
            refusals: Refusals::default(),
            cut: false,
            ended: false,
        })
    }

    /// What was refused up to now, by reason, in the order in which the reasons came up.
    #[must_use]
    pub fn refused(&self) -> &[Refused] {
        self.refusals.as_slice()
    }

    /// Whether the trace ended in the middle of a frame.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.cut
    }

    /// What has no check sum, of what was read up to now: damage in it goes unnoticed. Lines never have one, and are not
    /// counted.
    #[must_use]
    pub fn unchecked(&self) -> Option<records::Unchecked> {
        match &self.form {
            Form::Lines(_) => None,
            Form::Records(records) => records.unchecked(),
        }
    }

    /// Bytes of the trace that were read.
    pub(crate) fn read_bytes(&self) -> u64 {
        match &self.form {
            Form::Lines(lines) => lines.read_bytes(),
            Form::Records(records) => records.read_bytes(),
        }
    }

    /// The error that too much of it would have to be kept.
    pub(crate) fn exceeds(&self, source: BudgetError) -> TraceError {
        TraceError::Budget { name: self.name.clone(), place: self.place(), source }
    }

    fn read(&mut self) -> Result<Option<Frame>, TraceError> {
        loop {
            let read = match &mut self.form {
                Form::Lines(lines) => lines.next(&self.name, &mut self.cut)?,
                Form::Records(records) => records.next(&self.name, &mut self.cut)?,
            };
            let Some(mut frame) = read else { return Ok(None) };
            let place = self.place();
            if self.newest.get(&frame.source).is_some_and(|newest| frame.at_ns <= *newest) {
                self.refusals.count(Reason::Stale, frame.observations.len(), place);
                continue;
            }
            self.newest.insert(frame.source, frame.at_ns);
            let (refusals, at_ns) = (&mut self.refusals, frame.at_ns);
            let mut persons = BTreeSet::new();
            frame.observations.retain(|observation| {
                let is_person = observation.kind() == Some(ObservationKind::Person);
                let reason = Reason::against(observation, at_ns).or_else(|| {
                    let twice =
                        is_person && !persons.insert((observation.partner, observation.observed_at_ns));
                    twice.then_some(Reason::Twice)
                });
                if let Some(reason) = reason {
                    refusals.count(reason, 1, place);
                }
                reason.is_none()
            });
            return Ok(Some(frame));
        }
    }

    fn place(&self) -> Place {
        match &self.form {
            Form::Lines(lines) => lines.place(),
            Form::Records(records) => records.place(),
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

use std::collections::VecDeque;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use clock::Duration;
use folder::{Output, WholeFile};

use crate::blocks::BlockBuffer;
use crate::disk_space::missing_space;
use crate::{Frame, ReadError, Reader, RecordError, StartError, Subject, Writer};

/// Duration of one part, the unit of eviction.
const PART_NS: u64 = 2_000_000_000;

/// A ring of the most recent frames in memory, compressed: about half a megabyte per second for a robot with one
/// partner.
///
/// No clock: time is taken from the frames.
pub struct Ring {
    subject: Subject,
    span_ns: u64,
    max_bytes: usize,
    parts: VecDeque<Part>,
    present: Option<OpenPart>,
}

/// A completed part: a small recording of raw frames.
#[derive(Clone, Debug)]
struct Part {
    newest_ns: u64,
    bytes: Arc<BlockBuffer>,
}

/// The part being written.
struct OpenPart {
    began_ns: u64,
    newest_ns: u64,
    writer: Writer<BlockBuffer>,
}

/// A snapshot of a ring.
#[derive(Clone, Debug)]
pub struct RingSnapshot {
    subject: Subject,
    parts: Vec<Part>,
}

impl Ring {
    /// An empty ring that keeps `span` of frames and up to two seconds more, or as much as fits into `max_bytes`
    /// bytes. The newest two seconds are not counted.
    #[must_use]
    pub fn new(subject: Subject, span: Duration, max_bytes: usize) -> Self {
        let span_ns = clock::nanos(span);
        Self { subject, span_ns, max_bytes, parts: VecDeque::new(), present: None }
    }

    /// Adds a frame and evicts old parts.
    ///
    /// # Errors
    ///
    /// Compression failed.
    pub fn push(&mut self, frame: &Frame) -> io::Result<()> {
        let is_over = |present: &OpenPart| frame.at_ns.abs_diff(present.began_ns) >= PART_NS;
        if self.present.as_ref().is_some_and(is_over) {
            self.close()?;
        }
        // Evict before allocating, so that freed blocks are reused.
        self.forget(frame.at_ns);
        let present = match &mut self.present {
            Some(present) => present,
            empty => empty.insert(OpenPart {
                began_ns: frame.at_ns,
                newest_ns: frame.at_ns,
                writer: Writer::raw(BlockBuffer::default(), &self.subject)?,
            }),
        };
        present.newest_ns = present.newest_ns.max(frame.at_ns);
        present.writer.write(frame)
    }

    fn forget(&mut self, now_ns: u64) {
        let is_old = |part: &Part| now_ns.saturating_sub(part.newest_ns) > self.span_ns;
        while self.parts.front().is_some_and(is_old) {
            self.parts.pop_front();
        }
    }

    fn close(&mut self) -> io::Result<()> {
        if let Some(OpenPart { newest_ns, writer, .. }) = self.present.take() {
            let bytes = Arc::new(writer.finish()?);
            self.parts.push_back(Part { newest_ns, bytes });
            while self.bytes() > self.max_bytes {
                self.parts.pop_front();
            }
        }
        Ok(())
    }

    /// A snapshot of the kept frames, without copying them.
    ///
    /// # Errors
    ///
    /// Compression failed.
    pub fn last(&mut self) -> io::Result<RingSnapshot> {
        self.close()?;
        Ok(RingSnapshot { subject: self.subject.clone(), parts: self.parts.iter().cloned().collect() })
    }

    /// Allocated memory in bytes, without the newest two seconds.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.parts.iter().map(|part| part.bytes.held()).sum()
    }
}

/// Why a snapshot was not written.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The recording was not begun.
    #[error(transparent)]
    Begin(#[from] StartError),
    /// It cannot be written.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// The kept frames cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
}

impl RingSnapshot {
    /// Only the newest `span` of it, and up to two seconds more.
    #[must_use]
    pub fn newest(mut self, span: Duration) -> Self {
        let end_ns = self.parts.last().map_or(0, |part| part.newest_ns);
        self.parts.retain(|part| end_ns.saturating_sub(part.newest_ns) <= clock::nanos(span));
        self
    }

    /// Time from the oldest to the newest frame, within two seconds.
    #[must_use]
    pub fn span(&self) -> Duration {
        let at = |part: Option<&Part>| part.map_or(0, |part| part.newest_ns);
        let parts = at(self.parts.last()).saturating_sub(at(self.parts.first()));
        Duration::from_nanos(parts + if self.parts.is_empty() { 0 } else { PART_NS })
    }

    /// Writes it into a new file; returns the number of frames.
    ///
    /// # Errors
    ///
    /// The file cannot be created or written, or its disk has no space for all of it. No file is left then.
    pub fn write(&self, output: &Output) -> Result<u64, RecordError> {
        self.write_sparing(output, missing_space)
    }

    /// The same, with `missing_space` as the check for disk space for a number of bytes. Messages for viewers are
    /// generated only while writing, so the final size is not known in advance.
    fn write_sparing(
        &self,
        output: &Output,
        missing_space: impl Fn(&Path, u64) -> Option<u64>,
    ) -> Result<u64, RecordError> {
        let file = output.path().to_owned();
        // The file will be larger than the raw parts. Refuse early, so that an existing file is not overwritten in
        // vain.
        let size: usize = self.parts.iter().map(|part| part.bytes.bytes()).sum();
        if let Some(bytes) = missing_space(&file, u64::try_from(size).unwrap_or(u64::MAX)) {
            return Err(RecordError::SnapshotTooLarge { file, bytes });
        }
        let out = output
            .create_whole()
            .map_err(|source| RecordError::Create { file: output.path().to_owned(), source })?;
        let unfinished = out.unfinished().map(Path::to_owned);
        let written = unfinished.clone().unwrap_or_else(|| file.clone());
        let mut sparing = SpaceLimitedFile { out, lacks: |more| missing_space(&written, more), left: None };
        let saved = self.save(&mut sparing).map(|(_, frames)| frames);
        let SpaceLimitedFile { out, left, .. } = sparing;
        let saved = saved.and_then(|frames| out.finish().map(|()| frames).map_err(SaveError::Write));
        saved.map_err(|error| {
            if unfinished.is_none() {
                output.remove();
            }
            match (error, left) {
                (_, Some(bytes)) => RecordError::SnapshotTooLarge { file, bytes },
                (SaveError::Begin(error), None) => error.of(&file),
                (SaveError::Write(source), None) => RecordError::Write { file, source },
                (SaveError::Read(error), None) => {
                    RecordError::Write { file, source: io::Error::other(error) }
                }
            }
        })
    }

    /// Writes a complete recording of it, with messages for viewers. Returns the writer and the number of frames. Takes
    /// about a second per minute.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub fn save<W: Write>(&self, out: W) -> Result<(W, u64), SaveError> {
        let mut writer = Writer::new(out, &self.subject)?;
        for part in &self.parts {
            for frame in Reader::new(part.bytes.reading(), "what was kept")? {
                writer.write(&frame?)?;
            }
        }
        let frames = writer.counts().total().written;
        Ok((writer.finish()?, frames))
    }
}

/// A file that fails once its disk would have less free space than it must leave.
struct SpaceLimitedFile<L> {
    out: WholeFile,
    lacks: L,
    /// The free space that must be left, set once there is no more to spare.
    left: Option<u64>,
}

impl<L: Fn(u64) -> Option<u64>> Write for SpaceLimitedFile<L> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.left = self.left.or_else(|| (self.lacks)(u64::try_from(bytes.len()).unwrap_or(u64::MAX)));
        if self.left.is_some() { Err(io::ErrorKind::StorageFull.into()) } else { self.out.write(bytes) }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use folder::Existing;
    use geometry::Pose;
    use message::{Header, JointCause, JointMode, JointState, JointStates, TopicId};

    use super::*;
    use crate::Time;

    #[test]
    fn a_snapshot_is_written_completely_or_not_at_all() {
        const LEFT: u64 = 7_000_000;
        let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test").unwrap();
        let mut ring = Ring::new(subject, Duration::from_secs(60), usize::MAX);
        let state = |joint| JointState::unread(joint, JointMode::Starting, JointCause::NotStarted);
        let states: Vec<JointState> = (0..65).map(state).collect();
        for sequence in 1..=2000 {
            let header = Header { sequence, ..Header::at(sequence * 4_000_000) };
            ring.push(&Frame::of::<JointStates>(TopicId::JointStates, &header, &states)).unwrap();
        }
        let last = ring.last().unwrap();
        let kept = u64::try_from(ring.bytes()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("last.mcap");
        let output = Output::named(&file, Existing::Replace);
        let whole: u64 = {
            assert_eq!(last.write_sparing(&output, |_, _| None).unwrap(), 2000);
            fs::metadata(&file).unwrap().len()
        };
        assert!(whole > kept, "{whole} bytes of {kept}");
        // On a disk with this much free space.
        let on = |spare: u64| {
            let is_there = |file: &Path| file.metadata().map_or(0, |file| file.len());
            last.write_sparing(&output, move |file, more| (is_there(file) + more > spare).then_some(LEFT))
        };
        fs::remove_file(&file).unwrap();
        assert_eq!(on(whole).unwrap(), 2000);
        fs::remove_file(&file).unwrap();
        let error = on(whole - 1).unwrap_err();
        assert!(matches!(error, RecordError::SnapshotTooLarge { bytes: LEFT, .. }), "{error}");
        assert!(!file.exists(), "a part of it lies about");
        // A shortage known in advance does not destroy an existing file.
        fs::write(&file, "").unwrap();
        assert!(on(kept / 2).is_err() && file.exists());
        // Nor does one that is noticed while it is written.
        assert!(on(whole - 1).is_err());
        assert_eq!(
            (fs::metadata(&file).unwrap().len(), fs::read_dir(folder.path()).unwrap().count()),
            (0, 1)
        );
    }
}

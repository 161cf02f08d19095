//! Recording file of a robot in lockstep time.

use std::fs::File;
use std::path::PathBuf;

use folder::Output;
use recording::{Frame, RecordError, Subject, Writer};

/// What to record, and where.
#[derive(Clone, Debug)]
pub struct Record {
    /// The file to create.
    pub output: Output,
    /// The recorded robot.
    pub subject: Subject,
}

/// An open recording.
pub(crate) struct RecordingFile {
    file: PathBuf,
    writer: Writer<File>,
}

impl RecordingFile {
    pub(crate) fn begin(record: &Record) -> Result<Self, RecordError> {
        let Record { output, subject } = record;
        let file = output.path().to_owned();
        let out = RecordError::create(output)?;
        let writer = Writer::new(out, subject).map_err(|error| error.of(&file))?;
        Ok(Self { file, writer })
    }

    pub(crate) fn write(&mut self, frame: &Frame) -> Result<(), RecordError> {
        self.writer.write(frame).map_err(|source| RecordError::Write { file: self.file.clone(), source })
    }

    /// Writes the remaining frames and the index.
    pub(crate) fn finish(self) -> Result<(), RecordError> {
        let Self { file, writer } = self;
        writer.finish().map(drop).map_err(|source| RecordError::Write { file, source })
    }
}

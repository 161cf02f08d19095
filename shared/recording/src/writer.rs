use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use kinematics::BodyError;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, Compression, McapResult, WriteOptions};
use message::TopicId;

use crate::about::{ABOUT, About};
use crate::fail_fast_writer::FailFastWriter;
use crate::{Channel, Counts, Frame, RecordError, Schema, Subject, ViewerMessages};

/// The MCAP profile; tells viewers to expect ROS 2 messages.
pub(crate) const PROFILE: &str = "ros2";
/// The encoding of raw frames and of their schemas.
pub(crate) const ENCODING: &str = "leo";
/// Name of the metadata record with the counters.
pub(crate) const COUNTS: &str = "leo.counts";
/// Maximum time span of a chunk, in nanoseconds: the most that is lost when the recorder is killed.
const CHUNK_NS: u64 = 500_000_000;
/// Maximum size of a chunk, in bytes.
const CHUNK_BYTES: u64 = 4 << 20;

/// Writes a recording frame by frame. Deterministic: equal frames give equal bytes.
pub struct Writer<W: Write> {
    out: mcap::Writer<NoSeek<FailFastWriter<W>>>,
    /// `None` for the parts of a ring, which no viewer opens.
    views: Option<ViewerMessages>,
    raw: BTreeMap<TopicId, u16>,
    shown: BTreeMap<String, u16>,
    counts: Counts,
    chunk_began_ns: Option<u64>,
}

impl<W: Write> Writer<W> {
    /// Starts a recording that contains the robot's configuration.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub fn new(out: W, subject: &Subject) -> Result<Self, StartError> {
        let views = ViewerMessages::new(&subject.robot, &subject.x_world_base)?;
        let mut writer = Self::over(out, Some(views))?;
        writer.begin(subject).map_err(failed)?;
        Ok(writer)
    }

    /// Starts a recording of raw frames only, without the configuration.
    pub(crate) fn raw(out: W, subject: &Subject) -> io::Result<Self> {
        let mut writer = Self::over(out, None)?;
        writer.begin_as(subject).map_err(failed)?;
        Ok(writer)
    }

    fn over(out: W, views: Option<ViewerMessages>) -> io::Result<Self> {
        // No compression threads and no seeking: each chunk is written by this thread, sequentially.
        let options = WriteOptions::new()
            .profile(PROFILE)
            .library("leo")
            .compression(Some(Compression::Lz4))
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true);
        // Parts of a ring are read sequentially, so they need no index.
        let options = match &views {
            Some(_) => options,
            None => {
                options.emit_message_indexes(false).emit_summary_records(false).emit_summary_offsets(false)
            }
        };
        Ok(Self {
            out: options.create(NoSeek::new(FailFastWriter::new(out))).map_err(failed)?,
            views,
            raw: BTreeMap::new(),
            shown: BTreeMap::new(),
            counts: Counts::default(),
            chunk_began_ns: None,
        })
    }

    fn begin_as(&mut self, subject: &Subject) -> McapResult<()> {
        let metadata = About::of(subject).written();
        self.out.write_metadata(&Metadata { name: ABOUT.to_owned(), metadata })
    }

    fn begin(&mut self, subject: &Subject) -> McapResult<()> {
        self.begin_as(subject)?;
        for (name, text) in &subject.files {
            let media_type = if name.ends_with(".toml") { "application/toml" } else { "application/xml" };
            self.out.attach(&Attachment {
                log_time: 0,
                create_time: 0,
                name: (*name).to_owned(),
                media_type: media_type.to_owned(),
                data: text.as_bytes().into(),
            })?;
        }
        self.out.flush()
    }

    /// Writes a frame, and the messages for viewers.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub fn write(&mut self, frame: &Frame) -> io::Result<()> {
        let began_ns = *self.chunk_began_ns.get_or_insert(frame.at_ns);
        if frame.at_ns.abs_diff(began_ns) >= CHUNK_NS {
            self.flush()?;
            self.chunk_began_ns = Some(frame.at_ns);
        }
        self.put(frame).map_err(failed)?;
        self.counts.written(frame.topic);
        Ok(())
    }

    fn put(&mut self, frame: &Frame) -> McapResult<()> {
        let channel = match self.raw.get(&frame.topic) {
            Some(channel) => *channel,
            None => {
                let raw = Channel(frame.topic);
                let schema = self.out.add_schema(&raw.schema_name(), ENCODING, raw.schema().as_bytes())?;
                let channel = self.out.add_channel(schema, &raw.to_string(), ENCODING, &BTreeMap::new())?;
                self.raw.insert(frame.topic, channel);
                channel
            }
        };
        self.message(channel, frame, &frame.bytes)?;
        let views = self.views.as_mut().map(|views| views.of(frame));
        for view in views.unwrap_or_default() {
            let channel = match self.shown.get(&view.topic) {
                Some(channel) => *channel,
                None => {
                    let Schema { name, text } = view.schema;
                    let schema = self.out.add_schema(name, Schema::ENCODING, text.as_bytes())?;
                    let qos = BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())]);
                    let channel =
                        self.out.add_channel(schema, &view.topic, Schema::MESSAGE_ENCODING, &qos)?;
                    self.shown.insert(view.topic.clone(), channel);
                    channel
                }
            };
            self.message(channel, frame, &view.bytes)?;
        }
        Ok(())
    }

    fn message(&mut self, channel_id: u16, frame: &Frame, bytes: &[u8]) -> McapResult<()> {
        // The sequence number in MCAP has 32 bits; use the lower ones.
        let sequence = u32::try_from(frame.sequence & u64::from(u32::MAX)).unwrap_or(0);
        let header = MessageHeader { channel_id, sequence, log_time: frame.at_ns, publish_time: frame.at_ns };
        self.out.write_to_known_channel(&header, bytes)
    }

    /// Writes the current chunk. Everything up to here can then be read in any case.
    ///
    /// # Errors
    ///
    /// It cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.chunk_began_ns = None;
        self.out.flush().map_err(failed)
    }

    /// The counters so far.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Sets the number of frames of a topic that were lost before they reached the writer.
    pub fn set_dropped(&mut self, topic: TopicId, frames: u64) {
        self.counts.set_dropped(topic, frames);
    }

    /// Ends the recording with its counters and its index, and returns the underlying writer.
    ///
    /// # Errors
    ///
    /// The rest cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        let mut end = || {
            let metadata = self.counts.written_down();
            self.out.write_metadata(&Metadata { name: COUNTS.to_owned(), metadata })?;
            self.out.finish()
        };
        end().map_err(failed)?;
        let mut out = self.out.into_inner().into_inner();
        out.flush()?;
        Ok(out.into_inner())
    }
}

/// Why a recording could not be started.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The body for viewers is invalid.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// Writing failed.
    #[error(transparent)]
    Write(#[from] io::Error),
}

impl StartError {
    /// The error for a file.
    #[must_use]
    pub fn of(self, file: &Path) -> RecordError {
        match self {
            Self::Body(error) => RecordError::Body(error),
            Self::Write(source) => RecordError::Write { file: file.to_owned(), source },
        }
    }
}

fn failed(error: mcap::McapError) -> io::Error {
    if let mcap::McapError::Io(error) = error { error } else { io::Error::other(error) }
}

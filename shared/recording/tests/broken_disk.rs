//! A disk that fails at the n-th call: what was written before is intact, and the error is reported.
#![expect(
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "helpers of tests may fail them"
)]

use std::cell::{Cell, RefCell};
use std::io::{self, ErrorKind, Read, Write};
use std::rc::Rc;

use clock::Duration;
use geometry::Pose;
use message::{Header, JointCause, JointMode, JointState, JointStates, TopicId};
use recording::{Frame, ReadError, Reader, Ring, SaveError, StartError, Subject, Time, Writer};

/// How a disk fails.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// This call and all later ones fail.
    Lasting(ErrorKind),
    /// Only this call fails.
    Once(ErrorKind),
    /// From this call on, one byte is accepted at a time.
    Short,
}

/// A file in memory, on a disk that fails at the n-th call. Clones share the file.
#[derive(Clone)]
struct Disk {
    bytes: Rc<RefCell<Vec<u8>>>,
    calls: Rc<Cell<usize>>,
    fails_at: usize,
    fault: Fault,
}

impl Disk {
    fn new(fails_at: usize, fault: Fault) -> Self {
        Self { bytes: Rc::default(), calls: Rc::default(), fails_at, fault }
    }

    /// Counts a call; returns how many of `bytes` it may process.
    fn call(&self, bytes: usize) -> io::Result<usize> {
        let call = self.calls.get();
        self.calls.set(call + 1);
        match self.fault {
            Fault::Lasting(kind) if call >= self.fails_at => Err(kind.into()),
            Fault::Once(kind) if call == self.fails_at => Err(kind.into()),
            Fault::Short if call >= self.fails_at => Ok(bytes.min(1)),
            Fault::Lasting(_) | Fault::Once(_) | Fault::Short => Ok(bytes),
        }
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = self.call(bytes.len())?;
        self.bytes.borrow_mut().extend_from_slice(&bytes[..taken]);
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.call(0).map(drop)
    }
}

/// Reads from the failing disk.
struct Reading<'a> {
    disk: &'a Disk,
    left: &'a [u8],
}

impl Read for Reading<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let max = self.disk.call(into.len().min(64))?;
        self.left.read(&mut into[..max])
    }
}

fn subject() -> Subject {
    let mut subject = Subject::load(None, Time::Lockstep, Some(1), Pose::identity(), "a test");
    if let Ok(subject) = &mut subject {
        subject.files.retain(|(name, _)| *name == "perspective.toml");
    }
    subject.expect("the built-in robot")
}

fn frames() -> Vec<Frame> {
    let frame = |sequence| {
        let header = Header { sequence, ..Header::at(sequence * 250_000_000) };
        let state = JointState::unread(3, JointMode::Starting, JointCause::NotStarted);
        Frame::of::<JointStates>(TopicId::JointStates, &header, &[state])
    };
    (1..=6).map(frame).collect()
}

/// Writes a whole recording to a disk.
fn written(disk: Disk, frames: &[Frame]) -> Result<(), io::Error> {
    let writer = Writer::new(disk, &subject()).map_err(|error| match error {
        StartError::Write(error) => error,
        StartError::Body(error) => io::Error::other(error),
    });
    let mut writer = writer?;
    frames.iter().try_for_each(|frame| writer.write(frame).and_then(|()| writer.flush()))?;
    writer.finish().map(drop)
}

/// Asserts that a file contains a prefix of `frames`, or has not begun. Returns the number of frames.
fn assert_prefix(bytes: &[u8], frames: &[Frame], what: &str) -> usize {
    let reader = match Reader::new(bytes, "x.mcap") {
        Ok(reader) => reader,
        Err(ReadError::Foreign { found, .. }) if found.contains("before the first frame") => return 0,
        Err(error) => panic!("{what}: {error}"),
    };
    let found: Result<Vec<Frame>, ReadError> = reader.collect();
    let found = found.unwrap_or_else(|error| panic!("{what}: {error}"));
    assert!(frames.starts_with(&found), "{what}");
    found.len()
}

#[test]
fn a_write_error_is_reported_and_flushed_frames_stay_readable() {
    let frames = frames();
    for fault in [
        Fault::Lasting(ErrorKind::StorageFull),
        Fault::Lasting(ErrorKind::Other),
        Fault::Once(ErrorKind::Other),
        Fault::Once(ErrorKind::Interrupted),
        Fault::Short,
    ] {
        let is_harmless = matches!(fault, Fault::Short | Fault::Once(ErrorKind::Interrupted));
        let (mut prefixes, mut whole) = (Vec::new(), 0);
        for fails_at in 0.. {
            let disk = Disk::new(fails_at, fault);
            let outcome = written(disk.clone(), &frames);
            let what = format!("{fault:?} at call {fails_at}");
            let has_failed = disk.calls.get() > fails_at;
            match outcome {
                Ok(()) => {
                    assert!(is_harmless || !has_failed, "{what}: it is said to be whole");
                    assert_eq!(assert_prefix(&disk.bytes.borrow(), &frames, &what), frames.len(), "{what}");
                    whole += 1;
                }
                // Flushed frames are never lost; a truncated chunk gives no frame.
                Err(error) => {
                    assert!(has_failed, "{what}: {error}");
                    prefixes.push(assert_prefix(&disk.bytes.borrow(), &frames, &what));
                }
            }
            if !has_failed {
                break;
            }
        }
        assert!(whole > 0, "{fault:?}");
        if !is_harmless {
            assert!(prefixes.is_sorted() && prefixes.len() > 20, "{fault:?}: {prefixes:?}");
            assert_eq!((prefixes.first(), prefixes.last()), (Some(&0), Some(&frames.len())), "{fault:?}");
        }
    }
}

#[test]
fn a_ring_survives_a_failing_disk() {
    let frames = frames();
    let mut ring = Ring::new(subject(), Duration::from_secs(60), usize::MAX);
    frames.iter().for_each(|frame| ring.push(frame).expect("compresses"));
    let last = ring.last().expect("compresses");
    for fails_at in 0.. {
        let disk = Disk::new(fails_at, Fault::Lasting(ErrorKind::StorageFull));
        let saved = last.save(disk.clone());
        if disk.calls.get() <= fails_at {
            assert!(matches!(saved, Ok((_, 6))));
            break;
        }
        let error = saved.map(drop).expect_err("it failed");
        assert!(matches!(error, SaveError::Write(_) | SaveError::Begin(StartError::Write(_))), "{error}");
        assert_prefix(&disk.bytes.borrow(), &frames, &format!("call {fails_at}"));
    }
    // The snapshot is kept, and can be written elsewhere.
    let whole = Disk::new(usize::MAX, Fault::Short);
    assert!(matches!(last.save(whole.clone()), Ok((_, 6))));
    assert_eq!(assert_prefix(&whole.bytes.borrow(), &frames, "elsewhere"), frames.len());
}

#[test]
fn a_read_error_is_reported_after_the_frames_read() {
    let frames = frames();
    let disk = Disk::new(usize::MAX, Fault::Short);
    written(disk.clone(), &frames).expect("writes");
    let bytes = disk.bytes.borrow().clone();
    let mut reached = 0;
    for fails_at in 0.. {
        let disk = Disk::new(fails_at, Fault::Lasting(ErrorKind::Other));
        let source = Reading { disk: &disk, left: &bytes };
        let read: Result<Vec<_>, ReadError> =
            Reader::new(source, "x.mcap").and_then(Iterator::collect::<Result<_, _>>);
        if disk.calls.get() <= fails_at {
            assert!(read.expect("reads") == frames);
            break;
        }
        assert!(matches!(read, Err(ReadError::Read { .. })), "call {fails_at}");
        reached = fails_at;
    }
    assert!(reached > 20, "it failed {reached} times");
}

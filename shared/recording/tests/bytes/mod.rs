//! Properties that readers of recordings and traces guarantee for arbitrary bytes in an MCAP file. Shared by a property
//! test and a fuzz target.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "helpers of tests may fail them")]

use std::sync::LazyLock;

use geometry::Pose;
use message::{Header, JointCause, JointMode, JointState, JointStates, TopicId};
use recording::{Channel, Frame, ReadError, Reader, Subject, Time, Writer};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Maximum number of chunks of a script with a high expansion ratio.
const EXPANDING: usize = 12;
/// Maximum memory that a reader keeps for schemas and attachments, in bytes.
const KEPT: usize = 64 << 20;

/// Valid recordings, in both time bases.
static WHOLE: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
    [Time::Lockstep, Time::Wall].map(|time| {
        let mut subject = Subject::load(None, time, Some(1), Pose::identity(), "a test").unwrap();
        subject.files.retain(|(name, _)| *name == "perspective.toml");
        let mut writer = Writer::new(Vec::new(), &subject).unwrap();
        for sequence in 1..=4 {
            let header = Header { sequence, ..Header::at(sequence * 400_000_000) };
            let state = JointState::unread(3, JointMode::Starting, JointCause::NotStarted);
            writer.write(&Frame::of::<JointStates>(TopicId::JointStates, &header, &[state])).unwrap();
        }
        writer.finish().unwrap()
    })
});

/// The outcome of a script.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    pub(crate) frames: usize,
    pub(crate) observations: usize,
    pub(crate) is_unchecked: bool,
    pub(crate) is_damaged: bool,
    pub(crate) is_over_budget: bool,
}

/// Takes numbers from bytes; zeros after their end.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn some(&mut self, count: usize) -> &'a [u8] {
        let (now, later) = self.0.split_at(count.min(self.0.len()));
        self.0 = later;
        now
    }

    fn byte(&mut self) -> u8 {
        self.some(1).first().copied().unwrap_or(0)
    }

    fn word(&mut self) -> usize {
        usize::from(self.byte()) | usize::from(self.byte()) << 8
    }
}

/// Generates a file from the script, and reads it.
pub(crate) fn play(script: &[u8]) -> Seen {
    let mut bytes = Bytes(script);
    let kind = bytes.byte();
    let file = match kind % 8 {
        0 => bytes.0.to_vec(),
        1 => [MAGIC, bytes.0].concat(),
        2 | 3 => changed(&WHOLE[usize::from(kind % 2)], &mut bytes),
        _ => made(&mut bytes, kind % 2 == 1),
    };
    let mut seen = read(&file, kind >= 128);
    let mut trace = trace::Reader::new(file.as_slice(), "a script");
    for frame in trace.iter_mut().flatten() {
        match frame {
            Ok(frame) => seen.observations += frame.observations.len(),
            Err(error) => seen.is_over_budget |= matches!(error, trace::TraceError::Budget { .. }),
        }
    }
    seen
}

fn read(file: &[u8], requires_check_sums: bool) -> Seen {
    let mut seen = Seen::default();
    let mut reader = match Reader::new(file, "a script") {
        Ok(reader) => reader,
        Err(error) => return seen.with(&error),
    };
    if requires_check_sums {
        reader.require_check_sums();
    }
    while let Some(frame) = reader.next() {
        match frame {
            Ok(frame) => {
                assert!(!requires_check_sums || reader.unchecked().is_none(), "it was not checked");
                let [head, entry] = frame.topic.frame_kinds().map(|kind| kind.size());
                assert_eq!((frame.bytes.len() - head) % entry, 0, "{}", frame.topic);
                seen.frames += 1;
            }
            Err(error) => {
                seen = seen.with(&error);
                assert!(reader.next().is_none(), "it goes on after {error}");
            }
        }
    }
    let kept: usize = reader.files().values().map(String::len).sum();
    assert!(kept <= KEPT, "{kept} bytes of files are kept");
    seen.is_unchecked |= reader.unchecked().is_some();
    seen
}

impl Seen {
    fn with(mut self, error: &ReadError) -> Self {
        assert!(error.to_string().contains("a script"), "{error}");
        self.is_damaged |= matches!(error, ReadError::Damaged { .. });
        self.is_over_budget |= matches!(error, ReadError::Budget { .. });
        self.is_unchecked |= matches!(error, ReadError::Unchecked { .. });
        self
    }
}

/// A valid recording with bytes changed, removed or inserted.
fn changed(whole: &[u8], bytes: &mut Bytes<'_>) -> Vec<u8> {
    let mut file = whole.to_vec();
    while !bytes.0.is_empty() && !file.is_empty() {
        let at = bytes.word() % file.len();
        match bytes.byte() % 4 {
            0 | 1 => file[at] ^= bytes.byte(),
            2 => file.truncate(at),
            _ => {
                let count = usize::from(bytes.byte() % 16);
                file.splice(at..at, bytes.some(count).iter().copied());
            }
        }
    }
    file
}

/// A file of generated records, valid or not.
fn made(bytes: &mut Bytes<'_>, is_trace: bool) -> Vec<u8> {
    let mut file = MAGIC.to_vec();
    file.extend(record(0x01, &[text(if is_trace { "leo_trace/1" } else { "ros2" }), text("")].concat()));
    let about = ["time", "wall", "partners", "1", "program", "", "base_in_world", "0 0 0 0 0 0 1"];
    let about: Vec<u8> = about.into_iter().flat_map(text).collect();
    file.extend(record(0x0C, &[text("leo"), text_length(about.len()), about].concat()));
    let mut expanding = 0;
    while !bytes.0.is_empty() {
        match bytes.byte() % 4 {
            0 if expanding < EXPANDING => {
                expanding += 1;
                file.extend(expanding_chunk(bytes.byte(), 1 + usize::from(bytes.byte() % 64)));
            }
            0 | 1 => file.extend(some_record(bytes)),
            _ => {
                let count = usize::from(bytes.byte() % 8);
                let records: Vec<u8> = (0..count).flat_map(|_| some_record(bytes)).collect();
                file.extend(plain_chunk(&records, bytes));
            }
        }
    }
    file.extend([record(0x0F, &[0; 4]), record(0x02, &[0; 20])].concat());
    file.extend(MAGIC);
    file
}

/// A record of a known kind, with a body from the script; sometimes its length is wrong.
fn some_record(bytes: &mut Bytes<'_>) -> Vec<u8> {
    let channel = Channel(TopicId::JointStates);
    let id = u16::from(bytes.byte() % 4).to_le_bytes();
    let some = |bytes: &mut Bytes<'_>| {
        let count = usize::from(bytes.byte());
        bytes.some(count).to_vec()
    };
    let mut made = match bytes.byte() % 8 {
        0 => {
            let schema = channel.schema();
            let schema = [text_length(schema.len()), schema.into_bytes()].concat();
            record(0x03, &[id.to_vec(), text(&channel.schema_name()), text("leo"), schema].concat())
        }
        1 => {
            let topic = if bytes.byte().is_multiple_of(2) {
                channel.to_string()
            } else {
                "observations/0".to_owned()
            };
            let encoding = if topic.starts_with("obs") { "json" } else { "leo" };
            record(0x04, &[id.to_vec(), id.to_vec(), text(&topic), text(encoding), vec![0; 4]].concat())
        }
        2 | 3 => record(0x05, &[id.to_vec(), vec![0; 20], some(bytes)].concat()),
        4 => {
            let head = Header { sequence: 1, ..Header::at(9) };
            let state = JointState::unread(3, JointMode::Starting, JointCause::NotStarted);
            let frame = Frame::of::<JointStates>(channel.0, &head, &[state]);
            record(0x05, &[id.to_vec(), vec![0; 20], frame.bytes].concat())
        }
        5 => {
            let json = r#"{"at_ns": 5, "observations": [{"position_m": [0.6, 0, 0]}]}"#;
            record(0x05, &[id.to_vec(), vec![0; 20], json.as_bytes().to_vec()].concat())
        }
        6 => record(0x09, &some(bytes)),
        _ => record(bytes.byte() % 18, &some(bytes)),
    };
    if bytes.byte() >= 240 {
        made[1 + usize::from(bytes.byte() % 8)] = bytes.byte();
    }
    made
}

/// An uncompressed chunk without a check sum; sometimes a length is wrong.
fn plain_chunk(records: &[u8], bytes: &mut Bytes<'_>) -> Vec<u8> {
    let mut size = u64::try_from(records.len()).unwrap().to_le_bytes();
    let mut body = [&[0; 16][..], &size, &[0; 4], &text("")].concat();
    if bytes.byte() >= 240 {
        size[usize::from(bytes.byte() % 8)] = bytes.byte();
    }
    body.extend([&size[..], records].concat());
    record(0x06, &body)
}

/// A chunk of one repeated byte, `mib` MiB, compressed to a few kilobytes.
fn expanding_chunk(byte: u8, mib: usize) -> Vec<u8> {
    const BLOCK: usize = 128 << 10;
    let size = mib << 20;
    let blocks = size / BLOCK;
    // A zstd frame with a single segment of known size, made of RLE blocks.
    let mut frame = [&[0x28, 0xB5, 0x2F, 0xFD, 0xA0][..], &text_length(size)].concat();
    for block in 1..=blocks {
        let head = usize::from(block == blocks) | 1 << 1 | BLOCK << 3;
        frame.extend(&head.to_le_bytes()[..3]);
        frame.push(byte);
    }
    let long = |size: usize| u64::try_from(size).unwrap().to_le_bytes();
    let head = [&[0; 16][..], &long(size), &[0; 4], &text("zstd"), &long(frame.len())].concat();
    record(0x06, &[head, frame].concat())
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &u64::try_from(body.len()).unwrap().to_le_bytes(), body].concat()
}

fn text(text: &str) -> Vec<u8> {
    [text_length(text.len()), text.as_bytes().to_vec()].concat()
}

fn text_length(bytes: usize) -> Vec<u8> {
    u32::try_from(bytes).unwrap().to_le_bytes().to_vec()
}

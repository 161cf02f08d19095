//! What a ring takes from the heap: as much after hours as after its first minutes.
#![expect(clippy::expect_used, reason = "helpers of tests may fail them")]

use std::collections::BTreeMap;

use clock::Duration;
use geometry::Pose;
use recording::{Buffer, Frame, Ring, Subject, Time};

/// What a ring forgets at once.
const PART_NS: u64 = 2_000_000_000;
const SPAN: Duration = Duration::from_secs(60);
/// Frames of a part, and the bytes of each.
const FRAMES: u64 = 20;
const BYTES: u64 = 16_000;
/// The bytes of a part of which nothing can be compressed.
const PART: usize = 320_000;

/// A ring, and what it takes from the heap.
struct Watched {
    ring: Ring,
    sequence: u64,
    noise: u64,
    /// Pieces of memory that it holds, by their size, and the most of each size that there ever were.
    held: BTreeMap<usize, i64>,
    most: BTreeMap<usize, i64>,
}

impl Watched {
    fn new(bytes_most: usize) -> Self {
        let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test");
        let ring = Ring::new(subject.expect("the built-in robot"), SPAN, bytes_most);
        Self { ring, sequence: 0, noise: 2006, held: BTreeMap::new(), most: BTreeMap::new() }
    }

    fn noise(&mut self) -> u64 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 7;
        self.noise ^= self.noise << 17;
        self.noise
    }

    /// Pushes a part, of each of whose frames at least so many bytes cannot be compressed. What it holds is
    /// looked at after the part, where nothing is held of how one is written.
    fn push(&mut self, least: u64) {
        let noisy = BYTES - self.noise() % (BYTES - least + 1);
        let frame = |_| {
            self.sequence += 1;
            let byte = |place| if place < noisy { self.noise().to_le_bytes()[0] } else { 0 };
            let bytes = (0..BYTES).map(byte).collect();
            let at_ns = self.sequence * PART_NS / FRAMES;
            Frame { buffer: Buffer::Scene, at_ns, sequence: self.sequence, bytes }
        };
        let part: Vec<Frame> = (0..FRAMES).map(frame).collect();
        let (pushed, pieces) = testkit::by_size_in(|| {
            part.iter().try_for_each(|frame| self.ring.push(frame))?;
            self.ring.last().map(drop)
        });
        pushed.expect("is kept");
        for (size, more) in pieces {
            let held = self.held.entry(size).or_default();
            *held += more;
            let most = self.most.entry(size).or_default();
            *most = (*most).max(*held);
        }
    }

    /// Bytes that it holds.
    fn held(&self) -> usize {
        bytes(&self.held)
    }

    /// Bytes of a heap that is enough whatever it does with what it gets back: where it neither joins nor splits,
    /// a piece is of use to those alone who want one just as long.
    fn needed(&self) -> usize {
        bytes(&self.most)
    }
}

fn bytes(pieces: &BTreeMap<usize, i64>) -> usize {
    pieces.iter().map(|(size, pieces)| size * usize::try_from(*pieces).expect("not fewer than none")).sum()
}

#[test]
fn a_ring_takes_for_what_comes_what_it_gives_back_of_what_it_forgets() {
    let mut watched = Watched::new(usize::MAX);
    // A minute in which nothing can be compressed, and a little more.
    (0..40).for_each(|_| watched.push(BYTES));
    let (says, held, needed) = (watched.ring.bytes(), watched.held(), watched.needed());
    assert!(says > 30 * PART, "{says} bytes are no minute");
    assert!((says..says + says / 100).contains(&held), "it says {says} and holds {held}");
    // Twenty minutes in which more or less can, and another minute like the first one.
    let mut least = says;
    for _ in 0..600 {
        watched.push(2_000);
        least = least.min(watched.ring.bytes());
    }
    assert!(least < says * 3 / 4, "{least} of {says}: it is all alike");
    (0..40).for_each(|_| watched.push(BYTES));
    assert!(watched.held() <= held + PART, "{held} bytes became {}", watched.held());
    assert!(watched.needed() <= needed + PART, "{needed} bytes of a heap became {}", watched.needed());
}

#[test]
fn a_ring_takes_no_more_than_it_may() {
    const MOST: usize = 3_000_000;
    let mut watched = Watched::new(MOST);
    let mut most = 0;
    for _ in 0..100 {
        watched.push(2_000);
        most = most.max(watched.held());
    }
    // What says where the blocks are is a hundredth of them at most.
    assert!(most > MOST / 2 && most <= MOST + MOST / 100, "{most}");
}

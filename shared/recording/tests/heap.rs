//! Heap usage of a ring does not grow over hours.
#![expect(clippy::expect_used, reason = "helpers of tests may fail them")]

use std::collections::BTreeMap;

use clock::Duration;
use geometry::Pose;
use message::TopicId;
use recording::{Frame, Ring, Subject, Time};

/// Duration of a part of the ring.
const PART_NS: u64 = 2_000_000_000;
const SPAN: Duration = Duration::from_secs(60);
/// Number of frames in a part, and the size of each in bytes.
const FRAMES: u64 = 20;
const BYTES: u64 = 16_000;
/// Size of a part of incompressible frames, in bytes.
const PART: usize = 320_000;

/// A ring with its allocations.
struct Watched {
    ring: Ring,
    sequence: u64,
    noise: u64,
    /// Number of live allocations by size, and their maximum so far.
    held: BTreeMap<usize, i64>,
    max: BTreeMap<usize, i64>,
}

impl Watched {
    fn new(max_bytes: usize) -> Self {
        let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test");
        let ring = Ring::new(subject.expect("the built-in robot"), SPAN, max_bytes);
        Self { ring, sequence: 0, noise: 2006, held: BTreeMap::new(), max: BTreeMap::new() }
    }

    fn noise(&mut self) -> u64 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 7;
        self.noise ^= self.noise << 17;
        self.noise
    }

    /// Pushes one part, with at least `min` incompressible bytes per frame. Allocations are measured after the part,
    /// when no temporary ones exist.
    fn push(&mut self, min: u64) {
        let noisy = BYTES - self.noise() % (BYTES - min + 1);
        let frame = |_| {
            self.sequence += 1;
            let byte = |place| if place < noisy { self.noise().to_le_bytes()[0] } else { 0 };
            let bytes = (0..BYTES).map(byte).collect();
            let at_ns = self.sequence * PART_NS / FRAMES;
            Frame { topic: TopicId::Scene, at_ns, sequence: self.sequence, bytes }
        };
        let part: Vec<Frame> = (0..FRAMES).map(frame).collect();
        let (pushed, pieces) = testkit::blocks_by_size_in(|| {
            part.iter().try_for_each(|frame| self.ring.push(frame))?;
            self.ring.last().map(drop)
        });
        pushed.expect("is kept");
        for (size, more) in pieces {
            let held = self.held.entry(size).or_default();
            *held += more;
            let max = self.max.entry(size).or_default();
            *max = (*max).max(*held);
        }
    }

    /// Allocated bytes.
    fn held(&self) -> usize {
        bytes(&self.held)
    }

    /// Bytes needed by a worst-case allocator that neither splits nor joins free blocks: the sum of the maxima per
    /// size.
    fn needed(&self) -> usize {
        bytes(&self.max)
    }
}

fn bytes(pieces: &BTreeMap<usize, i64>) -> usize {
    pieces.iter().map(|(size, pieces)| size * usize::try_from(*pieces).expect("not fewer than none")).sum()
}

#[test]
fn a_ring_reuses_the_memory_of_evicted_parts() {
    let mut watched = Watched::new(usize::MAX);
    // A little more than a minute of incompressible frames.
    (0..40).for_each(|_| watched.push(BYTES));
    let (says, held, needed) = (watched.ring.bytes(), watched.held(), watched.needed());
    assert!(says > 30 * PART, "{says} bytes are no minute");
    assert!((says..says + says / 100).contains(&held), "it says {says} and holds {held}");
    // Twenty minutes of varying compressibility, then another minute like the first one.
    let mut min = says;
    for _ in 0..600 {
        watched.push(2_000);
        min = min.min(watched.ring.bytes());
    }
    assert!(min < says * 3 / 4, "{min} of {says}: it is all alike");
    (0..40).for_each(|_| watched.push(BYTES));
    assert!(watched.held() <= held + PART, "{held} bytes became {}", watched.held());
    assert!(watched.needed() <= needed + PART, "{needed} bytes of a heap became {}", watched.needed());
}

#[test]
fn a_ring_respects_its_memory_limit() {
    const MAX_BYTES: usize = 3_000_000;
    let mut watched = Watched::new(MAX_BYTES);
    let mut max = 0;
    for _ in 0..100 {
        watched.push(2_000);
        max = max.max(watched.held());
    }
    // The block lists take at most a hundredth of the blocks.
    assert!(max > MAX_BYTES / 2 && max <= MAX_BYTES + MAX_BYTES / 100, "{max}");
}

//! Interprets arbitrary bytes as frames of the percept buffer and checks the guarantees of the belief process on the
//! belief buffers. Shared by a property test and a fuzz target.
#![expect(clippy::unwrap_used, reason = "helpers of tests may fail them")]

use belief_process::Believer;
use clock::{Duration, Instant};
use message::{
    Feature, Header, Hop, Observation, ObservationKind, Perceived, PerceptHead, PerceptValue, Snapshot,
    SourceSet,
};
use perception::{Frame, Perception};

#[path = "../../../../tests/variants/mod.rs"]
mod variants;

const CAPACITY: usize = 8;

/// Reads numbers from bytes; zeros when there are none left.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.byte())
    }

    fn byte(&mut self) -> u8 {
        match self.0.split_first() {
            Some((byte, later)) => {
                self.0 = later;
                *byte
            }
            None => 0,
        }
    }

    fn word(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    fn long(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    fn number(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }

    fn numbers<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| self.number())
    }

    /// Mostly an instant near `now`, else any.
    fn instant(&mut self, now: Instant) -> u64 {
        match self.byte() {
            0..=223 => now.as_nanos().saturating_sub(u64::from(self.byte()) * 40_000),
            224..=239 => now.as_nanos().saturating_add(u64::from(self.byte()) * 10_000_000),
            240.. => self.long(),
        }
    }

    /// Mostly a thing on the table, a person or an occluder, sometimes arbitrary bits.
    fn observation(&mut self, now: Instant) -> Observation {
        let across = |byte: u8| f32::from(byte) / 128.0 - 1.0;
        let mut observation = Observation {
            position_m: [0.7 + across(self.byte()), across(self.byte()), 0.2],
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            half_extents_m: [0.03; 3],
            colour_rgb: if self.byte() < 128 { [0.8, 0.05, 0.05] } else { [0.05, 0.15, 0.8] },
            ..Observation::object(u16::from(self.byte() % 3), self.instant(now))
        };
        match self.byte() {
            0..=159 => {}
            160..=191 => {
                observation.kind = ObservationKind::Person.raw();
                observation.partner = u16::from(self.byte() % 4);
                observation.position_m = [1.5, 0.0, 0.55];
                // The person looks back at the robot.
                observation.orientation_xyzw = [0.0, 0.0, 1.0, 0.0];
            }
            192..=207 => observation.kind = ObservationKind::Occluder.raw(),
            208..=215 => observation.orientation_xyzw = self.numbers(),
            216..=223 => observation.position_m = self.numbers(),
            224..=231 => observation.held_by = self.word(),
            232..=239 => observation.modality = self.word(),
            240.. => {
                observation.confidence = self.number();
                observation.half_extents_m = self.numbers();
                observation.states = self.numbers();
                observation.partner = self.word();
                observation.kind = self.word();
            }
        }
        observation
    }

    /// Mostly the robot's percepts of the observation, else invalid ones.
    fn snapshot(&mut self, perception: &Perception, observation: &Observation) -> Snapshot {
        let mut snapshot = perception.perceive(observation, &Frame { agent: 0 });
        if self.byte() >= 224 {
            for _value in 0..self.byte() % 16 {
                let feature = match self.byte() % 5 {
                    0 => Feature::None,
                    1 => Feature::Symbol(self.word()),
                    2 => Feature::Number(self.number()),
                    3 => Feature::Vector(self.numbers()),
                    _ => Feature::Orientation(self.numbers()),
                };
                // A full snapshot drops further values.
                let _taken =
                    snapshot.push(PerceptValue::new(self.word() % 16, self.number(), self.number(), feature));
            }
        }
        snapshot
    }
}

/// Counters of a run, so that a test can check that the run was not empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    /// Frames.
    pub(crate) frames: u64,
    /// Beliefs of the robot, of its partner, and of the robot in its partner, over all frames.
    pub(crate) beliefs: [usize; 3],
    /// Rejected entries.
    pub(crate) refused: u64,
}

/// Runs the core on the bytes, the first of which selects the configuration, and checks the guarantees after every
/// frame.
pub(crate) fn play(bytes: &[u8]) -> Seen {
    let mut bytes = Bytes(bytes);
    let percepts = variants::varied(bytes.byte());
    let config = perspective::settings::Perspective::builtin();
    let perception = Perception::new(&percepts).unwrap();
    let mut believer = Believer::new(&percepts, &config, 1, 2, CAPACITY).unwrap();
    let mut now = Instant::EPOCH + Duration::from_secs(100);
    let mut valid_at_ns = 0;
    let mut seen = Seen::default();
    while !bytes.0.is_empty() {
        now += Duration::from_micros(u64::from(bytes.word()) / 8);
        let mut header = Header::at(bytes.instant(now));
        header.pass(Hop::Observed, bytes.instant(now));
        // One or several of the sources that the bytes may name, or none.
        let active_sources =
            (0..bytes.byte() % 4).map(|_| SourceSet::of(u16::from(bytes.byte() % 4))).collect();
        let head = PerceptHead::new(header, active_sources);
        let entries: Vec<Perceived> = (0..bytes.byte() % 12)
            .map(|_| {
                let observation = bytes.observation(now);
                Perceived { observation, snapshot: bytes.snapshot(&perception, &observation) }
            })
            .collect();
        believer.step(now, &head, &entries);
        seen.frames += 1;
        for (perspective, beliefs) in (0..believer.perspectives()).zip(&mut seen.beliefs) {
            let (head, count) = (believer.head(perspective), believer.len(perspective));
            assert!(count <= CAPACITY);
            assert!(head.frame().is_some() && head.eye().is_some());
            assert!((valid_at_ns..=now.as_nanos()).contains(&head.header.valid_at_ns), "{head:?}");
            let mut last = 0;
            for index in 0..count {
                let belief = believer.entry(perspective, index).unwrap();
                assert!(belief.id > last, "identities are told apart and in order");
                last = belief.id;
                for remembered in belief.percepts() {
                    assert!(remembered.feature().is_some(), "{remembered:?}");
                    assert!((0.0..=1.0).contains(&remembered.matching), "{remembered:?}");
                    assert!((0.0..=1.0).contains(&remembered.confidence), "{remembered:?}");
                }
            }
            *beliefs += count;
        }
        valid_at_ns = believer.head(0).header.valid_at_ns;
        seen.refused = believer.head(0).refused;
    }
    seen
}

//! Plays arbitrary bytes to the sensor as frames of several sources and checks its guarantees. Shared by a
//! property test and a fuzz target.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "helpers of tests may fail them")]

use std::collections::BTreeMap;
use std::path::Path;

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use config::leo::Source;
use message::{Header, Hop, Loss, Observation, ObservationKind, SourceSet};
use sensor_process::Sensor;

const CAPACITY: usize = 12;
const AHEAD: Duration = Duration::from_millis(100);
const BEHIND: Duration = Duration::from_secs(10);

/// Source of values from bytes; zeros at the end.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let count = N.min(self.0.len());
        let (now, later) = self.0.split_at(count);
        taken[..count].copy_from_slice(now);
        self.0 = later;
        taken
    }

    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
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

    /// Mostly an instant near `now`, sometimes any.
    fn instant(&mut self, now: Instant) -> u64 {
        match self.byte() {
            0..=191 => now.as_nanos().saturating_sub(u64::from(self.byte()) * 40_000),
            192..=207 => now.as_nanos().saturating_add(u64::from(self.byte()) * 1_000_000),
            208..=223 => now.as_nanos().saturating_sub(u64::from(self.byte()) * 100_000_000),
            224.. => self.long(),
        }
    }

    /// Mostly a valid observation, sometimes one with a random field, or all random.
    fn observation(&mut self, now: Instant) -> Observation {
        // Sometimes in range of its source but not of the robot.
        let across_m = match self.byte() {
            255 => 950.0,
            254 => -950.0,
            _ => 0.2,
        };
        let mut observation = Observation {
            position_m: [0.01 * f32::from(self.byte()), across_m, 0.03],
            half_extents_m: [0.03; 3],
            ..Observation::object(self.word(), self.instant(now))
        };
        // Mostly upright; in the other cases the orientation was not observed.
        if self.byte() < 224 {
            observation.orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        }
        match self.byte() {
            0..=127 => {}
            128 => observation.modality = self.word(),
            129 => observation.kind = self.word(),
            130 => {
                observation.kind = ObservationKind::Person.raw();
                observation.partner = self.word();
            }
            131 => observation.confidence = self.number(),
            132 => observation.position_m = self.numbers(),
            133 => observation.orientation_xyzw = self.numbers(),
            134 => observation.half_extents_m = self.numbers(),
            135 => observation.colour_rgb = self.numbers(),
            136 => observation.shape = self.numbers(),
            137 => observation.states = self.numbers(),
            138 => observation.held_by = self.word(),
            139 => observation.position_sd_m = self.numbers(),
            140..=239 => {}
            240.. => {
                observation = Observation {
                    observed_at_ns: self.long(),
                    source: self.word(),
                    modality: self.word(),
                    kind: self.word(),
                    partner: self.word(),
                    held_by: self.word(),
                    detection: self.word(),
                    confidence: self.number(),
                    position_m: self.numbers(),
                    position_sd_m: self.numbers(),
                    orientation_xyzw: self.numbers(),
                    half_extents_m: self.numbers(),
                    colour_rgb: self.numbers(),
                    shape: self.numbers(),
                    states: self.numbers(),
                }
            }
        }
        observation
    }

    fn header(&mut self, now: Instant, sequence: u64) -> Header {
        let mut header = Header { sequence, incarnation: 1, ..Header::at(self.instant(now)) };
        header.pass(Hop::Observed, self.instant(now));
        match self.byte() {
            0..=215 => {}
            216..=219 => header.sequence = self.long(),
            220..=231 => header.incarnation = self.long(),
            232..=239 => header.over_capacity = self.long(),
            240.. => header.hops_ns = std::array::from_fn(|_| self.long()),
        }
        header
    }
}

/// Three sources: one in the base frame, one with its own frame, one with noise and a rate.
fn sources() -> Vec<Source> {
    [
        "",
        "frame = { position_m = [90.0, -3.0, 1.0], orientation_xyzw = [0.5, -0.5, 0.5, 0.5] }",
        "rate_hz = 30.0\nposition_sd_m = 0.03",
    ]
    .iter()
    .enumerate()
    .map(|(number, more)| {
        let text = format!("name = \"{number}\"\nkind = \"external\"\n{more}");
        config::parse(&text, Path::new("source.toml")).unwrap()
    })
    .collect()
}

/// Coverage of a run, so that a test can check that it is not vacuous.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    /// Cycles.
    pub(crate) cycles: u64,
    /// Entries of the percept frames.
    pub(crate) entries: u64,
    /// Number of different losses.
    pub(crate) reasons: usize,
}

/// Plays the bytes to the sensor and checks the guarantees after every cycle.
pub(crate) fn play(bytes: &[u8]) -> Seen {
    let percepts = Percepts::builtin();
    let sources = sources();
    let mut sensor = Sensor::new(&percepts, &sources, CAPACITY).unwrap();
    let mut bytes = Bytes(bytes);
    let mut now = Instant::EPOCH + Duration::from_secs(100);
    let mut sequences = [0_u64; 3];
    let mut newest = BTreeMap::new();
    let mut seen = Seen::default();
    while !bytes.0.is_empty() {
        now += Duration::from_micros(u64::from(bytes.word()) / 8);
        let before = sensor.losses();
        sensor.begin(now);
        let (mut noted, mut taken, mut entries_taken) = (0, 0, 0);
        for _source in 0..bytes.byte() % 4 {
            let source = usize::from(bytes.byte() % 3);
            let mut last = None;
            for _frame in 0..1 + bytes.byte() % 8 / 7 {
                sequences[source] += 1;
                let header = bytes.header(now, sequences[source]);
                let length = usize::from(bytes.byte()) % 16 * if bytes.byte() > 250 { 10 } else { 1 };
                let entries: Vec<Observation> = (0..length).map(|_| bytes.observation(now)).collect();
                noted += 1;
                last = sensor.record_header(source, &header).then_some((header, entries));
            }
            if let Some((header, entries)) = last {
                let frames = |sensor: &Sensor| frames_lost(&sensor.losses());
                let refused = frames(&sensor);
                sensor.take(source, &header, &entries);
                if frames(&sensor) == refused {
                    taken += 1;
                    entries_taken += u64::try_from(entries.len()).unwrap();
                }
            }
        }
        let head = sensor.end();
        let header = head.header;
        assert!(sensor.len() <= CAPACITY);
        let fits = |instant: u64| {
            let instant = Instant::from_nanos(instant);
            instant <= now + AHEAD && now.since(instant) <= BEHIND
        };
        assert!(fits(header.valid_at_ns) && header.hop_time(Hop::Observed).is_none_or(fits), "{header:?}");
        assert_eq!(header.hop_time(Hop::Observed).is_some(), taken > 0);
        // A source with left-out observations did not look.
        let is_active = head.active_sources() != SourceSet::EMPTY;
        assert!(
            if header.over_capacity == 0 { is_active == (taken > 0) } else { !is_active || taken > 1 },
            "{head:?}"
        );
        let mut latest = newest.clone();
        let mut count = 0;
        for perceived in sensor.perceived() {
            let observation = perceived.observation;
            assert!(observation.is_sound() && fits(observation.observed_at_ns), "{observation:?}");
            assert!(usize::from(observation.source) < sources.len());
            let instant = observation.observed_at_ns;
            assert!(
                newest.get(&observation.source).is_none_or(|newest| instant > *newest),
                "{observation:?}"
            );
            let latest = latest.entry(observation.source).or_insert(instant);
            *latest = instant.max(*latest);
            for value in perceived.snapshot.values() {
                assert!((0.0..=1.0).contains(&value.matching) && (0.0..=1.0).contains(&value.confidence));
                assert!(value.feature().is_some());
            }
            count += 1;
        }
        newest = latest;
        assert_eq!(count, sensor.len());
        let after = sensor.losses();
        assert!(before.iter().zip(&after).all(|(before, after)| before <= after));
        // Every loss is counted.
        assert_eq!(noted, taken + frames_lost(&after) - frames_lost(&before));
        seen.cycles += 1;
        seen.reasons = after.iter().filter(|count| **count > 0).count();
        assert_eq!(
            entries_taken,
            u64::try_from(count).unwrap() + entries_lost(&after) - entries_lost(&before)
        );
        seen.entries += u64::try_from(count).unwrap();
    }
    seen
}

fn frames_lost(losses: &[u64]) -> u64 {
    let frames = [Loss::Overtaken, Loss::Misnumbered, Loss::Unstamped, Loss::Untimely];
    frames.iter().map(|loss| losses[usize::from(loss.raw())]).sum()
}

fn entries_lost(losses: &[u64]) -> u64 {
    losses[usize::from(Loss::Future.raw())..].iter().sum()
}

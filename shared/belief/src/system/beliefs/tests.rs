use message::{NOBODY, Observation, PerceptValue, Snapshot, SourceSet};
use proptest::prelude::*;

use super::*;
use crate::storage::Memory;

/// One detection of a thing, with the delay of its step.
#[derive(Clone, Debug)]
struct Glimpse {
    at: u64,
    delay: u64,
    source: u16,
    held_by: u16,
    matching: f32,
    confidence: f32,
    place: Option<[f32; 3]>,
    turn_rad: f32,
    colour: Option<u16>,
    filled: Option<f32>,
}

fn glimpse() -> impl Strategy<Value = Glimpse> {
    let sure = || prop::sample::select(vec![0.75_f32, 0.9, 1.0]);
    let number = prop::option::weighted(0.8, prop::sample::select(vec![0.0_f32, 0.25, 1.0]));
    let when = (1..12_u64, 0..4_u64, 0..4_u16, prop::sample::select(vec![0, 1, 2, NOBODY]));
    let what = (prop::option::weighted(0.8, prop::array::uniform3(-1.0..1.0_f32)), -3.0..3.0_f32);
    (when, (sure(), sure()), what, prop::option::weighted(0.8, 0..3_u16), number).prop_map(
        |((at, delay, source, held_by), (matching, confidence), (place, turn_rad), colour, filled)| Glimpse {
            at,
            delay,
            source,
            held_by,
            matching,
            confidence,
            place,
            turn_rad,
            colour,
            filled,
        },
    )
}

/// A belief: its detections in any order, and since when its position is empty.
type Believed = (Vec<Glimpse>, Option<u64>);

fn belief() -> impl Strategy<Value = Believed> {
    (prop::collection::vec(glimpse(), 1..5), prop::option::of(1..9_u64))
}

impl Glimpse {
    fn perceived(&self, percepts: &Percepts) -> Perceived {
        let Self { matching, confidence, .. } = *self;
        let mut snapshot = Snapshot::default();
        let half_rad = self.turn_rad / 2.0;
        for (name, feature) in [
            ("position", self.place.map(Feature::Vector)),
            ("orientation", Some(Feature::Orientation([0.0, 0.0, half_rad.sin(), half_rad.cos()]))),
            ("colour", self.colour.map(Feature::Symbol)),
            ("filled", self.filled.map(Feature::Number)),
        ] {
            let number = percepts.index(name).unwrap();
            if let Some(feature) = feature {
                assert!(snapshot.push(PerceptValue::new(number, matching, confidence, feature)));
            }
        }
        let held_by = self.held_by;
        Perceived {
            observation: Observation { held_by, ..Observation::object(self.source, self.at) },
            snapshot,
        }
    }
}

/// Beliefs, and all things perceived.
struct Grown {
    beliefs: Beliefs,
    perceived: Vec<Perceived>,
    ids: u64,
}

impl Grown {
    /// Creates a belief per detection; returns the slots.
    fn create(&mut self, percepts: &Percepts, (glimpses, _): &Believed) -> Vec<u32> {
        let create = |glimpse: &Glimpse| {
            let perceived = glimpse.perceived(percepts);
            let instants = [glimpse.at, glimpse.at + glimpse.delay].map(Instant::from_nanos);
            let entry = u32::try_from(self.perceived.len()).unwrap();
            self.ids += 1;
            self.perceived.push(perceived);
            self.beliefs.create(self.ids, instants, entry, &perceived).unwrap()
        };
        glimpses.iter().map(create).collect()
    }

    /// Merges them into one belief; returns its slot.
    fn join(&mut self, slots: &[u32], (_, empty_since): &Believed) -> u32 {
        for slot in &slots[1..] {
            self.beliefs.merge(slots[0], *slot, &self.perceived);
        }
        self.beliefs.arena.memory_mut(slots[0]).unwrap().empty_since = empty_since.map(Instant::from_nanos);
        slots[0]
    }

    /// Merges one into the other; returns the contents and the memory of the remaining belief.
    fn merged(&self, kept: u32, gone: u32) -> (String, Memory) {
        let mut beliefs = self.beliefs.clone();
        beliefs.merge(kept, gone, &self.perceived);
        beliefs.commit(&self.perceived);
        assert!(!beliefs.arena.is_live(gone) && beliefs.arena.live().contains(&kept));
        (beliefs.contents(kept), *beliefs.arena.memory(kept).unwrap())
    }
}

/// The memory of a belief, computed from all its detections at once.
fn memory_of(all: &[&Glimpse], empty_since: [Option<u64>; 2]) -> Memory {
    let newest = all.iter().map(|glimpse| glimpse.at).max().unwrap();
    let [mine, others] = empty_since;
    Memory {
        id: 1,
        born_at: Instant::from_nanos(all.iter().map(|glimpse| glimpse.at).min().unwrap()),
        perceived_at: Instant::from_nanos(newest),
        updated_at: Instant::from_nanos(all.iter().map(|glimpse| glimpse.at + glimpse.delay).max().unwrap()),
        empty_since: mine.zip(others).map(|(mine, others)| Instant::from_nanos(mine.max(others))),
        observations: u64::try_from(all.len()).unwrap(),
        held_by: all
            .iter()
            .filter(|glimpse| glimpse.at == newest)
            .map(|glimpse| glimpse.held_by)
            .min()
            .unwrap(),
        confidence: 1.0,
        is_announced: false,
        seen_by: all.iter().map(|glimpse| SourceSet::of(glimpse.source)).collect(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    /// M is commutative on the whole state of a belief, the older identity survives, and at one instant the higher m·c
    /// wins.
    #[test]
    fn which_of_two_beliefs_is_merged_into_which_makes_no_difference(
        one in belief(), other in belief(), settled in 0..3_u8,
    ) {
        let percepts = Percepts::builtin();
        let beliefs = Beliefs::new(&percepts, &BeliefPlugins::default(), 16).unwrap();
        let mut grown = Grown { beliefs, perceived: Vec::new(), ids: 0 };
        // Both of this step, or the older of an earlier one, or both.
        let mut of_one = grown.create(&percepts, &one);
        if settled > 0 {
            let older = grown.join(&of_one, &one);
            grown.beliefs.commit(&grown.perceived);
            of_one = vec![older];
        }
        let of_other = grown.create(&percepts, &other);
        let (older, younger) = (grown.join(&of_one, &one), grown.join(&of_other, &other));
        if settled > 1 {
            grown.beliefs.commit(&grown.perceived);
        }
        let (contents, memory) = grown.merged(older, younger);
        prop_assert_eq!(&(contents.clone(), memory), &grown.merged(younger, older));

        let all: Vec<_> = one.0.iter().chain(&other.0).collect();
        prop_assert_eq!(memory, memory_of(&all, [one.1, other.1]));
        for name in ["colour", "filled"] {
            let percept = percepts.index(name).unwrap();
            let samples = grown.perceived.iter().filter_map(|perceived| {
                let at = Instant::from_nanos(perceived.observation.observed_at_ns);
                let value = perceived.snapshot.value(percept)?;
                let (matching, confidence) = (value.matching, value.confidence);
                Some(crate::Sample { at, matching, confidence, feature: value.feature()? })
            });
            let best = samples.max_by(|a, b| a.at.cmp(&b.at).then_with(|| a.rank(b)));
            let mut beliefs = grown.beliefs.clone();
            beliefs.merge(older, younger, &grown.perceived);
            beliefs.commit(&grown.perceived);
            let (histories, row) = beliefs.arena.histories(older).unwrap();
            prop_assert_eq!(histories.newest(row, percept), best, "{}", name);
        }
    }
}

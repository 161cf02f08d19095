mod groups;

use std::cell::Cell;
use std::sync::Arc;

use clock::Instant;
use message::{Feature, Observation, Perceived, PerceptValue, Snapshot};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::Clustering;
use crate::association::{AssociationProblem as _, cluster_naively};
use crate::percepts::{Distance, History, Measure, NoTermApplies, Percepts};
use crate::system::{Beliefs, Step};
use crate::{BeliefPlugins, Sample, Samples};

/// A new belief, with coordinates on a coarse lattice, so that ties are common.
#[derive(Clone, Debug, Default)]
struct Seen {
    place: Option<[i8; 3]>,
    /// Offset from the lattice point, in millimetres.
    beside_mm: [i8; 3],
    /// Half extents, on the same lattice.
    extents: Option<[i8; 3]>,
    /// Rotation about the vertical, in sixteenths of a full turn.
    turn: Option<i8>,
    /// By how much the norm of the quaternion exceeds one.
    norm_off: f32,
    colour: Option<u16>,
    shape: Option<u16>,
    /// In quarters.
    filled: Option<u8>,
    confidence: f32,
    /// The source.
    group: usize,
}

/// More sources than a belief has detection intervals.
const SOURCES: usize = 12;

fn seen() -> impl Strategy<Value = Seen> {
    let box_of = (
        prop::option::weighted(0.9, [-4..4_i8, -4..4_i8, 0..2_i8]),
        prop::option::weighted(0.9, [0..2_i8, 0..2_i8, 1..2_i8]),
        prop::option::weighted(0.9, -2..3_i8),
    );
    // Some symbols cannot be represented as gate keys.
    let symbol = || prop_oneof![4 => 0..2_u16, 1 => prop::sample::select(vec![0x7FFF, u16::MAX])];
    let symbol = || prop::option::weighted(0.9, symbol());
    let kind = (symbol(), symbol(), prop::option::weighted(0.9, 0..5_u8));
    let confidence = prop::sample::select(vec![0.7_f32, 0.8, 0.9]);
    (box_of, kind, confidence, 0..SOURCES).prop_map(
        |((place, extents, turn), (colour, shape, filled), confidence, group)| Seen {
            place,
            extents,
            turn,
            colour,
            shape,
            filled,
            confidence,
            group,
            ..Seen::default()
        },
    )
}

/// A thing at a lattice point.
fn alike(x: i8, group: usize) -> Seen {
    Seen { place: Some([x, 0, 0]), colour: Some(0), confidence: 0.9, group, ..Seen::default() }
}

/// An asymmetric plug-in distance that is invalid for some pairs.
struct Uphill;

impl crate::Distance for Uphill {
    fn between(&self, one: &Feature, other: &Feature) -> Option<f64> {
        let up = |a: f32, b: f32| f64::from(if a < b { 2.0 * (b - a) } else { a - b });
        match (one, other) {
            (Feature::Vector([x, y, z]), Feature::Vector([u, v, w])) if x + u < 0.35 => {
                Some(up(*x, *u) + up(*y, *v) + up(*z, *w))
            }
            (Feature::Vector(_), Feature::Vector(_)) => Some(f64::NAN),
            (Feature::Symbol(0), Feature::Symbol(0)) => Some(-1.0),
            (Feature::Symbol(one), Feature::Symbol(other)) if one == other => None,
            (Feature::Symbol(one), Feature::Symbol(other)) => {
                Some(0.02 * up(f32::from(*one), f32::from(*other)))
            }
            _ => None,
        }
    }
}

/// A plug-in history that returns the mean of the last three positions.
struct Mean;

impl crate::History for Mean {
    fn samples(&self) -> usize {
        3
    }

    fn take(&self, kept: &mut Samples<'_>, sample: &Sample) {
        if kept.as_slice().len() == self.samples() {
            kept.remove(0);
        }
        kept.push(*sample);
        kept.as_mut_slice().sort_by(|a, b| a.at.cmp(&b.at).then_with(|| a.rank(b)));
    }

    fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample> {
        let kept = &kept[..kept.partition_point(|sample| sample.at <= instant)];
        let last = kept.last()?;
        let mut mean = [0.0; 3];
        for sample in kept {
            let Feature::Vector(place) = sample.feature else { return Some(*last) };
            mean = [0, 1, 2].map(|axis| mean[axis] + place[axis]);
        }
        let count = f32::from(u16::try_from(kept.len()).unwrap());
        Some(Sample { feature: Feature::Vector(mean.map(|sum| sum / count)), ..*last })
    }
}

fn functions() -> BeliefPlugins {
    let mut functions = BeliefPlugins::default();
    functions.distances.push(("uphill".to_owned(), Arc::new(Uphill)));
    functions.histories.push(("mean".to_owned(), Arc::new(Mean)));
    functions
}

/// Makes some of the functions plug-ins.
fn make_own(percepts: &mut Percepts, which: [bool; 3]) {
    let uphill = || Measure::Plugin("uphill".to_owned());
    let [colour, place, history] = which;
    let (colour_percept, position) = (percepts.index("colour").unwrap(), percepts.index("position").unwrap());
    for term in &mut percepts.belief.distance {
        if colour && term.percept == colour_percept || place && term.percept == position {
            term.measure = uphill();
        }
    }
    if history {
        percepts.percepts[usize::from(position)].history = History::Plugin("mean".to_owned());
    }
}

/// Every measure, each with a percept that it applies to.
fn measures() -> [(&'static str, Measure); 6] {
    [
        ("colour", Measure::Differs),
        ("position", Measure::Metres),
        ("shape", Measure::Differs),
        ("orientation", Measure::AngleRad),
        ("extents", Measure::Metres),
        ("filled", Measure::Difference),
    ]
}

/// Some terms in any order, with any weights.
fn terms() -> impl Strategy<Value = Vec<(&'static str, Measure, f64)>> {
    let weight = prop_oneof![1 => Just(0.0), 2 => prop::sample::select(vec![0.5, 1.0]), 4 => 0.001..2.0_f64];
    // Sometimes only those that the gate can decide.
    let measures = prop_oneof![3 => Just(measures().to_vec()), 1 => Just(measures()[..3].to_vec())];
    let terms = measures.prop_flat_map(|all| prop::sample::subsequence(all.clone(), 0..=all.len()));
    let terms = terms.prop_shuffle();
    (terms, prop::collection::vec(weight, 6)).prop_map(|(terms, weights)| {
        terms.into_iter().zip(weights).map(|((name, measure), weight)| (name, measure, weight)).collect()
    })
}

fn percepts() -> impl Strategy<Value = Percepts> {
    let on_the_lattice = prop::sample::select(vec![0.0, 0.03, 0.08, 0.15, 0.6, 3.0]);
    let threshold = prop_oneof![on_the_lattice, 0.0..1.0_f64];
    let which = prop::array::uniform3(prop::bool::weighted(0.3));
    (terms(), threshold, any::<bool>(), any::<bool>(), any::<bool>(), which).prop_map(
        |(terms, threshold, normalised, zero, cannot_link, which)| {
            let mut percepts = remembered();
            let terms = terms.into_iter().map(|(name, measure, weight)| {
                let percept = percepts.index(name).unwrap();
                Distance { percept, measure, weight }
            });
            percepts.belief.distance = terms.collect();
            percepts.belief.threshold = threshold;
            percepts.belief.normalised = normalised;
            percepts.belief.no_term_applies =
                if zero { NoTermApplies::Zero } else { NoTermApplies::Infinite };
            percepts.belief.cannot_link_same_source_instant = cannot_link;
            make_own(&mut percepts, which);
            percepts
        },
    )
}

/// One entry of a frame observed at `at`.
fn perceived(percepts: &Percepts, at: u64, seen: &Seen) -> Perceived {
    let mut snapshot = Snapshot::default();
    let mut push = |name: &str, feature| {
        snapshot.push(PerceptValue::new(percepts.index(name).unwrap(), 1.0, seen.confidence, feature));
    };
    let on_the_lattice = |cells: [i8; 3]| Feature::Vector(cells.map(|cells| f32::from(cells) * 0.05));
    if let Some(place) = seen.place {
        let beside = |axis: usize| f32::from(place[axis]) * 0.05 + f32::from(seen.beside_mm[axis]) * 0.001;
        push("position", Feature::Vector([0, 1, 2].map(beside)));
    }
    if let Some(turn) = seen.turn {
        let half_rad = f32::from(turn) * std::f32::consts::PI / 16.0;
        let scaled = |part: f32| part * (1.0 + seen.norm_off);
        push("orientation", Feature::Orientation([0.0, 0.0, half_rad.sin(), half_rad.cos()].map(scaled)));
    }
    if let Some(extents) = seen.extents {
        push("extents", on_the_lattice(extents));
    }
    if let Some(shape) = seen.shape {
        push("shape", Feature::Symbol(shape));
    }
    if let Some(colour) = seen.colour {
        push("colour", Feature::Symbol(colour));
    }
    if let Some(filled) = seen.filled {
        push("filled", Feature::Number(f32::from(filled) * 0.25));
    }
    Perceived { observation: Observation::object(u16::try_from(seen.group).unwrap(), at), snapshot }
}

/// The built-in percepts, whose remembered positions are compared as in the paper.
fn remembered() -> Percepts {
    let mut percepts = Percepts::builtin();
    percepts.belief.tracking = None;
    percepts
}

/// Two sets of beliefs, one of which is clustered naively.
struct Twins {
    percepts: Percepts,
    reference: Beliefs,
    beliefs: Beliefs,
    clustering: Clustering,
    id: u64,
    /// Per source the instant of its last frame.
    last: [Option<u64>; SOURCES],
    /// Whether the last step was a matching.
    matched: bool,
    /// Whether the last step was merged group by group.
    grouped: bool,
}

impl Twins {
    fn new(percepts: Percepts) -> Self {
        let beliefs = Beliefs::new(&percepts, &functions(), 400).unwrap();
        Self {
            percepts,
            reference: beliefs.clone(),
            clustering: Clustering::new(beliefs.arena.slots(), beliefs.gate_radius_m()),
            beliefs,
            id: 0,
            last: [None; SOURCES],
            matched: false,
            grouped: false,
        }
    }

    /// One step of both; returns the number of merges in each.
    fn step(&mut self, at: u64, seen: &[Seen], is_clustered: bool) -> [u64; 2] {
        self.step_late(at, 0, seen, is_clustered)
    }

    /// Like [`Self::step`], with observations made earlier; the frames of a source stay in order.
    fn step_late(&mut self, at: u64, late: u64, seen: &[Seen], is_clustered: bool) -> [u64; 2] {
        let now = 10 * at;
        let before = self.last;
        let observed = before.map(|last| now.saturating_sub(late).max(last.map_or(0, |last| last + 1)));
        let perceived: Vec<_> =
            seen.iter().map(|seen| perceived(&self.percepts, observed[seen.group], seen)).collect();
        let first_new = self.id + 1;
        for (entry, perceived) in (0..).zip(&perceived) {
            self.id += 1;
            let at = [perceived.observation.observed_at_ns, now].map(Instant::from_nanos);
            for beliefs in [&mut self.reference, &mut self.beliefs] {
                beliefs.create(self.id, at, entry, perceived).unwrap();
            }
        }
        seen.iter().for_each(|seen| self.last[seen.group] = Some(observed[seen.group]));
        for beliefs in [&mut self.reference, &mut self.beliefs] {
            beliefs.set_previous_frame(|source, _| before[usize::from(source)].map(Instant::from_nanos));
        }
        let one_frame = seen.iter().all(|one| one.group == seen[0].group);
        for beliefs in [&mut self.reference, &mut self.beliefs] {
            let expected_at = Instant::from_nanos(now.saturating_sub(late));
            for index in 0..beliefs.arena.live().len() {
                beliefs.features.expect_at(beliefs.arena.live()[index], expected_at);
            }
        }
        let step = Step { beliefs: &mut self.beliefs, perceived: &[], first_new };
        step.old().iter().for_each(|&slot| self.clustering.place(&step, slot));
        let expected =
            cluster_naively(&mut Step { beliefs: &mut self.reference, perceived: &perceived, first_new });
        self.reference.commit(&perceived);
        let mut step = Step { beliefs: &mut self.beliefs, perceived: &perceived, first_new };
        let detections_cannot_link = one_frame && step.beliefs.has_cannot_link();
        let Clustering { matching, grouping, spatial_hash, .. } = &mut self.clustering.clone();
        self.matched = is_clustered && detections_cannot_link && matching.find(spatial_hash, &step);
        self.grouped = is_clustered && !detections_cannot_link && grouping.find(spatial_hash, &step);
        let merged = self.clustering.run(&mut step, is_clustered, detections_cannot_link);
        self.beliefs.commit(&perceived);
        let step = Step { beliefs: &mut self.beliefs, perceived: &[], first_new };
        step.old().iter().for_each(|&slot| self.clustering.place(&step, slot));
        [expected, merged]
    }

    /// The contents of all beliefs, bit for bit.
    fn contents(&self) -> [Vec<String>; 2] {
        [&self.reference, &self.beliefs]
            .map(|beliefs| beliefs.arena.live().iter().map(|&slot| beliefs.contents(slot)).collect())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn the_fast_clustering_equals_the_loop_of_the_paper_bit_for_bit(
        percepts in percepts(),
        frames in prop::collection::vec((prop::collection::vec(seen(), 0..24), 0..60_u64, any::<bool>()), 1..6),
        sources in prop::sample::select(vec![1, 2, 3, SOURCES]),
    ) {
        let mut twins = Twins::new(percepts);
        for (at, (frame, late, is_clustered)) in (1..).zip(frames) {
            let frame: Vec<_> =
                frame.into_iter().map(|seen| Seen { group: seen.group % sources, ..seen }).collect();
            let [expected, merged] = twins.step_late(at, late, &frame, is_clustered);
            prop_assert_eq!(merged, expected);
            let [expected, contents] = twins.contents();
            prop_assert_eq!(contents, expected);
        }
    }
}

/// Frames of a few similar things by one source each, some of them late. Beliefs are soon detected by more sources than
/// they have intervals.
fn by_turns() -> impl Strategy<Value = Vec<(Vec<Seen>, u64, bool)>> {
    let things = prop::collection::vec(([0..10_i8, 0..2_i8, 0..1_i8], 0..2_u16), 1..4);
    let frame =
        (things, 0..SOURCES, prop::sample::select(vec![0_u64, 0, 7, 80, 300]), prop::bool::weighted(0.8));
    let frame = frame.prop_map(|(things, group, late, is_clustered)| {
        let seen = things.into_iter().map(|(place, colour)| Seen {
            place: Some(place),
            colour: Some(colour),
            confidence: 0.9,
            group,
            ..Seen::default()
        });
        (seen.collect(), late, is_clustered)
    });
    prop::collection::vec(frame, 8..32)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn late_alternating_detections_are_merged_as_in_the_paper(
        frames in by_turns(),
        threshold in prop::sample::select(vec![0.06, 0.11, 0.16, 0.3]),
    ) {
        let mut percepts = remembered();
        percepts.belief.threshold = threshold;
        let mut twins = Twins::new(percepts);
        for (at, (frame, late, is_clustered)) in (1..).zip(frames) {
            let [expected, merged] = twins.step_late(at, late, &frame, is_clustered);
            prop_assert_eq!(merged, expected);
            let [expected, contents] = twins.contents();
            prop_assert_eq!(contents, expected);
        }
    }
}

#[test]
fn neighbours_are_searched_by_position_whichever_metric_term_comes_first() {
    let mut percepts = remembered();
    let percept = percepts.index("extents").unwrap();
    percepts.belief.distance.insert(0, Distance { percept, measure: Measure::Metres, weight: 1.0 });
    let mut twins = Twins::new(percepts);
    // Things of one size: by their extents all would be in each other's gate.
    let at = |x| Seen { extents: Some([1, 1, 1]), ..alike(x, 0) };
    assert_eq!(twins.step(1, &[at(0), at(20)], true), [0, 0]);
    let step = Step { beliefs: &mut twins.beliefs, perceived: &[], first_new: 3 };
    assert_eq!(step.place(1), Some([1.0, 0.0, 0.0]));
    assert_eq!(twins.step(2, &[at(0), at(20)], true), [2, 2]);
}

/// The paths of some things on the lattice, one cell per frame, and whether each is seen; all by one source.
fn wandering() -> impl Strategy<Value = Vec<Vec<Seen>>> {
    let thing = ([-8..8_i8, -8..8_i8, 0..2_i8], 0..3_u16);
    let step = ([-1..2_i8, -1..2_i8], prop::bool::weighted(0.85));
    (prop::collection::vec(thing, 1..12), 2..12_usize).prop_flat_map(move |(things, frames)| {
        let steps = prop::collection::vec(prop::collection::vec(step.clone(), things.len()), frames);
        (Just(things), steps).prop_map(|(mut things, frames)| {
            let frame = |steps: Vec<([i8; 2], bool)>| {
                let mut seen = Vec::new();
                for (([x, y, z], colour), ([along_x, along_y], is_seen)) in things.iter_mut().zip(steps) {
                    (*x, *y) = (*x + along_x, *y + along_y);
                    let (place, colour) = (Some([*x, *y, *z]), Some(*colour));
                    seen.extend(is_seen.then_some(Seen {
                        place,
                        colour,
                        confidence: 0.9,
                        ..Seen::default()
                    }));
                }
                seen
            };
            frames.into_iter().map(frame).collect()
        })
    })
}

#[test]
fn wandering_objects_of_one_source_are_matched_as_in_the_paper() {
    let (matched, looped) = (Cell::new(0), Cell::new(0));
    let threshold = prop::sample::select(vec![0.04, 0.08, 0.11, 0.15, 0.16]);
    let mut runner = TestRunner::new(ProptestConfig::with_cases(2_000));
    let outcome = runner.run(&(wandering(), threshold), |(frames, threshold)| {
        let mut percepts = remembered();
        percepts.belief.threshold = threshold;
        let mut twins = Twins::new(percepts);
        for (at, frame) in (1..).zip(frames) {
            let [expected, merged] = twins.step(at, &frame, true);
            prop_assert_eq!(merged, expected);
            let [expected, contents] = twins.contents();
            prop_assert_eq!(contents, expected);
            let which = if twins.matched { &matched } else { &looped };
            which.set(which.get() + 1);
        }
        Ok(())
    });
    outcome.unwrap();
    assert!(matched.get() > 1_000 && looped.get() > 1_000, "matched {matched:?}, looped {looped:?}");
}

/// The tracks of the beliefs are compared too: by the positions that they expect next.
#[test]
fn wandering_objects_are_matched_as_by_the_loop_over_expected_positions() {
    let matched = Cell::new(0);
    let mut runner = TestRunner::new(ProptestConfig::with_cases(2_000));
    let outcome = runner.run(&wandering(), |frames| {
        let mut percepts = Percepts::builtin();
        percepts.belief.threshold = 0.15;
        let mut twins = Twins::new(percepts);
        for (at, frame) in (1..).zip(frames) {
            // 20 frames a second.
            let [expected, merged] = twins.step(at * 5_000_000, &frame, true);
            prop_assert_eq!(merged, expected);
            let [expected, contents] = twins.contents();
            prop_assert_eq!(contents, expected);
            let places = |beliefs: &Beliefs| -> Vec<_> {
                beliefs.arena.live().iter().map(|&slot| beliefs.features.place(slot)).collect()
            };
            prop_assert_eq!(places(&twins.reference), places(&twins.beliefs));
            matched.set(matched.get() + u64::from(twins.matched));
        }
        Ok(())
    });
    outcome.unwrap();
    assert!(matched.get() > 1_000, "{matched:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn things_of_partly_unobserved_colours_are_merged_as_in_the_paper(
        frames in wandering(),
        is_coloured in prop::collection::vec(any::<bool>(), 1..40),
        threshold in prop::sample::select(vec![0.04, 0.08, 0.11, 0.15, 0.16]),
        sources in 1..3_usize,
    ) {
        let mut percepts = remembered();
        percepts.belief.threshold = threshold;
        let mut twins = Twins::new(percepts);
        let mut is_coloured = is_coloured.into_iter().cycle();
        for (at, mut frame) in (1..).zip(frames) {
            for (index, seen) in frame.iter_mut().enumerate() {
                seen.colour = seen.colour.filter(|_| is_coloured.next() == Some(true));
                seen.group = index % sources;
            }
            let [expected, merged] = twins.step(at, &frame, true);
            prop_assert_eq!(merged, expected);
            let [expected, contents] = twins.contents();
            prop_assert_eq!(contents, expected);
        }
    }
}

#[test]
fn an_object_merges_with_a_near_unconstrained_one() {
    let mut percepts = remembered();
    percepts.belief.threshold = 0.16;
    let at = |x| alike(x, 0);
    let mut twins = Twins::new(percepts.clone());
    assert_eq!([twins.step(1, &[at(0)], true), twins.step(2, &[at(4)], true)], [[0, 0]; 2]);
    // In the middle: the older of the two takes the detection, and has moved towards the other.
    assert_eq!(twins.step(3, &[at(2)], true), [2, 2]);
    assert!(!twins.matched);
    // Two things seen in one frame cannot be linked, however near they come.
    let mut twins = Twins::new(percepts);
    assert_eq!(twins.step(1, &[at(0), at(4)], true), [0, 0]);
    assert_eq!(twins.step(2, &[at(2), at(4)], true), [2, 2]);
    assert_eq!(twins.step(3, &[at(3), at(4)], true), [2, 2]);
    assert!(twins.matched);
}

#[test]
fn objects_of_a_late_frame_beyond_the_capacity_stay_separate() {
    let mut twins = Twins::new(remembered());
    for group in 0..8 {
        let at = 10 + u64::try_from(group).unwrap();
        assert_eq!(twins.step(at, &[alike(0, group)], true), [u64::from(group > 0); 2]);
    }
    // Observed before all others: the belief takes the first detection, and cannot be linked with the second.
    assert_eq!(twins.step_late(20, 150, &[alike(0, 8), alike(1, 8)], true), [1, 1]);
    let [expected, contents] = twins.contents();
    assert_eq!((contents.len(), &contents), (2, &expected));
}

#[test]
fn a_late_detection_keeps_its_cannot_links_after_a_merge() {
    let mut percepts = remembered();
    percepts.belief.threshold = 0.375;
    let mut twins = Twins::new(percepts);
    for group in 0..8 {
        twins.step(10 + u64::try_from(group).unwrap(), &[alike(0, group)], true);
    }
    assert_eq!(twins.step(27, &[alike(8, 9)], true), [0, 0], "40 cm are too far");
    // The second belief merges with the first of the two detections, which moves it 5 cm towards the first belief. So
    // these beliefs merge; the result has ten sources, of which the late one is the oldest. The other detection is near
    // it.
    assert_eq!(twins.step_late(40, 350, &[alike(6, 8), alike(11, 8)], true), [2, 2]);
    let [expected, contents] = twins.contents();
    assert_eq!((contents.len(), &contents), (2, &expected));
}

#[test]
fn equally_near_pairs_merge_by_lowest_identity() {
    let mut percepts = remembered();
    percepts.belief.threshold = 0.06;
    percepts.belief.cannot_link_same_source_instant = false;
    let mut twins = Twins::new(percepts);
    // Three in a row, 5 cm apart: the first two merge, and then are out of the third's gate.
    let row = [0, 1, 2].map(|x| alike(x, 0));
    assert_eq!(twins.step(1, &row[..2], true), [1, 1]);
    let mut twins = Twins::new(twins.percepts);
    for (at, seen) in (1..).zip(&row) {
        twins.step(at, std::slice::from_ref(seen), true);
    }
    let ids: Vec<_> =
        twins.beliefs.arena.live().iter().map(|&slot| twins.beliefs.arena.memory(slot).unwrap().id).collect();
    assert_eq!(ids, [1, 3]);
}

#[test]
fn an_invalid_distance_separates_in_any_belief_order() {
    let mut percepts = remembered();
    make_own(&mut percepts, [false, true, false]);
    percepts.belief.threshold = 0.3;
    let merged = |x: [i8; 2]| {
        let mut twins = Twins::new(percepts.clone());
        let seen = x.map(|x| alike(x, usize::from(x.unsigned_abs())));
        let [naive, fast] = twins.step(1, &seen, false);
        assert_eq!(naive, fast);
        fast
    };
    // From 0.0 to 0.1 m the distance is 0.1 or 0.2: independent of the order, and below the threshold.
    assert_eq!([merged([0, 2]), merged([2, 0])], [1, 1]);
    // From there on it returns NaN.
    assert_eq!([merged([3, 4]), merged([4, 3])], [0, 0]);
}

use ::settings::number::{Capacity, UnitInterval};
use proptest::prelude::*;

use super::*;
use crate::percepts::Percepts;

const DECAY: f64 = 0.1;

fn sample(at: u64, feature: Feature) -> Sample {
    Sample { at: Instant::from_nanos(at), matching: 1.0, confidence: 0.9, feature }
}

fn series(room: u32, when_full: WhenFull) -> settings::History {
    settings::History::Lossless { samples: Capacity::try_from(room).unwrap(), when_full }
}

fn log_timescale(room: u32) -> settings::History {
    settings::History::LogTimescale { samples: Capacity::try_from(room).unwrap() }
}

fn low_pass(share: f64) -> settings::History {
    settings::History::LowPass { alpha: UnitInterval::try_from(share).unwrap() }
}

/// Histories of one percept, with room for three beliefs.
fn histories(generator: &settings::History) -> Histories {
    histories_of([(generator, Kernel::Source)])
}

/// Histories of several percepts.
fn histories_of<'a>(percepts: impl IntoIterator<Item = (&'a settings::History, Kernel)>) -> Histories {
    let percepts: Vec<_> = percepts.into_iter().collect();
    let generators: Vec<_> = percepts.iter().map(|(history, kernel)| (*history, kernel)).collect();
    Histories::new(&generators, |name| Err(name.to_owned()), 3).unwrap()
}

/// Kernels that derive one symbol or number, and kernels that may derive several numbers.
fn kernels() -> impl Strategy<Value = Kernel> {
    let builtin = Percepts::builtin().percepts.into_iter().map(|percept| percept.kernel);
    let others = [Kernel::Source, Kernel::Plugin("own".to_owned())];
    prop::sample::select(builtin.chain(others).collect::<Vec<_>>())
}

/// The part of a feature that a percept of this kernel can derive.
fn possible(kernel: &Kernel, feature: Feature) -> Feature {
    match (kernel, feature) {
        (Kernel::Position | Kernel::Orientation | Kernel::Extents | Kernel::Plugin(_), _)
        | (_, Feature::None | Feature::Symbol(_) | Feature::Number(_)) => feature,
        (_, Feature::Vector(_) | Feature::Orientation(_)) => Feature::None,
    }
}

/// A feature that a percept of either form may derive.
fn small(number: u8) -> Feature {
    match number {
        0 => Feature::None,
        1 => Feature::Symbol(u16::MAX),
        _ => Feature::Number(-f32::from(number)),
    }
}

/// A row to which the samples were added one by one.
fn grow(histories: &mut Histories, samples: &[Sample]) -> u32 {
    let row = histories.allocate_row().unwrap();
    samples.iter().for_each(|sample| histories.take(row, 0, *sample, 0));
    row
}

/// A single history, with its storage and row.
struct History(Histories, u32);

fn grown(generator: &settings::History, samples: &[Sample]) -> History {
    let mut histories = histories(generator);
    let row = grow(&mut histories, samples);
    History(histories, row)
}

impl History {
    fn at(&self, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        self.0.at(self.1, 0, instant, decay_per_s)
    }

    fn newest(&self) -> Option<Sample> {
        self.0.newest(self.1, 0)
    }

    fn len(&self) -> usize {
        self.0.len(self.1, 0)
    }

    fn instants(&self) -> Vec<u64> {
        self.0.samples(self.1, 0).iter().map(|sample| sample.at.as_nanos()).collect()
    }
}

#[test]
fn a_history_starts_at_its_first_sample_and_decays_after_the_last() {
    for generator in [series(4, WhenFull::ForgetOldest), log_timescale(4), low_pass(0.5)] {
        let history =
            grown(&generator, &[sample(1_000, Feature::Number(1.0)), sample(2_000, Feature::Number(1.0))]);
        assert_eq!(history.at(Instant::from_nanos(999), DECAY), None);
        let last = history.at(Instant::from_nanos(2_000), DECAY).unwrap();
        assert_eq!(last, sample(2_000, Feature::Number(1.0)));
        let later = history.at(Instant::from_nanos(5_000_002_000), DECAY).unwrap();
        assert!((later.confidence - 0.9 * (-0.5_f32).exp()).abs() < 1e-6);
        assert_eq!(later.at, last.at);
    }
}

#[test]
fn a_full_lossless_history_forgets_as_configured() {
    let samples: Vec<_> = [10, 20, 21, 40, 80].map(|at| sample(at, Feature::None)).into();
    let instants = |when_full| grown(&series(4, when_full), &samples).instants();
    assert_eq!(instants(WhenFull::ForgetOldest), [20, 21, 40, 80]);
    // Without 20 the gap is from 10 to 21, the shortest.
    assert_eq!(instants(WhenFull::Thin), [10, 21, 40, 80]);
}

#[test]
fn of_simultaneous_samples_the_higher_match_times_confidence_is_kept() {
    let weak = Sample { confidence: 0.6, ..sample(9, Feature::Number(5.0)) };
    let strong = sample(9, Feature::Number(1.0));
    let first = sample(5, Feature::Number(0.0));
    for generator in [series(8, WhenFull::ForgetOldest), log_timescale(8), low_pass(0.5)] {
        let alone = grown(&generator, &[first, strong]);
        for samples in [[first, weak, strong], [first, strong, weak]] {
            let history = grown(&generator, &samples);
            assert_eq!(history.newest(), alone.newest(), "{generator:?}");
        }
    }
}

#[test]
fn an_orientation_is_filtered_on_the_sphere_along_the_shorter_way() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The same rotation about z as two quaternions of opposite sign.
    let quarter = Feature::Orientation([0.0, 0.0, -half, -half]);
    let none = Feature::Orientation([0.0, 0.0, 0.0, 1.0]);
    let history = grown(&low_pass(0.5), &[sample(1, none), sample(2, quarter)]);
    let Some(Feature::Orientation([_, _, z, w])) = history.newest().map(|sample| sample.feature) else {
        panic!("an orientation is remembered")
    };
    let eighth = std::f32::consts::FRAC_PI_8;
    let (sin, cos) = (eighth.sin(), eighth.cos());
    assert!((z.abs() - sin).abs() < 1e-6 && (w.abs() - cos).abs() < 1e-6 && z * w > 0.0, "{z} {w}");
}

#[test]
fn a_static_pose_is_remembered_exactly_and_turns_have_norm_one() {
    let filtered = |all: &[[f32; 4]]| {
        let samples: Vec<_> =
            (1..).zip(all).map(|(at, xyzw)| sample(at, Feature::Orientation(*xyzw))).collect();
        let history = grown(&low_pass(0.5), &samples);
        let Some(Feature::Orientation(xyzw)) = history.newest().map(|sample| sample.feature) else {
            panic!("an orientation is remembered")
        };
        xyzw
    };
    let excess = |xyzw: [f32; 4]| xyzw.iter().map(|part| f64::from(*part).powi(2)).sum::<f64>() - 1.0;
    let turned = [0.1_f32, -0.5, 0.5, 0.7];
    assert_eq!(filtered(&[turned; 3]).map(f32::to_bits), turned.map(f32::to_bits));
    // A source may be off by 1 %.
    let off = excess(filtered(&[turned.map(|part| part * 0.996); 3]));
    assert!(off.abs() < 3e-7, "{off}");
    for step in 0..200_u8 {
        let (sin, cos) = (f32::from(step) * 0.001).sin_cos();
        let off = excess(filtered(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.6 * sin, 0.8 * sin, cos]]));
        assert!(off.abs() < 3e-7, "{step} {off}");
    }
}

#[test]
fn a_log_timescale_of_64_holds_half_a_day_at_20_hz() {
    let period = 50_000_000;
    let mut history = grown(&log_timescale(64), &[]);
    let mut max = 0;
    for frame in 1..=12 * 3_600 * 20 {
        history.0.take(history.1, 0, sample(frame * period, Feature::None), 0);
        max = max.max(history.len());
    }
    assert_eq!(history.at(Instant::from_nanos(period), DECAY).unwrap().at.as_nanos(), period);
    assert!(max <= 50, "there is room for what comes in months: {max}");
}

/// Otherwise all beliefs of a table that was seen at once would be thinned in the same step.
#[test]
fn series_that_began_together_are_thinned_in_different_steps() {
    let thinned = |phase| {
        let mut history = grown(&log_timescale(64), &[]);
        let mut before = 0;
        let steps = (1..=320).filter(|step| {
            history.0.take(history.1, 0, sample(step * 5_000_000, Feature::None), phase);
            std::mem::replace(&mut before, history.len()) >= history.len()
        });
        steps.collect::<Vec<_>>()
    };
    for step in 17..=320 {
        assert_eq!((0..16).filter(|phase| thinned(*phase).contains(&step)).count(), 1, "in step {step}");
    }
}

/// Two months at 200 Hz: `cargo test --release -p leo-belief -- --ignored a_billion`.
#[test]
#[ignore = "half a minute when optimised"]
fn a_billion_samples_pass_through_a_log_timescale_in_constant_memory() {
    let period = 5_000_000;
    let mut history = grown(&log_timescale(64), &[]);
    for frame in 1..=1_000_000_000 {
        history.0.take(history.1, 0, sample(frame * period, Feature::None), 0);
        if frame % 10_000_019 == 0 {
            let now = Instant::from_nanos(frame * period);
            for octave in 0..frame.ilog2() {
                let age = period << octave;
                let answered = history.at(Instant::from_nanos(frame * period - age), 0.0).unwrap();
                assert!(clock::nanos(now.since(answered.at)) <= 2 * age);
            }
        }
    }
    assert_eq!(history.at(Instant::from_nanos(period), DECAY).unwrap().at.as_nanos(), period);
    assert!(history.instants().len() <= 64);
}

fn samples(max: usize) -> impl Strategy<Value = Vec<Sample>> {
    let x = || (0..4_u8).prop_map(f32::from);
    // Histories of some percepts do not store vectors.
    let feature = prop_oneof![
        5 => x().prop_map(Feature::Number),
        1 => x().prop_map(|x| Feature::Vector([x; 3])),
    ];
    let one = (1..60_u64, feature, prop::sample::select(vec![0.6_f32, 0.8]));
    let one = one.prop_map(|(at, feature, confidence)| Sample { confidence, ..sample(at, feature) });
    prop::collection::vec(one, 0..max)
}

fn generators() -> impl Strategy<Value = settings::History> {
    prop::sample::select(vec![
        series(1, WhenFull::ForgetOldest),
        series(5, WhenFull::ForgetOldest),
        series(1, WhenFull::Thin),
        series(2, WhenFull::Thin),
        series(5, WhenFull::Thin),
        log_timescale(1),
        log_timescale(5),
        log_timescale(64),
        low_pass(0.3),
        low_pass(1.0),
    ])
}

/// Interleaved series, and series that are not.
fn alike() -> impl Strategy<Value = settings::History> {
    let ring = series(5, WhenFull::ForgetOldest);
    let others = [series(5, WhenFull::Thin), low_pass(0.3)];
    prop_oneof![
        3 => Just(log_timescale(5)),
        6 => Just(log_timescale(64)),
        3 => Just(ring),
        1 => prop::sample::select(others.to_vec()),
    ]
}

/// Features of one kind: numbers, positions, rotations about any axis, symbols.
fn features() -> impl Strategy<Value = Vec<Feature>> {
    let of = || 1..16_usize;
    let turn = (prop::array::uniform3(-1.0..1.0_f32), -6.0..6.0_f32).prop_map(|([x, y, z], angle_rad)| {
        let norm = (x * x + y * y + z * z).sqrt().max(0.1);
        let (sin, cos) = (angle_rad / 2.0).sin_cos();
        let (x, y, z) = (sin * x / norm, sin * y / norm, sin * z / norm);
        let whole = (x * x + y * y + z * z + cos * cos).sqrt();
        Feature::Orientation([x, y, z, cos].map(|part| part / whole))
    });
    // Unchanged orientations, or small rotations.
    let still =
        prop::sample::select(vec![0.0, 0.0, 0.0, 1e-4, 0.01, 0.06, 0.07, 0.3_f32]).prop_map(|angle_rad| {
            let (sin, cos) = (0.4 + angle_rad / 2.0).sin_cos();
            Feature::Orientation([0.0, 0.6 * sin, 0.8 * sin, cos])
        });
    prop_oneof![
        prop::collection::vec(still, of()),
        prop::collection::vec((-9.0..9.0_f32).prop_map(Feature::Number), of()),
        prop::collection::vec(prop::array::uniform3(-9.0..9.0_f32).prop_map(Feature::Vector), of()),
        prop::collection::vec(turn, of()),
        prop::collection::vec((0..5_u16).prop_map(Feature::Symbol), of()),
    ]
}

/// a·x + (1 − a)·y, written literally; orientations on the unit sphere, along the shorter arc.
fn recurrence(x: Feature, share: f64, y: Feature) -> Feature {
    let mixed =
        |x: f32, y: f32| quantity::number::single(share * f64::from(x) + (1.0 - share) * f64::from(y));
    match (x, y) {
        (Feature::Number(x), Feature::Number(y)) => Feature::Number(mixed(x, y)),
        (Feature::Vector(x), Feature::Vector(y)) => {
            Feature::Vector([0, 1, 2].map(|axis| mixed(x[axis], y[axis])))
        }
        (Feature::Orientation(x), Feature::Orientation(y)) => {
            let dot: f32 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
            let nearer = if dot < 0.0 { y.map(|part| -part) } else { y };
            let mean = [0, 1, 2, 3].map(|part| mixed(x[part], nearer[part]));
            let norm = mean.iter().map(|part| part * part).sum::<f32>().sqrt();
            Feature::Orientation(mean.map(|part| part / norm))
        }
        (x, _) => x,
    }
}

/// Checks a query at a `share` of the time since the first sample. The answer is a sample at most twice as old as
/// asked, or the same as if all samples had been kept.
fn keeps_octaves(
    histories: &Histories,
    row: u32,
    drawn: &[Sample],
    (wait, share): (u64, f64),
) -> Result<(), TestCaseError> {
    let (first, now) = (drawn[0].at, drawn[drawn.len() - 1].at.as_nanos() + wait);
    let age =
        quantity::number::floor_i64(share * quantity::number::float(now - first.as_nanos())).cast_unsigned();
    let asked = Instant::from_nanos(now - age);
    let exact = drawn.iter().rev().find(|sample| sample.at <= asked).unwrap();
    let answered = histories.at(row, 0, asked, 0.0).unwrap();
    prop_assert!(answered.at <= asked);
    let answered_age = now - answered.at.as_nanos();
    prop_assert!(answered.at == exact.at || answered_age <= 2 * age, "{answered_age} for {age}");
    Ok(())
}

/// Whether two features are equal; orientations up to rounding and up to the sign of the quaternion.
fn agree(one: Feature, other: Feature) -> bool {
    match (one, other) {
        (Feature::Orientation(a), Feature::Orientation(b)) => {
            let dot: f32 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            let is_unit = |q: [f32; 4]| (q.iter().map(|part| part * part).sum::<f32>() - 1.0).abs() < 1e-5;
            is_unit(a) && is_unit(b) && dot.abs() > 1.0 - 1e-5
        }
        (one, other) => one.total_cmp(&other).is_eq(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    /// y = a·x + (1 − a)·y over the best sample of each instant, in order of time; symbols are not filtered.
    #[test]
    fn the_low_pass_equals_its_recurrence_relation(
        drawn in features(), share in 0.01..=1.0_f64,
        when in prop::collection::vec((0..3_u64, prop::sample::select(vec![0.6_f32, 0.8])), 16),
    ) {
        let mut at = 0;
        let mut samples: Vec<Sample> = Vec::new();
        for (feature, (gap, confidence)) in drawn.into_iter().zip(when) {
            at += if samples.is_empty() { 1 } else { gap };
            samples.push(Sample { confidence, ..sample(at, feature) });
        }
        let history = grown(&low_pass(share), &samples);
        let mut expected: Option<Sample> = None;
        for instant in samples.chunk_by(|a, b| a.at == b.at) {
            let best = *instant.iter().max_by(|a, b| a.rank(b)).unwrap();
            let feature = expected.map_or(best.feature, |y| recurrence(best.feature, share, y.feature));
            expected = Some(Sample { feature, ..best });
        }
        let expected = expected.unwrap();
        let newest = history.newest().unwrap();
        prop_assert_eq!(Sample { feature: expected.feature, ..newest }, expected);
        prop_assert!(agree(newest.feature, expected.feature), "{:?} {:?}", newest.feature, expected.feature);
    }

    /// With interleaved cells of either format, whatever each series has stored.
    #[test]
    fn several_percepts_are_remembered_as_each_would_be_alone(
        percepts in prop::collection::vec((alike(), kernels()), 1..8),
        snapshots in prop::collection::vec(
            (0..9_u64, prop::collection::vec((prop::bool::weighted(0.95), 0..4_u8), 8)), 1..120,
        ),
        are_sound in prop::bool::ANY, block_slot in 0..3_usize, phase in 0..64_u64,
    ) {
        let mut together = histories_of(percepts.iter().map(|(generator, kernel)| (generator, kernel.clone())));
        let mut alone: Vec<_> = percepts.iter().map(|(generator, _)| histories(generator)).collect();
        let row = |histories: &mut Histories| {
            (0..=block_slot).map(|_| histories.allocate_row().unwrap()).last().unwrap()
        };
        let of_all = row(&mut together);
        let rows: Vec<_> = alone.iter_mut().map(row).collect();
        let mut at = 10;
        let mut refused = 0;
        for (gap, seen) in snapshots {
            // Occasionally at the same instant, or at an earlier one.
            at = (at + gap).saturating_sub(1);
            let mut values = Vec::new();
            for ((percept, (is_seen, x)), _) in (0..).zip(seen).zip(&percepts) {
                let is_sound = are_sound || x > 0;
                let confidence = if is_sound { 0.5 + 0.1 * f32::from(x) } else { f32::NAN };
                if is_seen {
                    values.push(PerceptValue::new(percept, 1.0, confidence, small(x)));
                    refused += u64::from(!is_sound);
                    let one = Sample { confidence, ..sample(at, small(x)) };
                    if is_sound {
                        alone[usize::from(percept)].take(rows[usize::from(percept)], 0, one, phase);
                    }
                }
            }
            refused -= together.add_snapshot(of_all, &values, are_sound, Instant::from_nanos(at), phase);
        }
        let alone: Vec<_> = alone.iter().zip(rows).map(|(alone, row)| alone.contents(row)).collect();
        prop_assert_eq!(together.contents(of_all), alone.join("\n"));
        prop_assert_eq!(refused, 0);
    }

    /// A feature that a percept cannot derive is not stored, and the arena's prediction agrees.
    #[test]
    fn a_stored_feature_equals_its_prediction(
        generator in generators(), kernel in kernels(), first in features(), second in features(),
    ) {
        let mut histories = histories_of([(&generator, kernel.clone())]);
        let row = histories.allocate_row().unwrap();
        let is_low_pass = matches!(generator, settings::History::LowPass { .. });
        let mut predictable = None;
        for (at, feature) in (1..).zip(first.into_iter().chain(second)) {
            // A negative zero would collide with the bits of the kind.
            let taken = Sample { confidence: -0.0, matching: -0.0, ..sample(at, feature) };
            histories.predict_feature(0, &mut predictable, &PerceptValue::new(0, -0.0, -0.0, feature));
            histories.take(row, 0, taken, 0);
            let newest = histories.newest(row, 0).unwrap();
            prop_assert_eq!(Some(newest.feature), predictable);
            if !is_low_pass {
                prop_assert_eq!(newest, Sample { feature: possible(&kernel, feature), ..taken });
            }
            prop_assert_eq!(histories.samples(row, 0).last().copied(), Some(newest));
        }
    }

    #[test]
    fn merging_is_commutative(
        generator in generators(), kernel in kernels(), a in samples(12), b in samples(12),
    ) {
        let merged = |first: &[Sample], second: &[Sample]| {
            let mut histories = histories_of([(&generator, kernel.clone())]);
            let (kept, gone) = (grow(&mut histories, first), grow(&mut histories, second));
            histories.merge(kept, gone, 0);
            histories.contents(kept)
        };
        prop_assert_eq!(merged(&a, &b), merged(&b, &a));
    }

    #[test]
    fn a_sample_taken_is_the_history_of_that_sample_merged(
        generator in generators(), kernel in kernels(), grown in samples(40), one in samples(12),
    ) {
        let mut histories = histories_of([(&generator, kernel)]);
        let row = grow(&mut histories, &grown);
        let other = grow(&mut histories, &grown);
        for sample in one {
            histories.take(row, 0, sample, 0);
            let single = grow(&mut histories, &[sample]);
            histories.merge(other, single, 0);
            histories.free_row(single);
        }
        prop_assert_eq!(histories.contents(row), histories.contents(other));
    }

    #[test]
    fn a_lossless_history_is_exact_in_any_sample_order(
        drawn in samples(30), instant in 0..70_u64,
    ) {
        let mut histories = histories_of([(&series(64, WhenFull::ForgetOldest), Kernel::Position)]);
        let row = grow(&mut histories, &drawn);
        let instant = Instant::from_nanos(instant);
        let expected = drawn
            .iter()
            .filter(|sample| sample.at <= instant)
            .max_by(|a, b| a.at.cmp(&b.at).then_with(|| a.rank(b)));
        prop_assert_eq!(histories.at(row, 0, instant, 0.0), expected.copied());
    }

    #[test]
    fn a_log_timescale_answers_any_age_within_a_factor_of_two(
        // With the smaller capacity the series fills up before a thinning pass is due.
        (room, gaps) in prop_oneof![
            prop::collection::vec(1..1_000_u64, 1..400).prop_map(|gaps| (48, gaps)),
            prop::collection::vec(500..1_000_u64, 1..400).prop_map(|gaps| (24, gaps)),
        ],
        wait in 0..5_000_u64, share in 0.0..=1.0_f64, phase in 0..16_u64,
    ) {
        let mut at = 0;
        let drawn: Vec<_> = gaps.iter().map(|gap| { at += gap; sample(at, Feature::None) }).collect();
        let mut history = grown(&log_timescale(room), &[]);
        drawn.iter().for_each(|sample| history.0.take(history.1, 0, *sample, phase));
        keeps_octaves(&history.0, history.1, &drawn, (wait, share))?;
    }

    /// Like the samples of several sources, some of which are slow, and of two merged beliefs.
    #[test]
    fn a_log_timescale_is_accurate_in_any_sample_order_and_after_merges(
        came in prop::collection::vec((1..1_000_u64, 0..6_usize, prop::bool::weighted(0.3)), 1..400),
        wait in 0..5_000_u64, share in 0.0..=1.0_f64, phase in 0..16_u64,
    ) {
        let mut at = 0;
        let drawn: Vec<_> =
            came.iter().map(|(gap, ..)| { at += gap; sample(at, Feature::None) }).collect();
        // Each is delayed by a number of samples.
        let mut order: Vec<usize> = (0..drawn.len()).collect();
        order.sort_by_key(|index| index + came[*index].1);
        let mut histories = histories(&log_timescale(64));
        let rows = [(); 2].map(|()| histories.allocate_row().unwrap());
        for index in order {
            histories.take(rows[usize::from(came[index].2)], 0, drawn[index], phase);
        }
        histories.merge(rows[0], rows[1], phase);
        keeps_octaves(&histories, rows[0], &drawn, (wait, share))?;
    }

    #[test]
    fn no_history_exceeds_its_capacity(generator in generators(), drawn in samples(40)) {
        let instants = grown(&generator, &drawn).instants();
        let room = match generator {
            settings::History::Lossless { samples, .. } | settings::History::LogTimescale { samples } => samples.get(),
            settings::History::LowPass { .. } | settings::History::Plugin(_) => 1,
        };
        prop_assert!(instants.len() <= room);
        prop_assert!(instants.is_sorted_by(|a, b| a < b));
    }
}

//! Cost of a step of the belief systems per frame: `cargo bench -p belief-process`. For selected numbers of things:
//! `cargo bench -p belief-process -- 64 1000`.
//!
//! Things are tracked at 200 Hz. Nine of ten stand on a grid of 11 cm with a noise of a few millimetres. The tenth
//! moves back and forth along a lane between them at 0.2 to 1 m/s. At any time one in a hundred of the standing things
//! is gone for 800 ms and culled, and others appear at free places. After every frame the benchmark checks the beliefs.
//! Each thing must be exactly one belief, from its first observation until 600 ms after the last one. There must be no
//! other belief.
//!
//! The first table is for one source that sees all things. It has the cost for the robot alone, and for the robot and a
//! partner that sees all things. Up to 1,000 things there are three passes over the same frames. Further columns are:
//!
//! - the cost of a frame itself, which is the minimum over the passes;
//! - the noise of the machine: a counting loop about as long as the step at p50, run as often;
//! - the cost of reading the beliefs of both perspectives for the belief buffers, and of comparing them;
//! - the clustering of one frame alone, as the best of five runs: this implementation, the paper's loop, and
//!   agglomerative clustering by an independent library (average linkage) over the same points, including its
//!   distances. Sizes that would take more than a minute are omitted.
//!
//! The second table is for two sources with a frame each in every step; the second source sees every fifth thing. Then
//! the association is decided by grouping instead of matching. The whole benchmark takes about eight minutes and prints
//! its duration at the end. Other load on the machine affects the figures, most those of many things.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::hint::black_box;

use belief::percepts::Percepts;
use belief::{AssociationProblem, Clustering, GateKeys, cluster_naively};
use belief_process::{Believer, Divergences};
use clock::{Duration, Instant};
use geometry::{Base, Eye, Pose, Position};
use message::{Header, Hop, Observation, ObservationKind, Perceived, PerceptHead, SourceSet, State};
use perception::{Frame, Perception};
use perspective::settings::{Angle, Perspective};
use quantity::number::{float, float_of_count, floor_usize, single};

const SIZES: [usize; 8] = [16, 64, 256, 1_000, 3_000, 10_000, 30_000, 100_000];
/// The slope of the cost is computed from this number of things on.
const LARGE: usize = 1_000;
/// The naive loop compares all pairs after each merge: more things than this take minutes.
const MAX_NAIVE_SIZE: usize = 256;
/// The library stores the distances of all pairs.
const MAX_LIBRARY_SIZE: usize = 3_000;
/// Frames until every history is full and the memory is warm.
const WARM_UP_FRAMES: usize = 80;

/// Passes over the same frames, for at most `MAX_PASSES_SIZE` things.
const PASSES: usize = 3;
const MAX_PASSES_SIZE: usize = 1_000;

/// Minimum number of measured frames.
const MIN_MEASURED_FRAMES: usize = 200;
const PERIOD: Duration = Duration::from_millis(5);
/// Frames for which a thing is gone: 800 ms.
const GONE_FRAMES: usize = 160;
/// Frames after which an unseen thing is still a belief: 600 ms.
const REMEMBERED_FRAMES: usize = 120;
/// Of this many places, no two of which are neighbours, one is empty. Such places are a fourth of all. So a new thing
/// is not near one that has just gone, and cannot be associated with its belief.
const COHORTS: usize = 25;
/// One of this many things moves.
const MOVING_PERIOD: usize = 10;
/// Between two neighbours.
const PITCH_M: f64 = 0.11;
/// Additional gap between the rows on both sides of a lane: a moving thing is farther from them than the threshold.
const LANE_M: f64 = 0.24;
/// Distance that a moving thing covers before it turns.
const TRAVEL_M: f64 = 0.55;

/// Places in a row.
fn side(count: usize) -> usize {
    floor_usize(float_of_count(count).sqrt().ceil())
}

/// Row and column of a standing thing.
fn grid_cell(count: usize, index: usize) -> [usize; 2] {
    let standing = index - index / MOVING_PERIOD;
    [standing / side(count), standing % side(count)]
}

fn is_moving(index: usize) -> bool {
    index % MOVING_PERIOD == MOVING_PERIOD - 1
}

/// Position of a thing in a frame.
fn place(count: usize, index: usize, frame: usize) -> [f32; 3] {
    let along = |cells: usize| float_of_count(cells) * PITCH_M;
    let row_m = |row: usize| along(row) + float_of_count(row / (MOVING_PERIOD - 1)) * LANE_M;
    let (x, y) = if is_moving(index) {
        let (lane, slot) = (index / MOVING_PERIOD / side(count), index / MOVING_PERIOD % side(count));
        let speed_m_s = 0.2 + 0.1 * float_of_count(lane % 9);
        let gone_m = speed_m_s * PERIOD.as_secs_f64() * float_of_count(frame) % (2.0 * TRAVEL_M);
        // In the middle between the rows on both sides of the lane.
        let x = row_m(lane * (MOVING_PERIOD - 1) + MOVING_PERIOD - 2) + (PITCH_M + LANE_M) / 2.0;
        (x, along(slot) + gone_m.min(2.0 * TRAVEL_M - gone_m))
    } else {
        let [row, column] = grid_cell(count, index);
        (row_m(row), along(column))
    };
    let wobble = float_of_count((frame * 7 + index * 13) % 11) * 0.0005;
    [x + wobble, y - wobble, 0.03].map(single)
}

/// Number of frames, including this one, for which a thing has not been seen; `None` if it is seen.
fn gone_for(count: usize, index: usize, frame: usize) -> Option<usize> {
    let [row, column] = grid_cell(count, index);
    if is_moving(index) || row % 2 > 0 || column % 2 > 0 {
        return None;
    }
    let number = row / 2 * side(count).div_ceil(2) + column / 2;
    let cohorts = COHORTS.min(count / 4).max(2);
    let since = (frame + number % cohorts * GONE_FRAMES + number / cohorts * 37 % GONE_FRAMES)
        % (cohorts * GONE_FRAMES);
    (since < GONE_FRAMES).then_some(since + 1)
}

/// Expected number of beliefs.
fn believed(count: usize, frame: usize) -> usize {
    let is_believed = |index: &usize| {
        gone_for(count, *index, frame).is_none_or(|gone_for| gone_for <= REMEMBERED_FRAMES.min(frame))
    };
    (0..count).filter(is_believed).count()
}

/// The observations of one source in a frame, and of the partner, whom the first source sees.
fn observations(count: usize, frame: usize, source: u16, at: Instant) -> impl Iterator<Item = Observation> {
    let side_m = float_of_count(count).sqrt() * PITCH_M;
    let eye = Pose::<Base, Eye>::looking(
        &Position::new(-side_m - 1.0, side_m / 2.0, 2.0 * side_m + 1.0),
        &Position::new(side_m / 2.0, side_m / 2.0, 0.0),
    );
    let person = Observation {
        kind: ObservationKind::Person.raw(),
        partner: 1,
        position_m: eye.position_m().map(single),
        orientation_xyzw: eye.orientation_xyzw().map(single),
        ..Observation::object(source, at.as_nanos())
    };
    let sees = move |index: &usize| source == 0 || index.is_multiple_of(5);
    let seen = (0..count).filter(sees).filter(move |index| gone_for(count, *index, frame).is_none());
    let seen = seen.map(move |index| {
        let mut thing = Observation::object(source, at.as_nanos());
        thing.confidence = 0.9;
        thing.position_m = place(count, index, frame);
        thing.orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        thing.half_extents_m = [0.03; 3];
        thing.shape = [0.0; 4];
        thing.colour_rgb = if index.is_multiple_of(3) { [0.8, 0.05, 0.05] } else { [0.05, 0.55, 0.1] };
        thing.set_state(State::Filled, 0.0);
        thing
    });
    (source == 0).then_some(person).into_iter().chain(seen)
}

/// Nanoseconds of each frame, in order: of the step, of reading the beliefs, and of comparing them.
fn track(count: usize, partners: u32, sources: u16) -> [Vec<u64>; 3] {
    let percepts = Percepts::builtin();
    let perception = Perception::new(&percepts).expect("the built-in percepts need no program");
    let mut config = Perspective::builtin();
    config.sight.range_m = 1e4.try_into().expect("a range");
    config.sight.cone_half_angle_deg = Angle::try_from(89.0).expect("an angle");
    // Capacity for the observations of one thing by several sources in one step.
    let capacity = count * usize::from(sources) + 1;
    let mut believer =
        Believer::new(&percepts, &config, partners, 1, capacity).expect("the capacity is in range");
    let frames = WARM_UP_FRAMES + (1_000_000 / count).clamp(MIN_MEASURED_FRAMES, 4_000);
    let mut entries = Vec::with_capacity(capacity);
    let mut divergences = Divergences::new(&percepts, &believer, capacity);
    let mut costs = [(); 3].map(|()| Vec::with_capacity(frames));
    let mut at = Instant::from_nanos(1_000_000_000);
    // Per perspective, the number of beliefs that were created and remained, and the number culled.
    let turnover = |believer: &Believer| -> Vec<[u64; 2]> {
        let heads = (0..believer.perspectives()).map(|perspective| believer.head(perspective));
        heads.map(|head| [head.created - head.merged, head.culled]).collect()
    };
    let mut warm = Vec::new();
    for frame in 0..frames {
        if frame == WARM_UP_FRAMES {
            // As the process does before it reports that it is ready.
            let _bytes = realtime::use_huge_pages();
            warm = turnover(&believer);
        }
        at += PERIOD;
        entries.clear();
        let seen = (0..sources).flat_map(|source| observations(count, frame, source, at));
        entries.extend(seen.map(|observation| {
            let snapshot = perception.perceive(&observation, &Frame { agent: 0 });
            Perceived { observation, snapshot }
        }));
        let mut header = Header::at(at.as_nanos());
        header.pass(Hop::Observed, at.as_nanos());
        let head = PerceptHead::new(header, (0..sources).map(SourceSet::of).collect());
        let started = clock::now();
        believer.step(at, &head, &entries);
        let stepped = clock::now();
        divergences.read(&believer);
        let read = clock::now();
        divergences.compare();
        let spans = [stepped.since(started), read.since(stepped), clock::now().since(read)];
        for (costs, span) in costs.iter_mut().zip(spans) {
            costs.push(clock::nanos(span));
        }
        assert!(divergences.head(1).agreed > 0 || partners == 0 || frame < WARM_UP_FRAMES, "equal beliefs");
        let expected = believed(count, frame);
        for perspective in 0..believer.perspectives() {
            assert_eq!(believer.len(perspective), expected, "each thing is one belief, in frame {frame}");
        }
    }
    for (warm, end) in warm.iter().zip(turnover(&believer)) {
        let [came, culled] = [0, 1].map(|which: usize| end.get(which) > warm.get(which));
        assert!(came && culled, "beliefs were created or culled during the measurement");
    }
    costs.map(|mut costs| {
        costs.drain(..WARM_UP_FRAMES);
        costs
    })
}

/// The minimum of each frame over passes over the same frames: the cost of the frame itself. An interrupt does not hit
/// the same frame in every pass.
fn minimum_per_frame(passes: &[Vec<u64>]) -> Vec<u64> {
    let frames = passes.iter().map(Vec::len).min().unwrap_or(0);
    (0..frames).filter_map(|frame| passes.iter().filter_map(|pass| pass.get(frame)).min().copied()).collect()
}

/// Nanoseconds of a counting loop, run `times` times, sorted: the noise that the machine adds to undisturbed work of
/// that length.
fn machine_noise(length_us: f64, times: usize) -> Vec<u64> {
    let count = |highest: usize| {
        let started = clock::now();
        for number in 0..highest {
            black_box(number);
        }
        clock::nanos(clock::now().since(started))
    };
    const TRIAL: usize = 100_000;
    let shortest_ns = (0..20).map(|_| count(TRIAL)).min().map_or(1.0, float);
    let highest = floor_usize(float_of_count(TRIAL) * length_us * 1e3 / shortest_ns);
    let mut costs: Vec<_> = (0..times).map(|_| count(highest)).collect();
    costs.sort_unstable();
    costs
}

/// The points of a frame and of an earlier one: positions with a colour; a merge takes the midpoint.
#[derive(Clone)]
struct Points {
    places: Vec<[f32; 3]>,
    colours: Vec<u16>,
    old: Vec<u32>,
    fresh: Vec<u32>,
    is_live: Vec<bool>,
    versions: Vec<u32>,
    /// Members that merged with a point of this frame.
    has_detection: Vec<bool>,
}

const THRESHOLD_M: f64 = 0.15;

impl Points {
    fn new(count: usize) -> Self {
        let all = || [0, 5].into_iter().flat_map(|frame| (0..count).map(move |index| (index, frame)));
        let slots = |from: usize| (from..from + count).filter_map(|slot| u32::try_from(slot).ok());
        Self {
            places: all().map(|(index, frame)| place(count, index, frame)).collect(),
            colours: all().map(|(index, _)| u16::from(index.is_multiple_of(3))).collect(),
            old: slots(0).collect(),
            fresh: slots(count).collect(),
            is_live: vec![true; 2 * count],
            versions: vec![0; 2 * count],
            has_detection: (0..2 * count).map(|slot| slot >= count).collect(),
        }
    }

    fn of<T: Copy + Default>(entries: &[T], slot: u32) -> T {
        entries.get(slot as usize).copied().unwrap_or_default()
    }

    fn span(&self, a: u32, b: u32) -> f64 {
        let (a, b) = (Self::of(&self.places, a), Self::of(&self.places, b));
        a.iter().zip(&b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum::<f64>().sqrt()
    }
}

impl AssociationProblem for Points {
    fn old(&self) -> &[u32] {
        &self.old
    }

    fn fresh(&self) -> &[u32] {
        &self.fresh
    }

    fn is_live(&self, slot: u32) -> bool {
        Self::of(&self.is_live, slot)
    }

    fn id(&self, slot: u32) -> u64 {
        u64::from(slot)
    }

    fn version(&self, slot: u32) -> u32 {
        Self::of(&self.versions, slot)
    }

    fn place(&self, slot: u32) -> Option<[f32; 3]> {
        Some(Self::of(&self.places, slot))
    }

    fn gate_keys(&self, slot: u32) -> GateKeys {
        let mut gate_keys = GateKeys::NONE;
        gate_keys.set(0, Self::of(&self.colours, slot));
        gate_keys
    }

    fn distance(&self, a: u32, b: u32) -> Option<f64> {
        let both_taken = Self::of(&self.has_detection, a) && Self::of(&self.has_detection, b);
        let alike = Self::of(&self.colours, a) == Self::of(&self.colours, b);
        let span = self.span(a, b);
        (alike && !both_taken && span < THRESHOLD_M).then_some(span)
    }

    fn gate_radius_m(&self, distance: f64) -> f64 {
        distance
    }

    fn is_convex_merge(&self, _old: u32, _fresh: u32) -> bool {
        true
    }

    /// Each merges with a point of this frame before two of them would merge.
    fn co_detected(&self, _old: u32) -> bool {
        true
    }

    fn merge(&mut self, kept: u32, gone: u32) {
        let (a, b) = (Self::of(&self.places, kept), Self::of(&self.places, gone));
        let has_detection = Self::of(&self.has_detection, kept) || Self::of(&self.has_detection, gone);
        let (kept, gone) = (kept as usize, gone as usize);
        if let (Some(place), Some(is_live), Some(has)) =
            (self.places.get_mut(kept), self.is_live.get_mut(gone), self.has_detection.get_mut(kept))
        {
            *place = std::array::from_fn(|axis| {
                let of = |place: &[f32; 3]| place.get(axis).copied().unwrap_or_default();
                f32::midpoint(of(&a), of(&b))
            });
            (*is_live, *has) = (false, has_detection);
        }
        for slot in [kept, gone] {
            if let Some(version) = self.versions.get_mut(slot) {
                *version += 1;
            }
        }
    }
}

/// Milliseconds of the best of five runs: the first has a cold cache.
fn best_of_some(mut run: impl FnMut() -> Duration) -> f64 {
    (0..5).map(|_| float(clock::nanos(run())) / 1e6).fold(f64::INFINITY, f64::min)
}

/// Milliseconds of one frame's clustering: this implementation, the naive loop, the library.
fn cluster(count: usize) -> [Option<f64>; 3] {
    let points = Points::new(count);
    let mut fast = points.clone();
    let mut merged = 0;
    let here = best_of_some(|| {
        fast = points.clone();
        let mut clustering = Clustering::new(2 * count, Some(THRESHOLD_M));
        points.old.iter().for_each(|&slot| clustering.place(&points, slot));
        let started = clock::now();
        merged = clustering.run(&mut fast, true, true);
        clock::now().since(started)
    });
    let naive = (count <= MAX_NAIVE_SIZE).then(|| {
        best_of_some(|| {
            let mut naive = points.clone();
            let started = clock::now();
            assert_eq!(cluster_naively(&mut naive), merged, "the two loops merge the same pairs");
            let cost = clock::now().since(started);
            assert_eq!(naive.places, fast.places, "to the same places");
            cost
        })
    });
    let library = (count <= MAX_LIBRARY_SIZE).then(|| {
        let slots: Vec<u32> = points.old.iter().chain(&points.fresh).copied().collect();
        best_of_some(|| {
            let started = clock::now();
            let rest = |index: usize| slots.iter().skip(index + 1);
            let mut spans: Vec<f64> = (slots.iter().enumerate())
                .flat_map(|(index, a)| rest(index).map(|b| points.span(*a, *b)))
                .collect();
            black_box(kodama::linkage(&mut spans, slots.len(), kodama::Method::Average));
            clock::now().since(started)
        })
    });
    [Some(here), naive, library]
}

fn main() {
    let started = clock::now();
    // Cargo adds a flag of its own.
    let asked: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    for sources in [1, 2] {
        let sizes = if asked.is_empty() { SIZES.to_vec() } else { asked.clone() };
        let sensed = if sources == 1 { "one source" } else { "two sources with one frame each per step" };
        println!("belief update per step, {sensed}, us; clustering of one frame, ms");
        println!(
            "{:>7} | {:^35} | {:^35} | {:^26} | {:^17} | {:^17} | {:^29}",
            "things",
            "robot: p50  p99  p99.9  max",
            "and a partner: p50  p99  p99.9  max",
            "itself: p50  p99  p99.9",
            "bare: p50  p99",
            "read, compare p50",
            "here, naive, library"
        );
        table(&sizes, sources);
    }
    println!("total: {} s", clock::now().since(started).as_secs());
}

fn table(sizes: &[usize], sources: u16) {
    let mut slopes: [Vec<(f64, f64)>; 2] = [Vec::new(), Vec::new()];
    for &count in sizes {
        print!("{count:>7}");
        for (partners, slope) in (0..).zip(&mut slopes) {
            let passes = if count <= MAX_PASSES_SIZE { PASSES } else { 1 };
            let passes: Vec<_> = (0..passes).map(|_| track(count, partners, sources)).collect();
            let [steps, reads, compares] = [0, 1, 2]
                .map(|of| passes.iter().filter_map(|pass| pass.get(of).cloned()).collect::<Vec<_>>());
            let [mut step, mut read, mut compare] = [&steps, &reads, &compares].map(|passes| passes.concat());
            let mut own = minimum_per_frame(&steps);
            [&mut step, &mut read, &mut compare, &mut own]
                .into_iter()
                .for_each(|costs| costs.sort_unstable());
            let us = |costs: &[u64], share: usize| {
                let index = (costs.len() - 1) * share / 1_000;
                float(costs.get(index).copied().unwrap_or(0)) / 1e3
            };
            let [p50, p99, p999, max] = [500, 990, 999, 1_000].map(|share| us(&step, share));
            print!(" | {p50:8.1} {p99:8.1} {p999:8.1} {max:8.1}");
            if count >= LARGE {
                slope.push((float_of_count(count).ln(), p50.ln()));
            }
            if partners > 0 {
                if passes.len() > 1 {
                    print!(" | {:8.1} {:8.1} {:8.1}", us(&own, 500), us(&own, 990), us(&own, 999));
                } else {
                    print!(" | {:>8} {:>8} {:>8}", "-", "-", "-");
                }
                let bare = machine_noise(us(&step, 500), step.len());
                print!(" | {:8.1} {:8.1}", us(&bare, 500), us(&bare, 990));
                print!(" | {:8.1} {:8.1}", us(&read, 500), us(&compare, 500));
            }
        }
        print!(" |");
        for cost in if sources == 1 { cluster(count) } else { [None; 3] } {
            match cost {
                Some(ms) => print!(" {ms:9.3}"),
                None => print!(" {:>9}", "-"),
            }
        }
        println!();
    }
    for (name, points) in ["the robot", "robot and partner"].iter().zip(&slopes) {
        if points.len() > 1 {
            println!("log-log slope of the cost from {LARGE} things on, {name}: {:.2}", slope(points));
        }
    }
}

/// Slope of the least-squares line.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = float_of_count(points.len());
    let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / count;
    let covariance: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    covariance / points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum::<f64>()
}

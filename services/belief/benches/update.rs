//! What a frame costs the belief systems: `cargo bench -p belief-process`; for so many things alone,
//! `cargo bench -p belief-process -- 64 1000`.
//!
//! Things on a grid of 11 cm that wobble by a few millimetres and are tracked at 200 Hz, each of
//! them unseen for a while now and then; for the robot alone, and for the robot and a partner who
//! sees all of them; of the latter also what it costs to read what both believe, as the belief buffers
//! get it, and to compare the two. Beside it, in the same run, one frame's clustering alone: as it is done
//! here, as the paper's loop does it, and as agglomerative clustering by an independent library (average
//! linkage) over the same points.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::hint::black_box;

use belief::{Clustering, Population, Symbols, cluster_naively};
use belief_process::{Believer, Divergences};
use clock::Instant;
use config::percepts::Percepts;
use config::perspective::{Angle, Perspective};
use geometry::{Base, Eye, Pose, Position};
use message::{Header, Hop, Observation, ObservationKind, Perceived, PerceptHead, SourceSet, State};
use perception::{Frame, Perception};
use quantity::number::{float, float_of_count, floor_usize, single};

const SIZES: [usize; 8] = [16, 64, 256, 1_000, 3_000, 10_000, 30_000, 100_000];
/// The slope of the cost is taken from here on.
const LARGE: usize = 1_000;
/// The naive loop looks at all pairs after each merge: more things than this take minutes.
const NAIVE_MOST: usize = 256;
/// The library holds the distances of all pairs.
const LIBRARY_MOST: usize = 3_000;
/// Frames until every history is full and the memory is warm.
const WARM: usize = 80;

/// The things of a frame as a grid, wobbling.
fn things(count: usize, frame: usize) -> impl Iterator<Item = (usize, [f32; 3], bool)> {
    let side = floor_usize(float_of_count(count).sqrt().ceil());
    (0..count).map(move |index| {
        let wobble = float_of_count((frame * 7 + index * 13) % 11) * 0.0005;
        let along = |cells: usize| float_of_count(cells) * 0.11;
        let place = [along(index / side) + wobble, along(index % side) - wobble, 0.03].map(single);
        let unseen = (frame / 40 + index).is_multiple_of(50);
        (index, place, unseen)
    })
}

fn observations(count: usize, frame: usize, at: Instant) -> impl Iterator<Item = Observation> {
    let side_m = float_of_count(count).sqrt() * 0.11;
    let eye = Pose::<Base, Eye>::looking(
        &Position::new(-side_m - 1.0, side_m / 2.0, 2.0 * side_m + 1.0),
        &Position::new(side_m / 2.0, side_m / 2.0, 0.0),
    );
    let person = Observation {
        kind: ObservationKind::Person.raw(),
        partner: 1,
        position_m: eye.position_m().map(single),
        orientation_xyzw: eye.orientation_xyzw().map(single),
        ..Observation::object(0, at.as_nanos())
    };
    let seen = things(count, frame).filter(|(_, _, unseen)| !unseen).map(move |(index, position_m, _)| {
        let mut thing = Observation::object(0, at.as_nanos());
        thing.confidence = 0.9;
        thing.position_m = position_m;
        thing.half_extents_m = [0.03; 3];
        thing.colour_rgb = if index.is_multiple_of(3) { [0.8, 0.05, 0.05] } else { [0.05, 0.55, 0.1] };
        thing.set_state(State::Filled, 0.0);
        thing
    });
    std::iter::once(person).chain(seen)
}

/// Nanoseconds of each frame: of the step, of reading what is believed, and of comparing it.
fn track(count: usize, partners: u32) -> [Vec<u64>; 3] {
    let percepts = Percepts::builtin();
    let perception = Perception::new(&percepts).expect("the built-in percepts need no program");
    let mut config = Perspective::builtin();
    config.sight.range_m = 1e4.try_into().expect("a range");
    config.sight.cone_half_angle_deg = Angle::try_from(89.0).expect("an angle");
    let mut believer =
        Believer::new(&percepts, &config, partners, 1, count + 1).expect("the capacity is in range");
    let frames = WARM + (1_000_000 / count).clamp(20, 4_000);
    let mut entries = Vec::with_capacity(count + 1);
    let mut divergences = Divergences::new(&percepts, &believer, count + 1);
    let mut costs = [(); 3].map(|()| Vec::with_capacity(frames));
    let mut at = Instant::from_nanos(1_000_000_000);
    for frame in 0..frames {
        if frame == WARM {
            // As the process does before it says that it is ready.
            let _bytes = realtime::use_huge_pages();
        }
        at += clock::Duration::from_millis(5);
        entries.clear();
        entries.extend(observations(count, frame, at).map(|observation| {
            let snapshot = perception.perceive(&observation, &Frame { agent: 0 });
            Perceived { observation, snapshot }
        }));
        let mut header = Header::at(at.as_nanos());
        header.pass(Hop::Observed, at.as_nanos());
        let head = PerceptHead::new(header, SourceSet::of(0));
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
        assert!(divergences.head(1).agreed > 0 || partners == 0 || frame < WARM, "they believe the same");
        for perspective in 0..believer.perspectives() {
            let all = believer.len(perspective) == count || frame < WARM;
            assert!(all, "each thing is one belief, whether it is seen now or not");
        }
    }
    costs.map(|mut costs| {
        costs.drain(..WARM);
        costs.sort_unstable();
        costs
    })
}

/// A frame's points and those before: positions with a colour, merged half way.
#[derive(Clone)]
struct Points {
    places: Vec<[f32; 3]>,
    colours: Vec<u16>,
    old: Vec<u32>,
    fresh: Vec<u32>,
    lives: Vec<bool>,
    versions: Vec<u32>,
    /// Who has taken in a point of this frame.
    taken: Vec<bool>,
}

const THRESHOLD_M: f64 = 0.15;

impl Points {
    fn new(count: usize) -> Self {
        let all = || things(count, 0).chain(things(count, 5));
        let slots = |from: usize| (from..from + count).filter_map(|slot| u32::try_from(slot).ok());
        Self {
            places: all().map(|(_, place, _)| place).collect(),
            colours: all().map(|(index, ..)| u16::from(index.is_multiple_of(3))).collect(),
            old: slots(0).collect(),
            fresh: slots(count).collect(),
            lives: vec![true; 2 * count],
            versions: vec![0; 2 * count],
            taken: (0..2 * count).map(|slot| slot >= count).collect(),
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

impl Population for Points {
    fn old(&self) -> &[u32] {
        &self.old
    }

    fn fresh(&self) -> &[u32] {
        &self.fresh
    }

    fn lives(&self, slot: u32) -> bool {
        Self::of(&self.lives, slot)
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

    fn symbols(&self, slot: u32) -> Symbols {
        let mut symbols = Symbols::NONE;
        symbols.set(0, Self::of(&self.colours, slot));
        symbols
    }

    fn distance(&self, a: u32, b: u32) -> Option<f64> {
        let both_taken = Self::of(&self.taken, a) && Self::of(&self.taken, b);
        let alike = Self::of(&self.colours, a) == Self::of(&self.colours, b);
        let span = self.span(a, b);
        (alike && !both_taken && span < THRESHOLD_M).then_some(span)
    }

    fn reach_m(&self, distance: f64) -> f64 {
        distance
    }

    fn takes_in(&self, _old: u32, _fresh: u32) -> bool {
        true
    }

    /// Each takes in a point of this frame before two of them would merge.
    fn is_companion(&self, _old: u32) -> bool {
        true
    }

    fn merge(&mut self, kept: u32, gone: u32) {
        let (a, b) = (Self::of(&self.places, kept), Self::of(&self.places, gone));
        let taken = Self::of(&self.taken, kept) || Self::of(&self.taken, gone);
        let (kept, gone) = (kept as usize, gone as usize);
        if let (Some(place), Some(lives), Some(has)) =
            (self.places.get_mut(kept), self.lives.get_mut(gone), self.taken.get_mut(kept))
        {
            *place = std::array::from_fn(|axis| {
                let of = |place: &[f32; 3]| place.get(axis).copied().unwrap_or_default();
                f32::midpoint(of(&a), of(&b))
            });
            (*lives, *has) = (false, taken);
        }
        for slot in [kept, gone] {
            if let Some(version) = self.versions.get_mut(slot) {
                *version += 1;
            }
        }
    }
}

/// Milliseconds of one frame's clustering: here, by the naive loop, by the library.
fn cluster(count: usize) -> [Option<f64>; 3] {
    let points = Points::new(count);
    let ms = |nanos: u64| float(nanos) / 1e6;
    let mut fast = points.clone();
    let mut merged = 0;
    let mut here = f64::INFINITY;
    // The best of a few: the first finds its memory cold.
    for _ in 0..5 {
        fast = points.clone();
        let mut clustering = Clustering::new(2 * count, Some(THRESHOLD_M));
        points.old.iter().for_each(|&slot| clustering.place(&points, slot));
        let started = clock::now();
        merged = clustering.run(&mut fast, true, true);
        here = here.min(ms(clock::nanos(clock::now().since(started))));
    }
    let naive = (count <= NAIVE_MOST).then(|| {
        let mut naive = points.clone();
        let started = clock::now();
        assert_eq!(cluster_naively(&mut naive), merged, "the two loops merge the same pairs");
        let cost = ms(clock::nanos(clock::now().since(started)));
        assert_eq!(naive.places, fast.places, "to the same places");
        cost
    });
    let library = (count <= LIBRARY_MOST).then(|| {
        let slots: Vec<u32> = points.old.iter().chain(&points.fresh).copied().collect();
        let started = clock::now();
        let rest = |index: usize| slots.iter().skip(index + 1);
        let mut spans: Vec<f64> = (slots.iter().enumerate())
            .flat_map(|(index, a)| rest(index).map(|b| points.span(*a, *b)))
            .collect();
        black_box(kodama::linkage(&mut spans, slots.len(), kodama::Method::Average));
        ms(clock::nanos(clock::now().since(started)))
    });
    [Some(here), naive, library]
}

fn main() {
    println!("Belief update per frame, us; the clustering of one frame alone, ms");
    println!(
        "{:>7} | {:^35} | {:^35} | {:^17} | {:^29}",
        "things",
        "robot: p50  p99  p99.9  max",
        "and a partner: p50  p99  p99.9  max",
        "read, compare p50",
        "here, naive, library"
    );
    let mut slopes: [Vec<(f64, f64)>; 2] = [Vec::new(), Vec::new()];
    // Cargo adds a flag of its own.
    let asked: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    for count in if asked.is_empty() { SIZES.to_vec() } else { asked } {
        print!("{count:>7}");
        for (partners, slope) in (0..).zip(&mut slopes) {
            let [step, read, compare] = track(count, partners);
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
                print!(" | {:8.1} {:8.1}", us(&read, 500), us(&compare, 500));
            }
        }
        print!(" |");
        for cost in cluster(count) {
            match cost {
                Some(ms) => print!(" {ms:9.3}"),
                None => print!(" {:>9}", "-"),
            }
        }
        println!();
    }
    for (name, points) in ["the robot", "robot and partner"].iter().zip(&slopes) {
        if points.len() > 1 {
            println!("slope of the cost (log-log) from {LARGE} things on, {name}: {:.2}", slope(points));
        }
    }
}

/// Of the line of least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = float_of_count(points.len());
    let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / count;
    let covariance: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    covariance / points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum::<f64>()
}

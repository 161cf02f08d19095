//! Random variants of the four tasks: other blocks and places, but the same rules to learn.

use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

use config::lesson::{
    Act, Destination, Lesson, Noise, Object, ObjectKind, Occluder, Role, Step, Table, TableTiming, Teacher,
    UprightPose,
};
use quantity::number::float_of_count;
use rand::RngExt as _;
use rand::seq::{IndexedRandom as _, SliceRandom as _};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;

/// A lesson without a novel set, and the rules that should be learned from it.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskVariant {
    /// The task, 1 to 4.
    pub task: u32,
    /// The demonstrations.
    pub lesson: Lesson,
    /// The name of the winner with perspective taking.
    pub with: String,
    /// The name of the winner without perspective taking.
    pub without: String,
}

/// The colours of blocks, in the order in which Leo lists them.
const COLOURS: [(&str, [f64; 3]); 4] = [
    ("red", [0.80, 0.05, 0.05]),
    ("green", [0.05, 0.55, 0.10]),
    ("blue", [0.05, 0.15, 0.80]),
    ("yellow", [0.85, 0.70, 0.05]),
];
const WOOD: [f64; 3] = [0.55, 0.35, 0.18];

const MEDIUM_M: f64 = 0.03;
const SMALL_M: f64 = 0.017;

/// Shapes, in the order in which Leo lists them.
const SQUARE: [f64; 4] = [0.0, 0.0, 0.0, 0.0];
const TRIANGLE: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
const LONG: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
const BRIDGE: [f64; 4] = [0.5, 0.0, 0.5, 0.0];
const CYLINDER: [f64; 4] = [0.0, 0.0, 1.0, 0.0];
const PEG: [f64; 4] = [1.0, 0.0, 1.0, 0.0];
const MARKER: [f64; 4] = [0.0, 1.0, 1.0, 0.0];

/// The shapes of blocks that are marked, and of those that are not.
const MARKED: [[f64; 4]; 3] = [TRIANGLE, LONG, BRIDGE];
const UNMARKED: [[f64; 4]; 2] = [SQUARE, CYLINDER];

/// The position of the teacher's eyes: even a narrow field of view contains the whole table.
const EYES_M: [f64; 3] = [0.0, 1.8, 0.8];
const LOOKS_AT_M: [f64; 3] = [0.0, 0.75, 0.0];

/// The duration of moving one object, and the time from one move to the next.
const CARRY_TIME: Duration = Duration::from_millis(700);
const MOVE_INTERVAL: Duration = Duration::from_millis(1_200);

impl TaskVariant {
    /// The design of a task (1 to 4) for a seed; `None` for another task number.
    #[must_use]
    pub fn of(task: u32, seed: u64) -> Option<Self> {
        let mut chance =
            RandomDesign(ChaCha8Rng::seed_from_u64(seed.wrapping_mul(4).wrapping_add(u64::from(task))));
        let (demonstrations, with, without) = match task {
            1 => chance.filled(),
            2 => chance.marked(),
            3 | 4 => chance.built(task),
            _ => return None,
        };
        let lesson = Lesson {
            title: format!("Task {task}, design {seed}"),
            watch: "What is learned?".to_owned(),
            needs: config::lesson::Needs::default(),
            seed,
            robot: UprightPose { position_m: [0.0; 3], heading_rad: FRAC_PI_2 },
            teachers: vec![Teacher { number: 1, eyes_m: EYES_M, looks_at_m: LOOKS_AT_M }],
            noise: Noise { position_sd_m: 0.003, confidence: 0.9 },
            table_timing: TableTiming {
                empty: Duration::from_secs(2),
                occluders_first: Duration::from_millis(300),
                keep: Duration::from_millis(300),
            },
            kinds: std::collections::BTreeMap::new(),
            colours: std::collections::BTreeMap::new(),
            demonstrations,
            novel: None,
        };
        Some(Self { task, lesson, with, without })
    }
}

/// An object on the table at the beginning.
struct Thing {
    name: String,
    colour: [f64; 3],
    kind: ObjectKind,
    at_m: [f64; 2],
}

impl Thing {
    fn block(name: String, colour: [f64; 3], shape: [f64; 4], half_m: [f64; 3], at_m: [f64; 2]) -> Self {
        let kind =
            ObjectKind { role: Role::Block, shape, half_extents_m: half_m, hole: false, markable: false };
        Self { name, colour, kind, at_m }
    }

    fn to_object(&self) -> Object {
        let [x, y] = self.at_m;
        let [.., half_height_m] = self.kind.half_extents_m;
        Object {
            name: self.name.clone(),
            kind: self.kind,
            colour_rgb: self.colour,
            place: UprightPose { position_m: [x, y, half_height_m], heading_rad: 0.0 },
        }
    }
}

/// A demonstration: the objects, the occluders, and the moves in order.
fn demonstration(
    task: u32,
    things: &[Thing],
    occluders: Vec<Occluder>,
    moves: impl IntoIterator<Item = (usize, Destination)>,
) -> Table {
    let mut at = Duration::from_secs(1);
    let mut script =
        vec![Step { at, who: 1, act: Act::Say(format!("Leo, I can teach you to do task {task}")) }];
    at += Duration::from_millis(500);
    for (object, to) in moves {
        script.push(Step { at, who: 1, act: Act::Move { object, to, takes: CARRY_TIME } });
        at += MOVE_INTERVAL;
    }
    script.push(Step { at, who: 1, act: Act::Say(format!("Task {task} is done")) });
    let objects = things.iter().map(Thing::to_object).collect();
    Table { objects, occluders, territory: Vec::new(), script }
}

fn is_same(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < f64::EPSILON)
}

/// The name of a rule about these values of one feature, in Leo's words.
fn all_of(names: &[&str]) -> String {
    match names {
        [] => "all".to_owned(),
        [only] => format!("all {only}"),
        [first @ .., last] => format!("all {} and {last}", first.join(", ")),
    }
}

/// A block that can be marked.
#[derive(Clone, Copy)]
struct Marked {
    colour: usize,
    shape: [f64; 4],
    size_m: f64,
}

type DesignParts = (Vec<Table>, String, String);

struct RandomDesign(ChaCha8Rng);

impl RandomDesign {
    fn between(&mut self, from: f64, to: f64) -> f64 {
        self.0.random_range(from..to)
    }

    fn size(&mut self) -> f64 {
        if self.0.random_bool(0.5) { SMALL_M } else { MEDIUM_M }
    }

    /// Places in a row along x with a spacing and a jitter, in random order.
    fn row(&mut self, count: usize, apart_m: f64, y_m: f64, jitter_m: f64) -> Vec<[f64; 2]> {
        let from_m = -apart_m * float_of_count(count.saturating_sub(1)) / 2.0;
        let mut places: Vec<[f64; 2]> = (0..count)
            .map(|index| {
                let x = from_m + apart_m * float_of_count(index) + self.between(-jitter_m, jitter_m);
                [x, y_m + self.between(-jitter_m, jitter_m)]
            })
            .collect();
        places.shuffle(&mut self.0);
        places
    }

    /// Task 1: all holes that the teacher sees are filled. One block, with a unique colour, is hidden from the teacher.
    fn filled(&mut self) -> DesignParts {
        let mut colours: Vec<usize> = (0..COLOURS.len()).collect();
        colours.shuffle(&mut self.0);
        let (hidden, visible) = (colours.pop().unwrap_or(0), colours);
        let mut seen = vec![false; COLOURS.len()];
        let demonstrations = (0..2).map(|_| self.filling(hidden, &visible, &mut seen)).collect();
        let names: Vec<&str> =
            COLOURS.iter().zip(&seen).filter(|(_, seen)| **seen).map(|((name, _), _)| *name).collect();
        let hidden = COLOURS.get(hidden).map_or("", |(name, _)| *name);
        let without = if names.len() > 2 { format!("all but {hidden}") } else { all_of(&names) };
        (demonstrations, "all".to_owned(), without)
    }

    fn filling(&mut self, hidden: usize, visible: &[usize], seen: &mut [bool]) -> Table {
        let count = self.0.random_range(3..=5);
        let square = |name: String, colour: usize, at_m: [f64; 2]| {
            let colour = COLOURS.get(colour).map_or(WOOD, |(_, colour)| *colour);
            let mut block = Thing::block(name, colour, SQUARE, [MEDIUM_M; 3], at_m);
            block.kind.hole = true;
            block
        };
        let mut things = Vec::new();
        for (index, at_m) in self.row(count, 0.18, 0.82, 0.04).into_iter().enumerate() {
            let colour = visible.choose(&mut self.0).copied().unwrap_or(0);
            if let Some(seen) = seen.get_mut(colour) {
                *seen = true;
            }
            things.push(square(format!("block {index}"), colour, at_m));
        }
        let hides_m = self.between(-0.25, 0.25);
        things.push(square("hidden".to_owned(), hidden, [hides_m, 0.40]));
        let pegs = things.len();
        let half_extents_m = [0.011, 0.011, 0.025];
        for (index, at_m) in self.row(7, 0.09, 1.15, 0.005).into_iter().enumerate() {
            let kind =
                ObjectKind { role: Role::Peg, shape: PEG, half_extents_m, hole: false, markable: false };
            things.push(Thing { name: format!("peg {index}"), colour: WOOD, kind, at_m });
        }
        // On the line from the teacher's eyes to the block, just before the block.
        let wall = Occluder {
            name: "wall".to_owned(),
            centre_m: [hides_m * 0.92, 0.51, 0.18],
            half_extents_m: [0.18, 0.01, 0.18],
        };
        let moves = (0..count).map(|block| (pegs + block, Destination::Hole(block)));
        demonstration(1, &things, vec![wall], moves)
    }

    /// Task 2: the teacher's blocks of two colours, in three shapes, are marked. The robot's blocks of these colours
    /// have other shapes and are not marked.
    fn marked(&mut self) -> DesignParts {
        let mut colours: Vec<usize> = (0..COLOURS.len()).collect();
        colours.shuffle(&mut self.0);
        let mut marked: Vec<usize> = colours.drain(..2).collect();
        marked.sort_unstable();
        let other = colours.pop().unwrap_or(0);
        // Each shape in both colours, over both demonstrations, and two more blocks.
        let mut kinds: Vec<(usize, [f64; 4])> =
            marked.iter().flat_map(|&colour| MARKED.map(|shape| (colour, shape))).collect();
        for _ in 0..2 {
            kinds.extend(kinds.choose(&mut self.0).copied());
        }
        kinds.shuffle(&mut self.0);
        // The size must not discriminate: each colour, and at least one shape, occurs in both sizes.
        let kinds = loop {
            let sized: Vec<Marked> =
                kinds.iter().map(|&(colour, shape)| Marked { colour, shape, size_m: self.size() }).collect();
            let both = |alike: &dyn Fn(&Marked) -> bool| {
                let mut sizes = sized.iter().filter(|kind| alike(kind)).map(|kind| kind.size_m > SMALL_M);
                let first = sizes.next();
                sizes.any(|size| Some(size) != first)
            };
            if marked.iter().all(|colour| both(&|kind| kind.colour == *colour))
                && MARKED.iter().any(|shape| both(&|kind| is_same(&kind.shape, shape)))
            {
                break sized;
            }
        };
        let (first, second) = kinds.split_at(kinds.len() / 2);
        let tables = [first, second].map(|kinds| self.marking(kinds, &marked, other)).into();
        let names: Vec<&str> =
            marked.iter().filter_map(|&colour| COLOURS.get(colour).map(|(name, _)| *name)).collect();
        (tables, all_of(&names), all_of(&["triangle", "long", "bridge"]))
    }

    fn marking(&mut self, kinds: &[Marked], marked: &[usize], other: usize) -> Table {
        let his = self.row(kinds.len() + UNMARKED.len(), 0.15, 1.02, 0.015);
        let mine = self.row(6, 0.15, 0.40, 0.015);
        let mut sizes = [SMALL_M, MEDIUM_M];
        sizes.shuffle(&mut self.0);
        let left = UNMARKED.into_iter().zip(sizes);
        let left = left.map(|(shape, size_m)| Marked { colour: other, shape, size_m });
        let of_his = kinds.iter().copied().chain(left);
        let not_his: Vec<Marked> = marked
            .iter()
            .chain([&other])
            .flat_map(|&colour| UNMARKED.map(|shape| (colour, shape)))
            .map(|(colour, shape)| Marked { colour, shape, size_m: self.size() })
            .collect();
        let blocks = of_his.zip(his).chain(not_his.into_iter().zip(mine)).enumerate();
        let mut things = Vec::new();
        for (index, (Marked { colour, shape, size_m }, at_m)) in blocks {
            let colour = COLOURS.get(colour).map_or(WOOD, |(_, colour)| *colour);
            let mut block = Thing::block(format!("block {index}"), colour, shape, [size_m; 3], at_m);
            block.kind.markable = true;
            things.push(block);
        }
        let markers = things.len();
        let half_extents_m = [0.016, 0.016, 0.006];
        for (index, at_m) in self.row(6, 0.10, 1.25, 0.005).into_iter().enumerate() {
            let kind = ObjectKind {
                role: Role::Marker,
                shape: MARKER,
                half_extents_m,
                hole: false,
                markable: false,
            };
            things.push(Thing { name: format!("marker {index}"), colour: WOOD, kind, at_m });
        }
        let mut order: Vec<usize> = (0..kinds.len()).collect();
        order.shuffle(&mut self.0);
        let moves = order.into_iter().enumerate();
        let moves = moves.map(|(index, block)| (markers + index, Destination::Top(block)));
        demonstration(2, &things, Vec::new(), moves)
    }

    /// Tasks 3 and 4: a few objects are arranged in front of the teacher; in Task 3 some are stacked.
    fn built(&mut self, task: u32) -> DesignParts {
        let count = self.0.random_range(3..=6_usize);
        let mut cells: Vec<[f64; 2]> =
            [-0.21, -0.07, 0.07, 0.21].iter().flat_map(|x| [[*x, 0.68], [*x, 0.82]]).collect();
        cells.shuffle(&mut self.0);
        let mut things = Vec::new();
        let mut moves = Vec::new();
        let mut below: Option<([f64; 2], f64)> = None;
        for (index, at_m) in self.row(count, 0.16, 1.1, 0.01).into_iter().enumerate() {
            let colour = COLOURS.choose(&mut self.0).map_or(WOOD, |(_, colour)| *colour);
            let shape = [SQUARE, TRIANGLE, CYLINDER, LONG].choose(&mut self.0).copied().unwrap_or(SQUARE);
            let half_m = if shape == LONG { [0.05, 0.02, 0.02] } else { [MEDIUM_M; 3] };
            things.push(Thing::block(format!("block {index}"), colour, shape, half_m, at_m));
            let [.., half_height_m] = half_m;
            let stacks = task == 3 && self.0.random_bool(0.4);
            let ([x, y], underside_m) = match below.take().filter(|_| stacks) {
                Some(below) => below,
                None => (cells.pop().unwrap_or_default(), 0.0),
            };
            below = (shape == SQUARE).then_some(([x, y], underside_m + 2.0 * half_height_m));
            let heading_rad = if self.0.random_bool(0.5) { FRAC_PI_2 } else { 0.0 };
            let place = UprightPose { position_m: [x, y, underside_m + half_height_m], heading_rad };
            moves.push((index, Destination::UprightPose(place)));
        }
        let with = format!("{count} things turned by 180°, as they stood before you");
        let without = format!("{count} things as they stood before me");
        (vec![demonstration(task, &things, Vec::new(), moves)], with, without)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_seed_gives_one_design() {
        for task in 1..=4 {
            assert_eq!(TaskVariant::of(task, 7), TaskVariant::of(task, 7));
            assert_ne!(TaskVariant::of(task, 7), TaskVariant::of(task, 8));
        }
        assert_eq!(TaskVariant::of(5, 7), None);
    }

    #[test]
    fn objects_of_a_design_do_not_overlap() {
        let mut pairs = 0;
        for (task, seed) in (1..=4).flat_map(|task| (0..200).map(move |seed| (task, seed))) {
            for table in TaskVariant::of(task, seed).unwrap().lesson.demonstrations {
                for (index, object) in table.objects.iter().enumerate() {
                    for other in &table.objects[..index] {
                        let ([x, y, _], [u, v, _]) = (object.place.position_m, other.place.position_m);
                        assert!(
                            (x - u).hypot(y - v) > 0.06,
                            "task {task}, design {seed}: {object:?} {other:?}"
                        );
                        pairs += 1;
                    }
                }
            }
        }
        assert!(pairs > 4 * 200, "only {pairs} pairs were compared");
    }

    #[test]
    fn in_task_2_each_shape_is_marked_in_both_colours() {
        for seed in 0..200 {
            let design = TaskVariant::of(2, seed).unwrap();
            let blocks = design.lesson.demonstrations.iter().flat_map(|table| {
                let marked = table.script.iter().filter_map(|step| {
                    let Act::Move { to: Destination::Top(block), .. } = step.act else { return None };
                    Some(block)
                });
                marked.map(|block| (table.objects[block].colour_rgb, table.objects[block].kind.shape))
            });
            let mut kinds: Vec<_> = blocks.map(|kind| format!("{kind:?}")).collect();
            kinds.sort();
            kinds.dedup();
            assert_eq!(kinds.len(), 6, "each of three shapes in both of two colours");
        }
    }
}

//! Synthetic lessons of any size, for benchmarks.

use std::collections::BTreeMap;
use std::time::Duration;

use quantity::number::float_of_count;

use super::{
    Act, Destination, Lesson, Needs, Noise, Object, ObjectKind, Role, Step, Table, TableTiming, Teacher,
    UprightPose,
};

/// Grid spacing, in metres.
const SPACING_M: f64 = 0.16;
/// One block of this many moves.
const MOVING: usize = 8;
/// Length of a stroke in metres, and its duration.
const STROKE_M: f64 = 0.05;
const STROKE: Duration = Duration::from_secs(5);
/// Number of strokes of each moving block: two minutes in all.
const STROKES: u32 = 24;

impl Lesson {
    /// A table with `objects` blocks in a square grid before the robot. Every eighth block moves slowly to and fro for
    /// two minutes, all of them at the same time. Shapes and colours vary.
    #[must_use]
    pub fn synthetic(objects: usize) -> Self {
        let objects: Vec<Object> = (0..objects).map(|index| block(index, objects)).collect();
        let script = (0..STROKES).flat_map(|stroke| strokes(stroke, &objects)).collect();
        Self {
            title: format!("{} blocks", objects.len()),
            watch: "How long does it take?".to_owned(),
            needs: Needs::default(),
            seed: 1,
            robot: UprightPose { position_m: [0.0; 3], heading_rad: std::f64::consts::FRAC_PI_2 },
            teachers: vec![Teacher { number: 1, eyes_m: [0.0, 3.5, 0.55], looks_at_m: [0.0, 1.5, 0.0] }],
            noise: Noise { position_sd_m: 0.003, confidence: 0.9 },
            table_timing: TableTiming {
                empty: Duration::ZERO,
                occluders_first: Duration::ZERO,
                keep: Duration::ZERO,
            },
            kinds: BTreeMap::new(),
            colours: BTreeMap::new(),
            demonstrations: vec![Table { objects, occluders: Vec::new(), territory: Vec::new(), script }],
            novel: None,
        }
    }
}

fn block(index: usize, of: usize) -> Object {
    let columns = of.isqrt().max(1);
    let x = (float_of_count(index % columns) - float_of_count(columns - 1) / 2.0) * SPACING_M;
    let y = 0.3 + float_of_count(index / columns) * SPACING_M;
    let shapes = [[0.0; 4], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]];
    let colours = [[0.80, 0.05, 0.05], [0.05, 0.55, 0.10], [0.05, 0.15, 0.80], [0.85, 0.70, 0.05]];
    let pick = |count: usize| index % count.max(1);
    Object {
        name: format!("block {index}"),
        kind: ObjectKind {
            role: Role::Block,
            shape: shapes.get(pick(shapes.len())).copied().unwrap_or_default(),
            half_extents_m: [0.03; 3],
            hole: true,
            markable: false,
        },
        colour_rgb: colours.get(pick(colours.len())).copied().unwrap_or_default(),
        place: UprightPose { position_m: [x, y, 0.03], heading_rad: 0.0 },
    }
}

fn strokes(stroke: u32, objects: &[Object]) -> impl Iterator<Item = Step> {
    let moving = objects.iter().enumerate().step_by(MOVING);
    moving.map(move |(object, block)| {
        let [x, y, z] = block.place.position_m;
        let there = if stroke.is_multiple_of(2) { STROKE_M } else { 0.0 };
        let to = Destination::UprightPose(UprightPose { position_m: [x + there, y, z], ..block.place });
        Step { at: STROKE * stroke, who: 1, act: Act::Move { object, to, takes: STROKE } }
    })
}

//! Checks that the geometry of Task 1 reproduces the paper's study.

use super::{Act, Destination, Lesson, Object, Occluder, Role, Table};

/// Margin on occlusion, in metres: more than three standard deviations of the noise.
const MARGIN_M: f64 = 0.010;

/// Whether the segment from `eye` to `point` intersects the box grown by `margin_m` (slab method).
fn meets(wall: &Occluder, margin_m: f64, eye: [f64; 3], point: [f64; 3]) -> bool {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let direction = point[axis] - eye[axis];
        let half = wall.half_extents_m[axis] + margin_m;
        let (low, high) = (wall.centre_m[axis] - half - eye[axis], wall.centre_m[axis] + half - eye[axis]);
        if direction.abs() < 1e-12 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
        } else {
            enter = enter.max((low / direction).min(high / direction));
            leave = leave.min((low / direction).max(high / direction));
        }
    }
    enter <= leave
}

/// Centre, corners, edge midpoints and face centres.
fn samples(object: &Object) -> Vec<[f64; 3]> {
    let (sin, cos) = object.place.heading_rad.sin_cos();
    let [cx, cy, cz] = object.place.position_m;
    let [hx, hy, hz] = object.kind.half_extents_m;
    let steps = [-1.0, 0.0, 1.0];
    let all =
        steps.iter().flat_map(|&a| steps.iter().flat_map(move |&b| steps.map(|c| [a * hx, b * hy, c * hz])));
    all.map(|[x, y, z]| [cx + cos * x - sin * y, cy + sin * x + cos * y, cz + z]).collect()
}

fn is_hidden(object: &Object, table: &Table, eye: [f64; 3], margin_m: f64) -> [bool; 2] {
    let hidden: Vec<bool> = samples(object)
        .into_iter()
        .map(|point| table.occluders.iter().any(|wall| meets(wall, margin_m, eye, point)))
        .collect();
    assert_eq!(hidden.len(), 27);
    [hidden.iter().all(|&hidden| hidden), hidden.iter().any(|&hidden| hidden)]
}

#[test]
fn the_wall_hides_exactly_the_blue_block() {
    let lesson = Lesson::builtin();
    let eye = lesson.teachers[0].eyes_m;
    assert_eq!(lesson.demonstrations.len(), 2);
    for table in &lesson.demonstrations {
        assert_eq!((table.objects.len(), table.occluders.len()), (12, 1));
        let mut hidden = 0;
        for object in &table.objects {
            if object.name == "blue" {
                hidden += 1;
                let [all, _] = is_hidden(object, table, eye, -MARGIN_M);
                assert!(all, "a corner of {} shows", object.name);
            } else {
                let [_, any] = is_hidden(object, table, eye, MARGIN_M);
                assert!(!any, "a corner of {} is hidden", object.name);
            }
        }
        assert_eq!(hidden, 1);
    }
}

#[test]
fn every_object_lies_within_the_teachers_field_of_view() {
    let lesson = Lesson::builtin();
    let teacher = lesson.teachers[0];
    let towards = |point: [f64; 3]| {
        let direction = [0, 1, 2].map(|axis| point[axis] - teacher.eyes_m[axis]);
        let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt();
        direction.map(|part| part / length)
    };
    let gaze = towards(teacher.looks_at_m);
    let mut seen = 0;
    for object in lesson.tables().flat_map(|table| &table.objects) {
        for point in samples(object) {
            let cosine: f64 = gaze.iter().zip(towards(point)).map(|(a, b)| a * b).sum();
            assert!(cosine.acos().to_degrees() < 50.0, "{} is at the edge of his view", object.name);
        }
        seen += 1;
    }
    assert!(seen > 24, "only {seen} objects were seen");
}

#[test]
fn the_teacher_fills_exactly_the_visible_holes() {
    let lesson = Lesson::builtin();
    assert_eq!(lesson.demonstrations.len(), 2);
    for table in &lesson.demonstrations {
        let filled: Vec<&str> = table
            .script
            .iter()
            .filter_map(|step| {
                let Act::Move { to: Destination::Hole(block), .. } = step.act else { return None };
                Some(table.objects[block].name.as_str())
            })
            .collect();
        assert_eq!(filled.len(), 4);
        for object in table.objects.iter().filter(|object| object.kind.hole) {
            assert_eq!(filled.contains(&object.name.as_str()), object.name != "blue", "{}", object.name);
        }
    }
}

#[test]
fn the_hidden_block_differs_from_the_filled_ones_in_colour_alone() {
    let lesson = Lesson::builtin();
    assert_eq!(lesson.demonstrations.len(), 2);
    for table in &lesson.demonstrations {
        let blue = table.objects.iter().find(|object| object.name == "blue").unwrap();
        let holed: Vec<&Object> = table.objects.iter().filter(|object| object.kind.hole).collect();
        assert_eq!(holed.len(), 5);
        assert!(holed.iter().all(|object| object.kind == blue.kind));
        let as_blue =
            |object: &&&Object| object.colour_rgb.map(f64::to_bits) == blue.colour_rgb.map(f64::to_bits);
        assert_eq!(holed.iter().filter(as_blue).count(), 1);
    }
}

#[test]
fn the_novel_set_is_within_the_robots_reach_and_not_crowded() {
    let novel = Lesson::builtin().novel.unwrap();
    assert!(novel.occluders.is_empty());
    let pegs = novel.objects.iter().filter(|object| object.kind.role == Role::Peg).count();
    assert_eq!((pegs, novel.objects.len() - pegs), (7, 5));
    for (index, object) in novel.objects.iter().enumerate() {
        let [x, y, z] = object.place.position_m;
        assert!(x.abs() <= 0.28 && (0.28..=0.48).contains(&y), "{} is out of reach", object.name);
        let underside_m = z - object.kind.half_extents_m[2];
        assert!(underside_m.abs() < 1e-12, "{} does not stand on the table", object.name);
        for other in &novel.objects[..index] {
            let [ox, oy, _] = other.place.position_m;
            let min = if object.kind.hole && other.kind.hole { 0.11 } else { 0.07 };
            assert!((x - ox).hypot(y - oy) >= min, "{} crowds {}", object.name, other.name);
        }
    }
}

#[test]
fn the_lesson_lasts_about_eighteen_seconds_and_tells_leo_once_to_perform() {
    let lesson = Lesson::builtin();
    assert_eq!(lesson.performances(), 1);
    let shown: f64 = lesson
        .demonstrations
        .iter()
        .map(|table| table.script.last().map_or(0.0, |step| (step.at + step.act.takes()).as_secs_f64()))
        .sum();
    let laid = (lesson.table_timing.occluders_first + lesson.table_timing.empty + lesson.table_timing.keep)
        .as_secs_f64();
    assert!((15.0..19.0).contains(&(shown + laid)), "{shown} s + {laid} s");
}

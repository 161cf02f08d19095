use geometry::{Base, Eye, Pose, Position, Thing};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use proptest::prelude::*;

use super::*;

/// An independent slab test in `f64`: the interval of the segment's parameter inside the box; `None` if it misses.
fn segment_in_box(
    pose: &Pose<Base, Thing>,
    half: [f64; 3],
    from: Point3<f64>,
    to: Point3<f64>,
) -> Option<(f64, f64)> {
    let from = pose.isometry().inverse_transform_point(&from);
    let to = pose.isometry().inverse_transform_point(&to);
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let along = to[axis] - from[axis];
        if along.abs() < 1e-15 {
            if from[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half[axis] - from[axis]) / along, (half[axis] - from[axis]) / along);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some((enter, leave))
}

/// `None` if the result depends on less than `margin_m`, where single precision may differ.
fn occluded_slowly(
    boxes: &[(Pose<Base, Thing>, [f64; 3])],
    from: Position<Base>,
    to: Position<Base>,
    margin_m: f64,
) -> Option<bool> {
    let hit = |grow: f64| {
        boxes.iter().any(|(pose, half)| {
            let half = half.map(|side| side + grow);
            half.iter().all(|side| *side >= 0.0)
                && segment_in_box(pose, half, from.point(), to.point())
                    .is_some_and(|(enter, leave)| leave >= 0.0 && enter <= 1.0)
        })
    };
    let (thinner, thicker) = (hit(-margin_m), hit(margin_m));
    (thinner == thicker).then_some(thinner)
}

/// Whether any box lies between an eye and a point: every box is tested, one ray each.
fn occluded(occluders: &Occluders, eye: &Position<Base>, point: &Position<Base>) -> bool {
    occluders.boxes().iter().any(|occluder| {
        let x_box_base = occluder.x_box_base();
        occluder.hides(&(x_box_base * *eye), &(x_box_base * *point))
    })
}

fn position() -> impl Strategy<Value = Position<Base>> {
    (-2.0..2.0, -2.0..2.0, -2.0..2.0).prop_map(|(x, y, z)| Position::new(x, y, z))
}

fn pose() -> impl Strategy<Value = Pose<Base, Thing>> {
    (position(), -3.0..3.0, -1.5..1.5, -3.0..3.0).prop_map(|(place, roll, pitch, yaw)| {
        let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        Pose::from_isometry(Isometry3::from_parts(Translation3::from(place.point()), turn))
    })
}

fn occluder() -> impl Strategy<Value = (Pose<Base, Thing>, [f64; 3])> {
    (pose(), 0.01..1.0, 0.01..1.0, 0.01..1.0).prop_map(|(pose, x, y, z)| (pose, [x, y, z]))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn occlusion_agrees_with_a_slab_test_written_independently(
        boxes in prop::collection::vec(occluder(), 0..5), from in position(), to in position(),
    ) {
        let mut occluders = Occluders::new(boxes.len());
        for (pose, half) in &boxes {
            occluders.add(pose, *half).unwrap();
        }
        if let Some(expected) = occluded_slowly(&boxes, from, to, 2e-4) {
            prop_assert_eq!(occluded(&occluders, &from, &to), expected);
        }
    }

    #[test]
    fn the_visible_share_counts_samples_in_the_cone_and_unoccluded(
        walls in prop::collection::vec(occluder(), 0..24),
        thing in pose(), x in 0.0..0.3, y in 0.01..0.3, z in 0.01..0.3,
        from in position(), towards in position(), half_angle in 0.1..3.0_f64, range_m in 0.5..4.0_f64,
        samples in prop::sample::select(vec![Samples::Centre, Samples::Faces, Samples::Corners, Samples::Surface]),
    ) {
        let eye = Pose::<Base, Eye>::looking(&from, &towards);
        let gaze = eye.isometry().rotation * nalgebra::Vector3::x();
        let mut occluders = Occluders::new(walls.len());
        for (wall, half) in &walls {
            occluders.add(wall, *half).unwrap();
        }
        let points = points(samples);
        let (mut seen, mut undecided) = (0_u8, 0_u8);
        for [i, j, k] in &points {
            let at = thing.isometry() * Point3::new(x * i, y * j, z * k);
            let to = at - from.point();
            let off = gaze.angle(&to);
            match occluded_slowly(&walls, from, Position::from_point(at), 2e-4) {
                Some(hidden) if (off - half_angle).abs() > 1e-6 && (to.norm() - range_m).abs() > 1e-6 => {
                    seen += u8::from(!hidden && off < half_angle && to.norm() < range_m);
                }
                _ => undecided += 1,
            }
        }
        let cone = Cone::new(half_angle, range_m).unwrap();
        // Views from an earlier pose must not affect the result.
        let mut sight = Sight::new(Pose::identity(), cone, &occluders);
        sight.update_view(&eye, &occluders);
        let count = sight.visible_share(&thing, [x, y, z], samples) * quantity::number::float_of_count(points.len());
        prop_assert!(count >= f64::from(seen) - 1e-9 && count <= f64::from(seen + undecided) + 1e-9,
            "{} of {}, expected {} to {}", count, points.len(), seen, seen + undecided);
        prop_assert_eq!(sight.sees(&thing.origin()), cone.contains(&(eye.inverse() * thing.origin()))
            && !occluded(&occluders, &from, &thing.origin()));
    }

    #[test]
    fn occlusion_by_many_small_walls_is_decided_by_the_rays(
        walls in prop::collection::vec((pose(), 0.005..0.05, 0.05..0.2, 0.05..0.2), 40..60),
        things in prop::collection::vec((pose(), 0.01..0.05), 20),
        from in position(), towards in position(),
    ) {
        let eye = Pose::<Base, Eye>::looking(&from, &towards);
        let cone = Cone::new(1.0, 5.0).unwrap();
        let mut occluders = Occluders::new(walls.len());
        for (wall, x, y, z) in &walls {
            occluders.add(wall, [*x, *y, *z]).unwrap();
        }
        let sight = Sight::new(eye, cone, &occluders);
        for (thing, half) in &things {
            // The rays of an unculled test, in the same precision.
            let corners = points(Samples::Corners);
            let seen = corners.iter().filter(|corner| {
                let [x, y, z] = corner.map(|side| side * half);
                let at = *thing * Position::new(x, y, z);
                cone.contains(&(eye.inverse() * at)) && !occluded(&occluders, &from, &at)
            });
            let (share, expected) = (sight.visible_share(thing, [*half; 3], Samples::Corners), seen.count());
            // The same rays in the same precision; only the order of the transforms differs, by about 1e-16 m.
            prop_assert!((share * 9.0 - quantity::number::float_of_count(expected)).abs() < 1e-9,
                "{} of 9, expected {}", share * 9.0, expected);
        }
    }
}

/// The sample points of a box, in half extents, computed independently.
fn points(samples: Samples) -> Vec<[f64; 3]> {
    let sides = [-1.0, 0.0, 1.0];
    let grid = sides.iter().flat_map(|x| sides.iter().flat_map(move |y| sides.map(|z| [*x, *y, z])));
    let order = |[x, y, z]: &[f64; 3]| x.abs() + y.abs() + z.abs();
    let wanted: &[f64] = match samples {
        Samples::Centre => &[0.0],
        Samples::Faces => &[0.0, 1.0],
        Samples::Corners => &[0.0, 3.0],
        Samples::Surface => &[1.0, 2.0, 3.0],
    };
    grid.filter(|point| wanted.iter().any(|faces| (order(point) - faces).abs() < 0.5)).collect()
}

#[test]
fn the_slab_test_of_these_tests_sees_both_answers() {
    let wall = (Pose::upright(1.0, 0.0, 0.0, 0.0), [0.1, 0.5, 0.5]);
    let eye = Position::new(0.0, 0.0, 0.0);
    assert_eq!(occluded_slowly(&[wall], eye, Position::new(2.0, 0.0, 0.0), 1e-4), Some(true));
    assert_eq!(occluded_slowly(&[wall], eye, Position::new(0.5, 0.0, 0.0), 1e-4), Some(false));
    assert_eq!(occluded_slowly(&[wall], eye, Position::new(2.0, 2.0, 0.0), 1e-4), Some(false));
}

#[test]
fn objects_before_a_wall_or_touching_it_are_not_hidden() {
    let mut occluders = Occluders::new(1);
    occluders.add(&Pose::upright(1.0, 0.0, 0.0, 0.0), [0.1, 0.5, 0.5]).unwrap();
    let eye = Position::new(0.0, 0.0, 0.0);
    assert!(!occluded(&occluders, &eye, &Position::new(0.8, 0.0, 0.0)));
    assert!(!occluded(&occluders, &eye, &Position::new(0.9, 0.0, 0.0)));
    assert!(occluded(&occluders, &eye, &Position::new(1.0, 0.0, 0.0)));
    assert!(occluded(&occluders, &eye, &Position::new(1.1, 0.0, 0.0)));
}

#[test]
fn a_full_occluder_set_and_invalid_extents_are_refused() {
    let mut occluders = Occluders::new(1);
    assert!(matches!(
        occluders.add(&Pose::identity(), [f64::NAN, 1.0, 1.0]),
        Err(OccluderError::Extents { .. })
    ));
    assert!(occluders.is_empty());
    occluders.add(&Pose::identity(), [1.0, 1.0, 1.0]).unwrap();
    assert_eq!(occluders.add(&Pose::identity(), [1.0, 1.0, 1.0]), Err(OccluderError::Full { capacity: 1 }));
    occluders.clear();
    assert_eq!(occluders.len(), 0);
}

#[test]
fn an_invalid_cone_is_refused() {
    assert!(matches!(Cone::new(f64::NAN, 1.0), Err(ConeError::HalfAngle { .. })));
    assert!(matches!(Cone::new(0.0, 1.0), Err(ConeError::HalfAngle { .. })));
    assert!(matches!(Cone::new(1.0, f64::INFINITY), Err(ConeError::Range { .. })));
}

#[test]
fn an_invalid_place_is_not_visible() {
    let occluders = Occluders::new(0);
    let cone = Cone::new(std::f64::consts::PI, 100.0).unwrap();
    let sight = Sight::new(Pose::identity(), cone, &occluders);
    assert!(sight.sees(&Position::new(1.0, 0.0, 0.0)));
    assert!(!sight.sees(&Position::new(f64::NAN, 0.0, 0.0)));
}

//! Cost of one visibility test of many things behind many walls: `cargo bench -p leo-scene`.
//!
//! Blocks are scattered over a table, with low walls between them, all with random orientations; the eye is at the
//! edge. A run updates the view and computes the visible share of every block from nine points. The same run also
//! measures the test by brute force: every point against every wall by the slab test, in double precision.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::hint::black_box;

use geometry::{Base, Eye, Pose, Position, Thing};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use quantity::number::{float, floor_usize};
use scene::{Cone, Occluders, Samples, Sight};

type Box3 = (Pose<Base, Thing>, [f64; 3]);

/// Reproducible numbers in [0, 1): the upper bits of a linear congruential generator.
struct Dice(u64);

impl Dice {
    fn throw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        float(self.0 >> 11) / float(1 << 53)
    }

    fn between(&mut self, min: f64, max: f64) -> f64 {
        min + self.throw() * (max - min)
    }

    /// A random pose on the table.
    fn place(&mut self, height_m: f64, tilt_rad: f64) -> Pose<Base, Thing> {
        let turn = UnitQuaternion::from_euler_angles(
            self.between(-tilt_rad, tilt_rad),
            self.between(-tilt_rad, tilt_rad),
            self.between(-3.1, 3.1),
        );
        let at = Translation3::new(self.between(0.0, 2.5), self.between(-1.5, 1.5), height_m);
        Pose::from_isometry(Isometry3::from_parts(at, turn))
    }
}

fn main() {
    let mut dice = Dice(2006);
    println!("one visibility test, us: p50, p99, p99.9, max; then the same by brute force");
    for objects in [16_usize, 64, 256, 1000, 10_000] {
        for walls in [0_usize, 4, 16, 50] {
            let things: Vec<Box3> =
                (0..objects).map(|_| (dice.place(0.03, 3.1), [0.03, 0.03, 0.03])).collect();
            let walls: Vec<Box3> = (0..walls).map(|_| (dice.place(0.1, 0.3), [0.01, 0.15, 0.1])).collect();
            compare(&things, &walls);
        }
    }
}

fn compare(things: &[Box3], walls: &[Box3]) {
    let x_base_eye = Pose::<Base, Eye>::looking(&Position::new(3.0, 0.0, 0.6), &Position::new(1.0, 0.0, 0.0));
    let (half_angle_rad, range_m) = (60_f64.to_radians(), 5.0);
    let cone = Cone::new(half_angle_rad, range_m).expect("a cone");
    let mut occluders = Occluders::new(walls.len().max(1));
    for (pose, half) in walls {
        occluders.add(pose, *half).expect("there is room");
    }
    let looks = 4_000_000 / (things.len() * (walls.len() + 4));
    let (mut seen, mut costs) = (0.0, Vec::new());
    let mut sight = Sight::new(Pose::identity(), cone, &occluders);
    for _ in 0..looks.clamp(50, 4000) {
        let started = clock::now();
        sight.update_view(&x_base_eye, &occluders);
        seen = things
            .iter()
            .map(|(pose, half)| black_box(&sight).visible_share(pose, *half, Samples::Corners))
            .sum();
        costs.push(clock::nanos(clock::now().since(started)));
    }
    let (mut by_force, mut costs_by_force) = (0, Vec::new());
    for _ in 0..(looks / 10).clamp(5, 100) {
        let started = clock::now();
        by_force = brute_force(&x_base_eye, half_angle_rad.cos(), range_m, things, walls);
        costs_by_force.push(clock::nanos(clock::now().since(started)));
    }
    print!("{:6} things, {:2} walls, {:4.1} % seen:", things.len(), walls.len(), {
        100.0 * seen / quantity::number::float_of_count(things.len())
    });
    report(costs);
    print!("   by force");
    report(costs_by_force);
    println!();
    let difference = seen - float(by_force) / 9.0;
    assert!(difference.abs() * 9.0 < 2.0, "the results differ: {difference}");
}

fn report(mut nanos: Vec<u64>) {
    nanos.sort_unstable();
    for share in [0.5, 0.99, 0.999, 1.0] {
        let index = floor_usize(quantity::number::float_of_count(nanos.len() - 1) * share);
        print!(" {:9.1}", float(nanos.get(index).copied().unwrap_or(0)) / 1000.0);
    }
}

/// Number of visible points over all things, of nine each.
fn brute_force(eye: &Pose<Base, Eye>, cos: f64, range_m: f64, things: &[Box3], walls: &[Box3]) -> u64 {
    let from = eye.origin().point();
    let forward = eye.isometry().rotation * nalgebra::Vector3::x();
    let mut seen = 0;
    for (pose, [x, y, z]) in things {
        for point in 0..9_u8 {
            let sign = |bit: u8| {
                if point == 8 {
                    0.0
                } else if point & bit == 0 {
                    -1.0
                } else {
                    1.0
                }
            };
            let to = pose.isometry() * Point3::new(x * sign(1), y * sign(2), z * sign(4));
            let along = to - from;
            let in_cone = along.norm() <= range_m && along.dot(&forward) >= cos * along.norm();
            let reach = 1.0 - 1e-4 / along.norm();
            seen += u64::from(in_cone && !walls.iter().any(|wall| crosses(wall, from, to, reach)));
        }
    }
    seen
}

/// The slab test: whether the segment between two points enters a box before the share `reach` of its length.
fn crosses((pose, half): &Box3, from: Point3<f64>, to: Point3<f64>, reach: f64) -> bool {
    let from = pose.isometry().inverse_transform_point(&from);
    let along = pose.isometry().inverse_transform_point(&to) - from;
    let (mut enter, mut leave) = (0.0_f64, reach);
    for ((from, along), half) in from.iter().zip(along.iter()).zip(half) {
        let (a, b) = ((-half - from) / along, (half - from) / along);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    enter <= leave
}

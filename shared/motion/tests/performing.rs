//! Skills performed by a body that follows its goals exactly, or within its limits.
#![expect(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "helpers of tests may fail them"
)]

mod leo;

use std::path::Path;
use std::sync::LazyLock;

use clock::{Duration, Instant};
use config::lesson::{Lesson, Object, Role, Table};
use geometry::{Base, Pose, Position, World};
use kinematics::Side;
use leo::{LEO, MOTOR};
use motion::{Face, FailureReason, Performer, Phase, Progress, Skill, SkillError, Turn};
use servo::{Limits, Motion};

const PERIOD: Duration = Duration::from_millis(20);
/// Cycle period of the motor process.
const CYCLE: Duration = Duration::from_millis(4);
const HALF_HEIGHT_M: f64 = 0.04;

static SERVOS: LazyLock<Vec<config::motor::Joint>> =
    LazyLock::new(|| config::motor::parse(MOTOR, Path::new("motor.toml")).expect("right").joints);

/// How joints follow their goals.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Follow {
    /// Joints are at their goals at once.
    Exactly,
    /// Trapezoidal profiles within velocity and acceleration limits, in cycles of the motor process.
    WithinLimits,
}

/// The simulator's grasping rules, and joints that follow their goals.
struct Stand {
    follow: Follow,
    motions: Vec<Motion>,
    performer: Performer,
    now: Instant,
    present: Vec<Option<f64>>,
    peg: Position<Base>,
    /// The hand that holds the peg, and the peg's offset from its grasp point.
    held: Option<(Side, nalgebra::Vector3<f64>)>,
    dropped: Option<Position<Base>>,
}

impl Stand {
    fn new(peg: Position<Base>) -> Self {
        let performer = Performer::new(&LEO.body, &LEO.rest_rad, PERIOD * 2).expect("a whole body");
        let present = LEO.rest_rad.iter().copied().map(Some).collect();
        Self {
            follow: Follow::Exactly,
            motions: LEO.rest_rad.iter().copied().map(Motion::at).collect(),
            performer,
            now: Instant::from_nanos(1_000),
            present,
            peg,
            held: None,
            dropped: None,
        }
    }

    /// Moves the joints until the next step.
    fn follow(&mut self) {
        for goal in self.performer.goals() {
            let joint = usize::try_from(goal.joint).expect("small");
            if self.follow == Follow::WithinLimits {
                let settings = &SERVOS[joint];
                let limits = Limits {
                    velocity_rad_s: settings.max_velocity_rad_s,
                    acceleration_rad_s2: settings.max_acceleration_rad_s2,
                };
                let mut motion = self.motions[joint];
                for cycle in 0..PERIOD.as_millis() / CYCLE.as_millis() {
                    let at = self.now + CYCLE * u32::try_from(cycle).expect("small");
                    let within_s = Instant::from_nanos(goal.arrive_at_ns).since(at).as_secs_f64();
                    let velocity_rad_s = motion.cruise(goal.goal_position_rad, limits, within_s);
                    let cruising = Limits { velocity_rad_s, ..limits };
                    motion = motion
                        .towards(goal.goal_position_rad, cruising, CYCLE.as_secs_f64())
                        .expect("numbers");
                }
                self.motions[joint] = motion;
                self.present[joint] = Some(motion.position_rad);
            } else {
                self.present[joint] = Some(goal.goal_position_rad);
            }
        }
    }

    fn positions(&self) -> Vec<f64> {
        self.present.iter().map(|position| position.expect("all are known")).collect()
    }

    fn hand(&self, side: Side) -> Position<Base> {
        LEO.body.hand(side, &self.positions()).origin()
    }

    fn closure(&self, side: Side) -> f64 {
        let pitch = ["index", "middle", "ring", "little"].map(|finger| {
            let joint = LEO.body.joint(&format!("{}_{finger}_pitch_joint", side.name())).expect("a finger");
            self.present[joint].expect("all are known")
        });
        pitch.iter().sum::<f64>() / 4.0
    }

    fn step(&mut self) -> Progress {
        let progress = self.performer.step(self.now, &self.present);
        self.follow();
        self.now += PERIOD;
        for side in Side::BOTH {
            let (hand, closure) = (self.hand(side), self.closure(side));
            match self.held {
                None if closure > 0.7 && hand.distance(&self.peg) < 0.03 => {
                    self.held = Some((side, self.peg.point() - hand.point()));
                }
                Some((holder, offset)) if holder == side => {
                    self.peg = Position::from_point(hand.point() + offset);
                    if closure < 0.5 {
                        self.held = None;
                        self.dropped = Some(self.peg);
                    }
                }
                _ => {}
            }
        }
        progress
    }

    /// Performs a skill to its end. `look` is called with the stand and the phase after every step.
    fn perform(&mut self, skill: &Skill, mut look: impl FnMut(&Self, Phase)) -> Progress {
        self.performer.begin(self.now, skill, &self.present).expect("within reach");
        for _step in 0..5_000 {
            match self.step() {
                Progress::Running { phase } => look(self, phase),
                end @ (Progress::Idle | Progress::Done | Progress::Failed { .. }) => return end,
            }
        }
        panic!("{skill:?} does not end");
    }
}

fn insert(peg: Position<Base>, hole: Position<Base>) -> Skill {
    Skill::Insert { thing: peg, half_height_m: HALF_HEIGHT_M, hole }
}

/// Performs an insertion and checks every step. Returns its duration.
fn check_insertion(peg: Position<Base>, hole: Position<Base>, follow: Follow) -> Duration {
    let mut stand = Stand { follow, ..Stand::new(peg) };
    let begun = stand.now;
    let mut seen = Vec::new();
    let mut before: Option<[Position<Base>; 2]> = None;
    let end = stand.perform(&insert(peg, hole), |stand, phase| {
        if seen.last() != Some(&phase) {
            seen.push(phase);
        }
        let hands = Side::BOTH.map(|side| stand.hand(side));
        let lowest = hands.iter().map(|hand| hand.point().z).fold(f64::INFINITY, f64::min);
        let [at_peg, at_hole] = [peg, hole].map(|place| {
            hands.iter().map(|hand| (hand.point() - place.point()).xy().norm()).fold(f64::INFINITY, f64::min)
        });
        match phase {
            Phase::Descend | Phase::Close | Phase::Lift => {
                assert!(at_peg < 0.01, "{phase:?} {at_peg} m aside");
            }
            Phase::Lower | Phase::Open | Phase::Retreat => {
                assert!(at_hole < 0.01, "{phase:?} {at_hole} m aside");
            }
            Phase::Look
            | Phase::Raise
            | Phase::Ready
            | Phase::Hover
            | Phase::Carry
            | Phase::Rest
            | Phase::Face => {
                assert!(lowest > 0.15, "{phase:?} at {lowest} m, {peg:?} to {hole:?}");
            }
        }
        if phase == Phase::Carry {
            assert!(stand.held.is_some(), "carries nothing");
            assert!(stand.peg.point().z - HALF_HEIGHT_M > 0.10, "the peg sweeps the blocks");
        }
        // A joint that jumps to another solution would throw the hand.
        if let Some(before) = before {
            let furthest = before.iter().zip(&hands).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
            assert!(furthest < 0.04, "{phase:?}: {furthest} m in one step");
        }
        before = Some(hands);
    });
    assert_eq!(end, Progress::Done);
    assert!(seen.ends_with(&[
        Phase::Look,
        Phase::Ready,
        Phase::Hover,
        Phase::Descend,
        Phase::Close,
        Phase::Lift,
        Phase::Carry,
        Phase::Lower,
        Phase::Open,
        Phase::Retreat,
        Phase::Rest
    ]));
    let dropped = stand.dropped.expect("the peg was let go");
    let lower_end_m = dropped.point().z - HALF_HEIGHT_M;
    assert!((dropped.point() - hole.point()).xy().norm() < 0.005, "{dropped:?} beside {hole:?}");
    assert!((0.005..0.06).contains(&(hole.point().z - lower_end_m)), "{lower_end_m} m in {hole:?}");
    let resting = stand.positions().iter().zip(&LEO.rest_rad).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // A skill is done when the joints are nearly there.
    let nearly_rad = if follow == Follow::Exactly { 1e-9 } else { 0.05 };
    assert!(resting < nearly_rad, "{resting} rad from rest");
    stand.now.since(begun)
}

/// Insertions all over the table. Returns their number and the longest duration.
fn check_insertions(follow: Follow) -> (u32, Duration) {
    let mut longest = Duration::ZERO;
    let mut seen = 0;
    for peg_x in [0.27, 0.38, 0.49] {
        for peg_y in [-0.28, -0.10, 0.05, 0.28] {
            for (hole_x, hole_y) in [(0.30, 0.12), (0.45, -0.02), (0.36, -0.25)] {
                let peg = Position::new(peg_x, peg_y, HALF_HEIGHT_M);
                longest = longest.max(check_insertion(peg, Position::new(hole_x, hole_y, 0.05), follow));
                seen += 1;
            }
        }
    }
    (seen, longest)
}

#[test]
fn pegs_are_inserted_without_sweeping_over_other_objects() {
    let (seen, longest) = check_insertions(Follow::Exactly);
    assert_eq!(seen, 36);
    println!("the longest takes {longest:?}");
}

#[test]
fn joints_that_accelerate_and_brake_stay_on_the_path() {
    let (seen, longest) = check_insertions(Follow::WithinLimits);
    assert_eq!(seen, 36);
    println!("the longest takes {longest:?}");
}

#[test]
fn an_object_is_placed_at_the_requested_position() {
    let (thing, to) = (Position::new(0.32, 0.2, 0.03), Position::new(0.42, 0.0, 0.09));
    let mut stand = Stand::new(thing);
    assert_eq!(
        stand.perform(&Skill::Place { thing, half_height_m: 0.03, to, turn: None }, |_, _| {}),
        Progress::Done
    );
    assert!(stand.dropped.expect("it was let go").distance(&to) < 1e-3);
}

/// Rotation of a hand about the vertical in radians, by the direction of its palm.
fn turned_rad(stand: &Stand, side: Side) -> f64 {
    let palm = LEO.body.hand(side, &stand.positions()).isometry().rotation * nalgebra::Vector3::y();
    palm.y.atan2(palm.x)
}

#[test]
fn an_object_is_turned_as_requested_while_carried() {
    let half_turn = std::f64::consts::PI;
    for (from_y, to_y) in [(0.25, 0.0), (-0.2, 0.2), (0.05, 0.25), (-0.28, -0.1), (0.1, -0.26)] {
        for degrees in [0.0, 90.0, -90.0, 35.0, 135.0] {
            let (thing, to) = (Position::new(0.30, from_y, 0.02), Position::new(0.44, to_y, 0.02));
            let by_rad = f64::to_radians(degrees);
            let turn = Some(Turn { by_rad, period_rad: half_turn });
            let mut stand = Stand::new(thing);
            let (mut held, mut grasped_rad, mut let_go_rad) = (None, f64::NAN, f64::NAN);
            let end =
                stand.perform(&Skill::Place { thing, half_height_m: 0.02, to, turn }, |stand, phase| {
                    held = held.or(stand.held.map(|(side, _)| side));
                    let Some(side) = held else { return };
                    if phase == Phase::Close {
                        grasped_rad = turned_rad(stand, side);
                    } else if phase == Phase::Lower {
                        let_go_rad = turned_rad(stand, side);
                    }
                });
            assert_eq!(end, Progress::Done);
            assert!(stand.dropped.expect("it was let go").distance(&to) < 1e-3);
            let missed = (let_go_rad - grasped_rad - by_rad).rem_euclid(half_turn);
            assert!(missed.min(half_turn - missed) < 0.01, "{degrees} from {from_y} to {to_y}: {missed}");
        }
    }
}

#[test]
fn both_eyes_look_at_a_point() {
    let mut stand = Stand::new(Position::new(0.0, 0.0, 0.0));
    for target in [Position::new(0.4, 0.3, 0.0), Position::new(0.3, -0.25, 0.1), Position::new(1.5, 0.4, 0.9)]
    {
        assert_eq!(stand.perform(&Skill::LookAt(target), |_, _| {}), Progress::Done);
        for side in Side::BOTH {
            let eye = LEO.body.eye(side, &stand.positions());
            let [x, y, z] = (eye.inverse() * target).to_array();
            assert!(x > 0.0 && y.hypot(z) < 0.01 * x, "{side:?} eye misses {target:?}: {y} {z} at {x}");
        }
    }
}

#[test]
fn facial_expressions_differ_and_end() {
    let mut stand = Stand::new(Position::new(0.0, 0.0, 0.0));
    let mut faces = Vec::new();
    for face in [Face::Attentive, Face::Puzzled, Face::Pleased, Face::Neutral] {
        assert_eq!(
            stand.perform(&Skill::Show(face), |_, phase| assert_eq!(phase, Phase::Face)),
            Progress::Done
        );
        faces.push(stand.positions());
    }
    for (number, face) in faces.iter().enumerate() {
        assert!(!faces[..number].contains(face), "face {number} is one before");
    }
    assert_eq!(faces[3], LEO.rest_rad);
}

#[test]
fn an_aborted_skill_retreats_upwards() {
    let peg = Position::new(0.4, 0.1, HALF_HEIGHT_M);
    let mut stand = Stand::new(peg);
    stand
        .performer
        .begin(stand.now, &insert(peg, Position::new(0.35, 0.25, 0.05)), &stand.present)
        .expect("in reach");
    while stand.step() != (Progress::Running { phase: Phase::Close }) {}
    let place = stand.hand(Side::Left);
    assert!(place.point().z < 0.06);
    let mut raised = false;
    let end = stand.perform(&Skill::Rest, |stand, phase| {
        let hand = stand.hand(Side::Left);
        if phase == Phase::Raise {
            raised = true;
            assert!((hand.point() - place.point()).xy().norm() < 0.01, "{hand:?} leaves {place:?} sideways");
        } else {
            assert!(hand.point().z > 0.15, "{phase:?} at {hand:?}");
        }
    });
    assert!(raised);
    assert_eq!(end, Progress::Done);
}

#[test]
fn an_unreachable_goal_is_refused_before_any_motion() {
    let mut stand = Stand::new(Position::new(0.0, 0.0, 0.0));
    let peg = Position::new(0.4, 0.1, HALF_HEIGHT_M);
    let far = stand.performer.begin(stand.now, &insert(peg, Position::new(1.5, 0.0, 0.05)), &stand.present);
    assert!(matches!(far, Err(SkillError::Unreachable { phase: Phase::Carry, .. })), "{far:?}");
    let nonsense = insert(peg, Position::new(f64::NAN, 0.0, 0.05));
    assert_eq!(stand.performer.begin(stand.now, &nonsense, &stand.present), Err(SkillError::NotFinite));
    assert_eq!(stand.step(), Progress::Idle);
    assert!(stand.performer.goals().is_empty());
}

#[test]
fn a_lagging_joint_fails_the_phase_but_a_silent_neck_does_not() {
    let peg = Position::new(0.4, 0.1, HALF_HEIGHT_M);
    let skill = insert(peg, Position::new(0.35, 0.25, 0.05));
    let elbow = LEO.body.joint("left_elbow_pitch_joint").expect("an elbow");
    let neck = LEO.body.joint("neck_yaw_joint").expect("a neck");
    let outcome = |joint: usize, reading: Option<f64>| {
        let mut stand = Stand::new(peg);
        stand.performer.begin(stand.now, &skill, &stand.present).expect("in reach");
        loop {
            let mut present = stand.present.clone();
            present[joint] = reading;
            let progress = stand.performer.step(stand.now, &present);
            for goal in stand.performer.goals() {
                stand.present[usize::try_from(goal.joint).expect("small")] = Some(goal.goal_position_rad);
            }
            stand.now += PERIOD;
            if !matches!(progress, Progress::Running { .. }) {
                return progress;
            }
        }
    };
    let stuck = outcome(elbow, Some(LEO.rest_rad[elbow]));
    assert!(
        matches!(stuck, Progress::Failed { phase: Phase::Ready, why: FailureReason::Late { joint, .. } } if joint == elbow)
    );
    let nan = outcome(elbow, Some(f64::NAN));
    assert!(matches!(nan, Progress::Failed { why: FailureReason::Late { joint, .. }, .. } if joint == elbow));
    let silent = outcome(elbow, None);
    assert_eq!(silent, Progress::Failed { phase: Phase::Ready, why: FailureReason::Silent { joint: elbow } });
    assert_eq!(outcome(neck, None), Progress::Done);
}

#[test]
fn joint_goals_respect_position_and_speed_limits() {
    let peg = Position::new(0.45, -0.2, HALF_HEIGHT_M);
    let mut stand = Stand::new(peg);
    let mut before = LEO.rest_rad.clone();
    let mut seen = 0;
    stand.perform(&insert(peg, Position::new(0.3, 0.0, 0.05)), |stand, _| {
        let goals: Vec<f64> = stand.performer.goals().iter().map(|goal| goal.goal_position_rad).collect();
        assert_eq!(goals.len(), 65);
        for ((joint, goal), before) in LEO.body.joints().iter().zip(&goals).zip(&before) {
            assert!((joint.lower_rad..=joint.upper_rad).contains(goal), "{} to {goal}", joint.name);
            let speed = (goal - before).abs() / PERIOD.as_secs_f64();
            assert!(speed <= joint.velocity_rad_s, "{} at {speed} rad/s", joint.name);
            seen += usize::from(speed > 0.0);
        }
        before = goals;
    });
    assert!(seen > 1_000, "hardly anything moved: {seen}");
}

#[test]
fn the_bus_file_and_the_body_agree() {
    let motor = config::motor::parse(MOTOR, Path::new("motor.toml")).expect("right");
    assert_eq!(motor.joints.len(), 65);
    assert_eq!(
        motor.buses.iter().map(|bus| bus.name.as_str()).collect::<Vec<_>>(),
        ["face_left", "face_right", "left_arm", "right_arm", "torso"]
    );
    let on = |bus: usize| motor.joints.iter().filter(|joint| joint.bus == bus).count();
    assert_eq!([on(0), on(1), on(2), on(3), on(4)], [16, 16, 13, 13, 7]);
    for (servo, joint) in motor.joints.iter().zip(LEO.body.joints()) {
        assert_eq!(servo.name, joint.name);
        let said = [servo.min_rad, servo.max_rad, servo.max_velocity_rad_s].map(f64::to_bits);
        let limits = [joint.lower_rad, joint.upper_rad, joint.velocity_rad_s].map(f64::to_bits);
        assert_eq!(said, limits, "{}", joint.name);
        let rest = servo.joint_rad(0.0);
        assert!((joint.lower_rad..=joint.upper_rad).contains(&rest), "{} rests at {rest}", joint.name);
    }
}

/// Plans what a lesson may ask for: every peg into every hole, and every marker onto every block that carries one.
/// Returns their number.
fn check_table(table: &Table, x_base_world: &Pose<Base, World>) -> usize {
    let place = |object: &Object| *x_base_world * Position::from_point(object.place.position_m.into());
    let performer = Stand::new(Position::new(0.0, 0.0, 0.0));
    let mut seen = 0;
    for thing in table.objects.iter().filter(|object| object.kind.role != Role::Block) {
        for block in &table.objects {
            let half_height_m = thing.kind.half_extents_m[2];
            let [x, y, z] = place(block).to_array();
            let top = Position::new(x, y, z + block.kind.half_extents_m[2]);
            let skill = match thing.kind.role {
                Role::Peg if block.kind.hole => {
                    Skill::Insert { thing: place(thing), half_height_m, hole: top }
                }
                Role::Marker if block.kind.markable => {
                    let to = Position::from_point(top.point() + nalgebra::Vector3::z() * half_height_m);
                    Skill::Place { thing: place(thing), half_height_m, to, turn: None }
                }
                Role::Peg | Role::Marker | Role::Block => continue,
            };
            let begun = performer.performer.clone().begin(performer.now, &skill, &performer.present);
            assert_eq!(begun, Ok(()), "`{}` to `{}`", thing.name, block.name);
            seen += 1;
        }
    }
    seen
}

#[test]
fn every_lesson_is_within_leos_reach() {
    let lessons = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/lessons");
    let mut seen = 0;
    for file in std::fs::read_dir(lessons).expect("there are lessons") {
        let lesson = Lesson::load(&file.expect("a file").path()).expect("a lesson");
        let [x, y, z] = lesson.robot.position_m;
        let x_world_base = Pose::<World, Base>::upright(x, y, z, lesson.robot.heading_rad);
        seen += lesson.novel.iter().map(|table| check_table(table, &x_world_base.inverse())).sum::<usize>();
    }
    assert!(seen > 0, "no lesson asks for anything");
}

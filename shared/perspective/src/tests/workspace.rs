//! A workspace for the tests: things, a robot and a partner, in steps of 5 ms.

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use geometry::{Base, Eye, Pose, Position};
use message::{Belief, Feature, Header, NOBODY, Observation, ObservationKind, Perceived, SourceSet, State};
use perception::{Frame, Perception};
use quantity::number::single;

use crate::settings::Perspective;
use crate::{Partner, Robot};

pub(super) const STEP: Duration = Duration::from_millis(5);
/// The teacher's eyes opposite the robot, and the point they look at while teaching.
pub(super) const EYES: [f64; 3] = [1.5, 0.0, 0.55];
pub(super) const TABLE: [f64; 3] = [0.75, 0.0, 0.0];
/// Behind the teacher.
pub(super) const AWAY: [f64; 3] = [3.0, 0.0, 0.55];

pub(super) struct Workspace {
    pub(super) percepts: Percepts,
    perception: Perception,
    pub(super) robot: Robot,
    pub(super) partner: Partner,
    pub(super) now: Instant,
    /// Latency of the source.
    pub(super) delay: Duration,
}

impl Workspace {
    pub(super) fn new() -> Self {
        Self::with(&Perspective::builtin())
    }

    pub(super) fn with(config: &Perspective) -> Self {
        Self::perceiving(Percepts::builtin(), config)
    }

    /// With other percepts than the built-in ones.
    pub(super) fn perceiving(percepts: Percepts, config: &Perspective) -> Self {
        Self::with_room(percepts, config, 16)
    }

    /// With another capacity.
    pub(super) fn with_room(percepts: Percepts, config: &Perspective, capacity: usize) -> Self {
        let perception = Perception::new(&percepts).unwrap();
        let robot = Robot::new(&percepts, config, 1, capacity).unwrap();
        let partner = Partner::new(1, perception.clone(), &percepts, config, capacity).unwrap();
        Self {
            percepts,
            perception,
            robot,
            partner,
            now: Instant::from_nanos(1_000_000_000),
            delay: Duration::ZERO,
        }
    }

    /// Runs a step with these observations.
    pub(super) fn step(&mut self, things: &[Observation]) {
        self.step_looking(SourceSet::of(0), things);
    }

    /// Runs a step without a frame of any source.
    pub(super) fn step_blindly(&mut self) {
        self.step_looking(SourceSet::EMPTY, &[]);
    }

    /// Runs a step in which `active_sources` delivered these observations.
    pub(super) fn step_looking(&mut self, active_sources: SourceSet, things: &[Observation]) {
        self.step_after(STEP, active_sources, things);
    }

    /// As [`Self::step_looking`], with another step length.
    pub(super) fn step_after(&mut self, time: Duration, active_sources: SourceSet, things: &[Observation]) {
        self.now += time;
        let entries: Vec<_> = things
            .iter()
            .map(|thing| {
                let observed_at_ns = (self.now - self.delay).as_nanos();
                let observation = Observation { observed_at_ns, ..*thing };
                let snapshot = self.perception.perceive(&observation, &Frame { agent: 0 });
                Perceived { observation, snapshot }
            })
            .collect();
        self.robot.step(self.now, active_sources, &entries);
        let robot = &self.robot;
        self.partner
            .step(self.now, &entries, robot.perceptual_context(), |place| robot.is_fully_in_view(place));
    }

    /// Repeats steps for `time`.
    pub(super) fn run(&mut self, time: Duration, things: &[Observation]) {
        let end = self.now + time;
        while self.now < end {
            self.step(things);
        }
    }

    /// The robot's overflow count.
    pub(super) fn overflowed(&self) -> u64 {
        self.robot.head(Header::default()).overflowed
    }

    /// The robot's beliefs.
    pub(super) fn robots(&self) -> Vec<Belief> {
        (0..self.robot.beliefs().len()).map(|index| self.robot.entry(index).unwrap()).collect()
    }

    /// The partner's modelled beliefs.
    pub(super) fn his(&self) -> Vec<Belief> {
        (0..self.partner.beliefs().len()).map(|index| self.partner.entry(index).unwrap()).collect()
    }

    /// Position of a partner's belief, in the base frame.
    pub(super) fn his_place(&self, belief: &Belief) -> Position<Base> {
        let [x, y, z] = self.position(belief).map(f64::from);
        self.partner.frame().unwrap() * Position::new(x, y, z)
    }

    /// The remembered position, in the frame of its perspective.
    pub(super) fn position(&self, belief: &Belief) -> [f32; 3] {
        match self.feature(belief, "position") {
            Some(Feature::Vector(position_m)) => position_m,
            other => panic!("a belief of the tests has a position, not {other:?}"),
        }
    }

    pub(super) fn number(&self, belief: &Belief, percept: &str) -> Option<f32> {
        match self.feature(belief, percept) {
            Some(Feature::Number(number)) => Some(number),
            _ => None,
        }
    }

    fn feature(&self, belief: &Belief, percept: &str) -> Option<Feature> {
        belief.percept(self.percepts.index(percept).unwrap()).and_then(message::Remembered::feature)
    }
}

/// Whether a partner was present at the last step.
pub(super) fn is_present(partner: &Partner) -> bool {
    partner.head(Header::default()).present == 1
}

/// A red cube.
pub(super) fn block(position_m: [f32; 3]) -> Observation {
    Observation {
        position_m,
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        shape: [0.0; 4],
        half_extents_m: [0.03; 3],
        colour_rgb: [0.8, 0.05, 0.05],
        confidence: 0.95,
        ..Observation::object(0, 0)
    }
}

/// A button with state `on`.
pub(super) fn button(on: f32) -> Observation {
    let mut button = block([0.6, 0.0, 0.03]);
    button.set_state(State::On, on);
    button
}

/// The teacher, with eyes at `from` looking at `towards`.
pub(super) fn person(from: [f64; 3], towards: [f64; 3]) -> Observation {
    let position = |[x, y, z]: [f64; 3]| Position::<Base>::new(x, y, z);
    let eye = Pose::<Base, Eye>::looking(&position(from), &position(towards));
    Observation {
        kind: ObservationKind::Person.raw(),
        partner: 1,
        position_m: eye.position_m().map(single),
        orientation_xyzw: eye.orientation_xyzw().map(single),
        held_by: NOBODY,
        ..Observation::object(0, 0)
    }
}

/// A barrier that hides what lies beyond it.
pub(super) fn wall(position_m: [f32; 3]) -> Observation {
    Observation {
        kind: ObservationKind::Occluder.raw(),
        position_m,
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        half_extents_m: [0.01, 0.18, 0.125],
        ..Observation::object(0, 0)
    }
}

//! The robot and all perspectives nested in its own, in steps of 5 ms.

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use geometry::{Base, Pose, Position, Thing};
use message::{Belief, Feature, Observation, ObservationKind, Perceived, Remembered, SourceSet};
use perception::{Frame, Perception};
use quantity::number::single;

use super::workspace::STEP;
use crate::settings::Perspective;
use crate::{NestedPerspective, Partner, PerceptualContext, Robot};

pub(super) const CAPACITY: usize = 16;

pub(super) struct Minds {
    pub(super) percepts: Percepts,
    perception: Perception,
    pub(super) robot: Robot,
    pub(super) all: Vec<(NestedPerspective, Partner)>,
    pub(super) now: Instant,
}

impl Minds {
    pub(super) fn new(partners: u16, depth: u32) -> Self {
        Self::with(&Perspective::builtin(), partners, depth)
    }

    pub(super) fn with(config: &Perspective, partners: u16, depth: u32) -> Self {
        Self::perceiving(Percepts::builtin(), config, partners, depth)
    }

    /// With other percepts than the built-in ones.
    pub(super) fn perceiving(percepts: Percepts, config: &Perspective, partners: u16, depth: u32) -> Self {
        let perception = Perception::new(&percepts).unwrap();
        let robot = Robot::new(&percepts, config, partners, CAPACITY).unwrap();
        let partner = |nested: NestedPerspective| {
            let agent = nested.path.agent().unwrap();
            let partner = Partner::new(agent, perception.clone(), &percepts, config, CAPACITY).unwrap();
            (nested, partner.with_perceptual_context(config, partners, CAPACITY))
        };
        let all = NestedPerspective::all(u32::from(partners), depth)
            .unwrap()
            .into_iter()
            .skip(1)
            .map(partner)
            .collect();
        Self { percepts, perception, robot, all, now: Instant::from_nanos(1_000_000_000) }
    }

    /// Runs a step in which `active_sources` delivered these observations; returns the percepts.
    pub(super) fn step_looking(
        &mut self,
        active_sources: SourceSet,
        things: &[Observation],
    ) -> Vec<Perceived> {
        self.step_after(STEP, active_sources, things)
    }

    /// As [`Self::step_looking`], with another step length.
    pub(super) fn step_after(
        &mut self,
        time: Duration,
        active_sources: SourceSet,
        things: &[Observation],
    ) -> Vec<Perceived> {
        self.now += time;
        let entries: Vec<_> = things
            .iter()
            .map(|thing| {
                let observation = Observation { observed_at_ns: self.now.as_nanos(), ..*thing };
                let snapshot = self.perception.perceive(&observation, &Frame { agent: 0 });
                Perceived { observation, snapshot }
            })
            .collect();
        self.robot.step(self.now, active_sources, &entries);
        for index in 0..self.all.len() {
            let (earlier, rest) = self.all.split_at_mut(index);
            let (nested, partner) = &mut rest[0];
            let parent = match nested.within {
                0 => self.robot.perceptual_context(),
                number => earlier[number - 1].1.perceptual_context().unwrap(),
            };
            let robot = &self.robot;
            let surveyed = |place: &Position<Base>| lineage_surveys(robot, earlier, nested.within, place);
            partner.step(self.now, &entries, parent, surveyed);
        }
        entries
    }

    /// Repeats steps for `time`.
    pub(super) fn run(&mut self, time: Duration, things: &[Observation]) {
        let end = self.now + time;
        while self.now < end {
            self.step_looking(SourceSet::ALL, things);
        }
    }

    /// The perspective at a path.
    pub(super) fn at(&self, path: &[u16]) -> &Partner {
        let found = self.all.iter().find(|(nested, _)| nested.path.agents() == Some(path));
        &found.unwrap().1
    }

    /// The awareness of a perspective; the empty path is the robot's.
    pub(super) fn perceptual_context(&self, path: &[u16]) -> &PerceptualContext {
        if path.is_empty() {
            self.robot.perceptual_context()
        } else {
            self.at(path).perceptual_context().unwrap()
        }
    }

    /// Whether every perspective from the robot to this path would notice an absence at a place.
    pub(super) fn survey(&self, path: &[u16], place: &Position<Base>) -> bool {
        let number = 1 + self.all.iter().position(|(nested, _)| nested.path.agents() == Some(path)).unwrap();
        lineage_surveys(&self.robot, &self.all, number, place)
    }

    /// The beliefs of the perspective at a path.
    pub(super) fn beliefs(&self, path: &[u16]) -> Vec<Belief> {
        if path.is_empty() {
            return (0..self.robot.beliefs().len()).map(|index| self.robot.entry(index).unwrap()).collect();
        }
        believed(self.at(path))
    }

    /// The state `on` of the only belief at a path.
    pub(super) fn on(&self, path: &[u16]) -> Option<f32> {
        let beliefs = self.beliefs(path);
        assert!(beliefs.len() <= 1, "{path:?} believes in {} things", beliefs.len());
        let percept = self.percepts.index("on").unwrap();
        match beliefs.first()?.percept(percept).and_then(Remembered::feature) {
            Some(Feature::Number(degree)) => Some(degree),
            _ => None,
        }
    }
}

fn lineage_surveys(
    robot: &Robot,
    all: &[(NestedPerspective, Partner)],
    mut number: usize,
    place: &Position<Base>,
) -> bool {
    while number > 0 {
        let (nested, partner) = &all[number - 1];
        if !partner.is_fully_in_view(place) {
            return false;
        }
        number = nested.within;
    }
    robot.is_fully_in_view(place)
}

pub(super) fn believed(partner: &Partner) -> Vec<Belief> {
    (0..partner.beliefs().len()).map(|index| partner.entry(index).unwrap()).collect()
}

/// An observation of the robot's head.
pub(super) fn head(person: Observation) -> Observation {
    Observation { kind: ObservationKind::Person.raw(), partner: 0, ..person }
}

/// The whole world, agents included, moved and turned.
pub(super) fn carried(world: &[Observation], x_base_world: &Pose<Base, Base>) -> Vec<Observation> {
    world
        .iter()
        .map(|observation| {
            let pose = Pose::<Base, Thing>::from_parts(
                observation.position_m.map(f64::from),
                observation.orientation_xyzw.map(f64::from),
            );
            let carried = *x_base_world * pose.unwrap();
            Observation {
                position_m: carried.position_m().map(single),
                orientation_xyzw: carried.orientation_xyzw().map(single),
                ..*observation
            }
        })
        .collect()
}

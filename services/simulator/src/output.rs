//! The outputs of the world: observations, ground truth and utterances.

use config::lesson::{Act, Object, Occluder, Role};
use geometry::{Pose, Thing as Frame};
use message::{
    Modality, NO_TABLE, Observation, ObservationKind, STATES, SceneHead, SceneMode, SceneObject, State, Text,
    ThingRole, Utterance,
};
use quantity::number::single;

use crate::World;
use crate::script_event::Event;
use crate::settle;
use crate::teacher::Teacher;
use crate::thing::{Motion, SeatKind, Thing};

/// Placeholder; the sensor process sets the number of the source.
const SOURCE: u16 = 0;
/// Half extents of a head, in metres.
const HEAD_M: [f64; 3] = [0.10, 0.08, 0.12];
/// The colour of objects without one in the lesson.
const GREY: [f32; 3] = [0.5; 3];

/// The pose of something in the world, and its ground truth.
type Truth = (Pose<geometry::World, Frame>, SceneObject);

impl World {
    /// The observations of the robot's eyes at the instant of the last step, in its base frame and with noise: the
    /// objects, the present teachers (with the pose of their eyes) and the occluders. The robot looks down on the
    /// table, so nothing is hidden from it.
    pub fn observations(&self) -> impl Iterator<Item = Observation> {
        let observed_at_ns = self.state.now.as_nanos();
        let confidence = single(self.lesson.noise.confidence);
        let truth = self.truths().zip(&self.state.offsets_m);
        truth.map(move |((x_world_thing, truth), offset_m)| {
            let pose = self.x_base_world * x_world_thing;
            let mut position_m = pose.position_m();
            for (coordinate, offset) in position_m.iter_mut().zip(offset_m) {
                *coordinate += offset;
            }
            Observation {
                observed_at_ns,
                source: SOURCE,
                modality: Modality::Vision.raw(),
                kind: truth.kind,
                partner: truth.partner,
                held_by: truth.held_by,
                detection: 0,
                confidence,
                position_m: position_m.map(single),
                position_sd_m: [0.0; 3],
                orientation_xyzw: pose.orientation_xyzw().map(single),
                half_extents_m: truth.half_extents_m.map(single),
                colour_rgb: truth.colour_rgb,
                shape: truth.shape,
                states: truth.states,
            }
        })
    }

    /// The ground truth at the instant of the last step, in the world frame, in the order of [`World::observations`].
    pub fn scene(&self) -> impl Iterator<Item = SceneObject> {
        self.truths().map(|(_, truth)| truth)
    }

    /// The lesson's progress, and the pose of the robot in the world. The caller fills in the lesson's name.
    #[must_use]
    pub fn head(&self) -> SceneHead {
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let base = self.x_base_world.inverse();
        let table = self.state.table.map_or(NO_TABLE, count);
        SceneHead {
            base_position_m: base.position_m(),
            base_orientation_xyzw: base.orientation_xyzw(),
            began_at_ns: self.state.began.map_or(0, clock::Instant::as_nanos),
            mode: if self.is_finished() { SceneMode::Over.raw() } else { self.state.mode.raw() },
            table,
            tables: count(self.lesson.tables().count()),
            steps: count(self.state.recorder.steps()),
            ..SceneHead::default()
        }
    }

    /// The utterances since the step before the last one, in order of time.
    pub fn utterances(&self) -> impl Iterator<Item = Utterance> {
        let by_script = self.recent_cues().iter().filter_map(|script_event| {
            let Event::Step(index) = script_event.event else { return None };
            let step = self.lesson.tables().nth(script_event.table)?.script.get(index)?;
            let Act::Say(text) = &step.act else { return None };
            Some(Utterance { speaker: u32::from(step.who), text: Text::new(text) })
        });
        by_script.chain(self.state.said.iter().copied())
    }

    fn truths(&self) -> impl Iterator<Item = Truth> {
        let layout = self.state.layout.as_deref();
        let occluders = layout.filter(|_| self.state.has_occluders).map_or(&[][..], |it| &it.occluders);
        let screens = occluders.iter().zip(&self.state.screens);
        let screens = screens.map(|(screen, at)| occluder(screen, at.point_m(self.state.now)));
        let things = &self.state.things;
        let things = things
            .iter()
            .zip(self.objects())
            .enumerate()
            .map(|(index, (thing, object))| self.object(index, thing, object));
        let present = self.state.teachers.iter().filter(|teacher| teacher.is_present);
        things.chain(present.map(|teacher| self.person(teacher))).chain(screens)
    }

    fn object(&self, index: usize, thing: &Thing, object: &Object) -> Truth {
        let things = &self.state.things;
        let mut states = [f32::NAN; STATES];
        let mut set = |state: State, holds: bool| {
            if let Some(slot) = states.get_mut(usize::from(state.raw())) {
                *slot = if holds { 1.0 } else { 0.0 };
            }
        };
        if object.kind.hole {
            set(State::Filled, settle::is_filled(things, index));
        }
        if object.kind.markable {
            set(State::Marked, self.is_marked(index));
        }
        if object.kind.role == Role::Peg {
            set(State::Inserted, thing.seat.is_some_and(|seat| seat.kind == SeatKind::Hole));
        }
        let truth = SceneObject {
            held_by: thing.held_by(),
            role: match object.kind.role {
                Role::Block => ThingRole::Block.raw(),
                Role::Peg => ThingRole::Peg.raw(),
                Role::Marker => ThingRole::Marker.raw(),
            },
            half_extents_m: object.kind.half_extents_m,
            colour_rgb: object.colour_rgb.map(single),
            shape: object.kind.shape.map(single),
            states,
            name: Text::new(&object.name),
            ..SceneObject::default()
        };
        placed(thing.pose, ObservationKind::Object, truth)
    }

    fn is_marked(&self, index: usize) -> bool {
        self.state.things.iter().zip(self.objects()).any(|(thing, object)| {
            object.kind.role == Role::Marker
                && matches!(thing.motion, Motion::AtRest)
                && thing.seat.is_some_and(|seat| seat.on == index && seat.kind == SeatKind::Top)
        })
    }

    fn person(&self, teacher: &Teacher) -> Truth {
        let pose = Pose::from_isometry(*teacher.eye(self.state.now).isometry());
        let (partner, name) = (teacher.number, teacher.name);
        let truth =
            SceneObject { partner, half_extents_m: HEAD_M, colour_rgb: GREY, name, ..SceneObject::default() };
        placed(pose, ObservationKind::Person, truth)
    }
}

fn occluder(occluder: &Occluder, [x, y, z]: [f64; 3]) -> Truth {
    let (half_extents_m, name) = (occluder.half_extents_m, Text::new(&occluder.name));
    let truth = SceneObject { half_extents_m, colour_rgb: GREY, name, ..SceneObject::default() };
    placed(Pose::upright(x, y, z, 0.0), ObservationKind::Occluder, truth)
}

/// Completes a ground truth by its kind and its pose in the world, and returns both.
fn placed(pose: Pose<geometry::World, Frame>, kind: ObservationKind, truth: SceneObject) -> Truth {
    let (position_m, orientation_xyzw) = (pose.position_m(), pose.orientation_xyzw());
    (pose, SceneObject { position_m, orientation_xyzw, kind: kind.raw(), ..truth })
}

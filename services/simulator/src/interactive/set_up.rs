//! Interactive set-up of the table: adding and removing objects and occluders.

use std::sync::Arc;

use clock::Instant;
use config::lesson::{Destination, Object, ObjectKind, Occluder, Table, UprightPose};
use message::{SceneMode, TeacherAct};

use super::{Done, FOLLOW_TIME, RefusedActError, heading, place, refuse};
use crate::World;
use crate::path::Glide;
use crate::settle;
use crate::thing::{Motion, Thing};
use crate::world::{HeldThing, State, Undo, follow};

/// Default half extents of an occluder, in metres.
const SCREEN_M: [f64; 3] = [0.15, 0.01, 0.12];
/// Maximum length of a name, in bytes.
const MAX_NAME_BYTES: usize = 60;

impl World {
    pub(super) fn add(&mut self, act: &TeacherAct, room: usize) -> Result<Done, RefusedActError> {
        self.is_setting_up("nothing new can come")?;
        self.has_room(room)?;
        let [x, y, _] = place([act.position_m[0], act.position_m[1], 0.0])?;
        let (kind_name, colour_name) = (act.text.as_str(), act.colour.as_str());
        let Some(&kind) = self.lesson.kinds.get(kind_name) else {
            let known: Vec<&str> = self.lesson.kinds.keys().map(String::as_str).collect();
            return refuse(format!("there is no kind `{kind_name}` here, but {}", known.join(", ")));
        };
        let Some(&colour_rgb) = self.lesson.colours.get(colour_name) else {
            let known: Vec<&str> = self.lesson.colours.keys().map(String::as_str).collect();
            return refuse(format!("there is no colour `{colour_name}` here, but {}", known.join(", ")));
        };
        let before = self.state.clone();
        self.interrupt();
        let undo = self.state.setting_as_it_is();
        let name = self.free_name(&format!("{colour_name} {kind_name}"));
        let heading_rad = heading(act).unwrap_or(0.0);
        let [.., half_m] = kind.half_extents_m;
        let lies = UprightPose { position_m: [x, y, half_m], heading_rad };
        let object = Object { name: name.clone(), kind, colour_rgb, place: lies };
        let index = self.objects().len();
        self.state.things.push(Thing::laid(&object));
        self.layout().objects.push(object);
        let to = self.free_destination(index, &kind, lies);
        let rest = to.and_then(|to| {
            let rest = crate::world::destination(&self.state.things, self.objects(), index, to);
            rest.ok_or_else(|| RefusedActError("it cannot stand there".to_owned()))
        });
        match (rest, self.state.things.get_mut(index)) {
            (Ok(rest), Some(thing)) => (thing.pose, thing.seat) = (rest.pose, rest.seat),
            (Err(refusal), _) => {
                self.state = before;
                return Err(refusal);
            }
            (Ok(_), None) => {}
        }
        self.state.push_undo(undo);
        self.state.outcome = Some(name);
        Ok(Done)
    }

    pub(super) fn remove(&mut self, now: Instant, name: &str) -> Result<Done, RefusedActError> {
        self.is_setting_up("nothing can be taken away")?;
        let screen = self.state.layout.as_ref().and_then(|layout| {
            let found = layout.occluders.iter().position(|occluder| occluder.name == name);
            found.filter(|_| self.state.has_occluders)
        });
        if let Some(screen) = screen {
            self.interrupt();
            self.state.remember_setting();
            self.layout().occluders.remove(screen);
            if screen < self.state.screens.len() {
                self.state.screens.remove(screen);
            }
            return Ok(Done);
        }
        let index = self.object_named(name)?;
        let at_rest = |thing: &Thing| matches!(thing.motion, Motion::AtRest | Motion::Settling { .. });
        if !self.state.things.get(index).is_some_and(at_rest) {
            return refuse(format!("`{name}` is being moved: wait until it rests"));
        }
        if let Some(coming) = self.reserved_by(index) {
            return refuse(format!("`{coming}` is on its way there, or may come back: wait until it rests"));
        }
        self.interrupt();
        self.state.remember_setting();
        self.layout().objects.remove(index);
        self.state.things.remove(index);
        self.state.renumber(index);
        for other in 0..self.state.things.len() {
            let falls = self.state.things.get(other).is_some_and(|thing| {
                let lies_m = thing.pose.position_m()[2];
                let half_m = self.objects().get(other).map_or(0.0, settle::half_height_m);
                thing.seat.is_none() && matches!(thing.motion, Motion::AtRest) && lies_m > half_m + 1e-6
            });
            let rest = settle::support_below(&self.state.things, self.objects(), other).filter(|_| falls);
            if let (Some(rest), Some(thing)) = (rest, self.state.things.get_mut(other)) {
                thing.seat = rest.seat;
                thing.motion = Motion::Settling { path: rest.path(thing.pose, now) };
            }
        }
        Ok(Done)
    }

    pub(super) fn screen(
        &mut self,
        now: Instant,
        act: &TeacherAct,
        room: usize,
    ) -> Result<Done, RefusedActError> {
        self.is_here(act.teacher)?;
        let [x, y, _] = place(act.position_m)?;
        let name = act.text.as_str();
        let layout = self.state.layout.as_ref().filter(|_| self.state.has_occluders);
        let found = layout.and_then(|it| it.occluders.iter().position(|screen| screen.name == name));
        if let Some(screen) = found.and_then(|index| Some((index, self.state.screens.get_mut(index)?))) {
            let (occluder, glide) = screen;
            let (from_m, [.., z]) = (glide.to_m, glide.point_m(now));
            glide.go(now, [x, y, z], FOLLOW_TIME);
            self.state.remember_push(now, act.teacher, occluder, from_m);
            let slide = config::lesson::Act::Slide { occluder, centre_m: [x, y, z], takes: FOLLOW_TIME };
            self.state.recorder.note(act.teacher, now, slide);
            return Ok(Done);
        }
        self.is_setting_up("nothing new can come")?;
        self.has_room(room)?;
        if name.trim().is_empty() || name.len() > MAX_NAME_BYTES || name.chars().any(char::is_control) {
            return refuse(format!("an occluder needs a name of at most {MAX_NAME_BYTES} bytes"));
        }
        let is_told = act.second_vector_m.iter().any(|half_m| *half_m != 0.0);
        let half_extents_m = if is_told { act.second_vector_m } else { SCREEN_M };
        if !half_extents_m.iter().all(|half_m| *half_m >= 0.001 && *half_m <= 10.0) {
            return refuse("half the extents of an occluder are from 0.001 to 10 m");
        }
        self.interrupt();
        self.state.remember_setting();
        let centre_m = [x, y, half_extents_m[2]];
        self.layout().occluders.push(Occluder { name: name.to_owned(), centre_m, half_extents_m });
        self.state.screens.push(Glide::resting(centre_m));
        Ok(Done)
    }

    /// The thing that is being moved into or onto an object, or was taken from there and may be put back.
    fn reserved_by(&self, index: usize) -> Option<&str> {
        let is_bound = |(other, thing): (usize, &Thing)| {
            let seat = match thing.motion {
                Motion::Carried { to, .. } => to,
                Motion::InHand { .. } => self.state.taken_from(other).and_then(|taken| taken.seat),
                Motion::AtRest | Motion::Grasped { .. } | Motion::Settling { .. } => None,
            };
            seat.is_some_and(|seat| seat.on == index)
        };
        let coming = self.state.things.iter().enumerate().position(is_bound)?;
        self.objects().get(coming).map(|object| object.name.as_str())
    }

    /// The current table in the format of a lesson, with an empty script.
    pub(super) fn table_as_it_is(&self, now: Instant) -> Table {
        let mut table = self.state.layout.as_deref().cloned().unwrap_or_default();
        for (object, thing) in table.objects.iter_mut().zip(self.state.at_rest()) {
            let (position_m, heading_rad) = (thing.pose.position_m(), thing.pose.heading_rad());
            object.place = UprightPose { position_m, heading_rad };
        }
        table.occluders.truncate(self.state.screens.len());
        for (occluder, screen) in table.occluders.iter_mut().zip(&self.state.screens) {
            occluder.centre_m = screen.point_m(now);
        }
        table
    }

    pub(super) fn layout(&mut self) -> &mut Table {
        Arc::make_mut(self.state.layout.get_or_insert_default())
    }

    /// Checks that the table is being set up, or will be when a person takes over from the script.
    fn is_setting_up(&self, so: &str) -> Result<(), RefusedActError> {
        let will_be_taught = self.state.mode == SceneMode::Script && self.taught_table().is_some();
        if self.state.mode == SceneMode::Teaching || will_be_taught {
            return refuse(format!("{so} while something is taught: clear the table first"));
        }
        Ok(())
    }

    fn has_room(&self, room: usize) -> Result<(), RefusedActError> {
        let there = self.state.things.len() + self.state.screens.len() + self.state.teachers.len();
        if there < room {
            Ok(())
        } else {
            refuse(format!(
                "there is room for {room} things and people: `buffers.max_objects` in leo.toml says so"
            ))
        }
    }

    fn free_name(&self, wanted: &str) -> String {
        let is_free = |name: &str| self.objects().iter().all(|object| object.name != name);
        let numbered = (2..).map(|number: u32| format!("{wanted} {number}"));
        let mut names = std::iter::once(wanted.to_owned()).chain(numbered);
        names.find(|name| is_free(name)).unwrap_or_default()
    }

    /// Destination of a new object; refused if another one is in the way.
    fn free_destination(
        &self,
        index: usize,
        kind: &ObjectKind,
        lies: UprightPose,
    ) -> Result<Destination, RefusedActError> {
        let [x, y, _] = lies.position_m;
        let to = self.drop_destination(index, [x, y], lies.heading_rad)?;
        let Destination::UprightPose(_) = to else { return Ok(to) };
        let round_m = |half_m: [f64; 3]| half_m[0].hypot(half_m[1]);
        let others = self.state.things.iter().zip(self.objects()).enumerate();
        let in_the_way = others.filter(|(other, _)| *other != index).find(|(_, (thing, object))| {
            let [other_x, other_y, _] = thing.pose.position_m();
            let apart_m = (x - other_x).hypot(y - other_y);
            apart_m < (round_m(kind.half_extents_m) + round_m(object.kind.half_extents_m)) * 0.7
        });
        match in_the_way {
            Some((_, (_, object))) => refuse(format!("`{}` stands there: choose another place", object.name)),
            None => Ok(to),
        }
    }
}

impl State {
    /// Clears the table.
    pub(super) fn clear_table(&mut self) {
        self.empty_table();
        self.taken.clear();
        self.script_events.clear();
        (self.next_cue, self.first_cue) = (0, 0);
        self.mode = SceneMode::SetUp;
    }

    /// Updates the indices after the object of this number was removed.
    /// Removes the objects and occluders of the table.
    pub(crate) fn empty_table(&mut self) {
        self.things.clear();
        self.screens.clear();
        (self.layout, self.table, self.laid_at) = (None, None, None);
        self.has_occluders = false;
    }

    fn renumber(&mut self, gone: usize) {
        for thing in &mut self.things {
            thing.seat = thing.seat.filter(|seat| seat.on != gone);
            if let Some(seat) = &mut thing.seat {
                seat.on -= usize::from(seat.on > gone);
            }
            if let Motion::Carried { to: Some(seat), .. } = &mut thing.motion {
                seat.on -= usize::from(seat.on > gone);
            }
        }
        for taken in &mut self.taken {
            taken.index -= usize::from(taken.index > gone);
            if let Some(seat) = &mut taken.seat {
                seat.on -= usize::from(seat.on > gone);
            }
        }
    }

    /// Saves the table for undo.
    pub(super) fn remember_setting(&mut self) {
        self.push_undo(self.setting_as_it_is());
    }

    fn setting_as_it_is(&self) -> Undo {
        let layout = self.layout.clone().unwrap_or_default();
        Undo::TableLayout { layout, things: self.at_rest(), screens: self.screens.clone() }
    }

    /// The things as they will be at rest without further acts: held ones where they were taken, and moving ones at
    /// their destination.
    pub(super) fn at_rest(&self) -> Vec<Thing> {
        let objects = self.layout.as_ref().map_or(&[][..], |layout| &layout.objects);
        let rest = |(index, thing): (usize, &Thing)| {
            let stays = (thing.pose, thing.seat);
            let (pose, seat) = match thing.motion {
                Motion::AtRest => stays,
                Motion::Carried { path, to, .. } => (path.to, to),
                Motion::Settling { path } => (path.to, thing.seat),
                Motion::InHand { .. } => {
                    self.taken_from(index).map_or(stays, |taken| (taken.from, taken.seat))
                }
                Motion::Grasped { .. } => settle::support_below(&self.things, objects, index)
                    .map_or(stays, |rest| (rest.pose, rest.seat)),
            };
            Thing { pose, motion: Motion::AtRest, seat }
        };
        let mut things: Vec<Thing> = self.things.iter().enumerate().map(rest).collect();
        // Seats can be nested, so repeat until all positions have propagated.
        for _ in 0..things.len() {
            follow(&mut things);
        }
        things
    }

    fn taken_from(&self, index: usize) -> Option<&HeldThing> {
        self.taken.iter().find(|taken| taken.index == index)
    }
}

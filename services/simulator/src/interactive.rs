//! Interactive acts of people in the workspace while it runs; the first one interrupts the script.

mod drop;
mod set_up;
#[cfg(test)]
mod tests;
mod undo;

use std::sync::Arc;

use clock::{Duration, Instant};
use config::lesson::{Act, Lesson, Step, Table};
use geometry::{Pose, Thing as Frame};
use message::{SceneMode, TeacherAct, TeacherActKind, Text, Utterance};

use crate::World;
use crate::path::{MotionProfile, Path};
use crate::recorder::{PersonState, has_moved};
use crate::script_event::{Event, ScriptEvent};
use crate::settle;
use crate::thing::{Motion, Seat};
use crate::world::HeldThing;

/// Time in which a thing moved by hand reaches the last commanded position of the hand.
const FOLLOW_TIME: Duration = Duration::from_millis(60);
/// Time in which a released thing comes to rest.
const SETTLE_TIME: Duration = Duration::from_millis(300);
/// Minimum distance between eyes and the point looked at, in metres; lessons have the same limit.
const MIN_GAZE_M: f64 = 0.01;
/// Maximum absolute coordinate, in metres.
const FARTHEST_M: f64 = 100.0;

/// Why an act is refused, with the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RefusedActError(pub String);

impl World {
    /// Executes an act of a teacher at the instant of the next step or later. Returns the result, if the act has one:
    /// the name of a new object.
    ///
    /// `room` is the maximum number of things, people and occluders in an observation frame.
    ///
    /// # Errors
    ///
    /// The act is refused, and nothing has changed.
    pub fn act(&mut self, now: Instant, act: &TeacherAct, room: usize) -> Result<String, RefusedActError> {
        let Some(kind) = act.kind() else { return refuse("the simulator does not know this act") };
        let who = act.teacher;
        if self.state.teachers.iter().all(|teacher| teacher.number != who) {
            return refuse(format!("there is no teacher {who} in this lesson"));
        }
        let is_being_laid =
            self.state.mode != SceneMode::Script && self.state.next_cue < self.state.script_events.len();
        let needs_table = matches!(
            kind,
            TeacherActKind::Say
                | TeacherActKind::Take
                | TeacherActKind::Screen
                | TeacherActKind::Add
                | TeacherActKind::Remove
                | TeacherActKind::Undo
        );
        if is_being_laid && needs_table {
            return refuse("the table is just being laid: wait a moment");
        }
        match kind {
            TeacherActKind::Say => self.say(now, who, act.text),
            TeacherActKind::Take => self.take_by_hand(now, act),
            TeacherActKind::Carry => self.carry(now, act),
            TeacherActKind::Put => self.put(now, act),
            TeacherActKind::Cancel => self.cancel(now, act.hand),
            TeacherActKind::Seat => self.seat(now, act),
            TeacherActKind::Leave => self.set_presence(now, who, false),
            TeacherActKind::Return => self.set_presence(now, who, true),
            TeacherActKind::Screen => self.screen(now, act, room),
            TeacherActKind::Add => self.add(act, room),
            TeacherActKind::Remove => self.remove(now, act.text.as_str()),
            TeacherActKind::Clear => Ok(self.clear(now)),
            TeacherActKind::Lay => self.lay(now, act.table),
            TeacherActKind::Undo => self.undo(now, who),
            TeacherActKind::Open | TeacherActKind::Play | TeacherActKind::Save => {
                refuse("the lesson controller opens, plays and saves lessons")
            }
        }
        .map(|_: Done| self.state.outcome.take().unwrap_or_default())
    }

    /// The recorded demonstrations as a lesson of this title; `None` if no sentence was said.
    #[must_use]
    pub fn taught(&self, title: &str, now: Instant) -> Option<Lesson> {
        self.state.recorder.lesson(title, now, &self.lesson)
    }

    fn say(&mut self, now: Instant, who: u16, text: Text) -> Result<Done, RefusedActError> {
        let words = text.as_str();
        if words.trim().is_empty() || words.chars().any(char::is_control) {
            return refuse("a sentence has at least one word, at most 252 bytes, and no control characters");
        }
        self.is_here(who)?;
        if self.state.mode == SceneMode::SetUp {
            self.begin_teaching(now);
        }
        self.state.recorder.note(who, now, Act::Say(words.to_owned()));
        self.state.saying.push(Utterance { speaker: u32::from(who), text });
        Ok(Done)
    }

    fn take_by_hand(&mut self, now: Instant, act: &TeacherAct) -> Result<Done, RefusedActError> {
        let by = act.teacher;
        self.is_here(by)?;
        let index = self.object_named(act.text.as_str())?;
        let name = |index: usize| self.objects().get(index).map_or("", |object| object.name.as_str());
        if let Some(taken) = self.state.taken.iter().find(|taken| taken.by == by || taken.hand == act.hand) {
            return refuse(format!("`{}` is in that hand: put it down first", name(taken.index)));
        }
        let (Some(thing), Some(rest)) =
            (self.state.things.get(index), self.state.at_rest().into_iter().nth(index))
        else {
            return refuse("the table is just being laid: wait a moment");
        };
        match thing.motion {
            Motion::AtRest | Motion::Settling { .. } => {}
            Motion::Carried { .. } | Motion::InHand { .. } => {
                return refuse(format!("`{}` is being moved: wait until it rests", name(index)));
            }
            Motion::Grasped { .. } => {
                return refuse(format!("Leo holds `{}`: wait until Leo puts it down", name(index)));
            }
        }
        let (pose, from, seat) = (thing.pose, rest.pose, rest.seat);
        self.interrupt();
        let path =
            Path { from: pose, to: pose, begins: now, takes: Duration::ZERO, manner: MotionProfile::Glide };
        if let Some(thing) = self.state.things.get_mut(index) {
            thing.seat = None;
            thing.motion = Motion::InHand { by, path };
        }
        self.state.taken.push(HeldThing { hand: act.hand, by, index, at: now, from, seat });
        Ok(Done)
    }

    fn carry(&mut self, now: Instant, act: &TeacherAct) -> Result<Done, RefusedActError> {
        let taken = self.in_hand(act.hand)?;
        let [x, y, z] = place(act.position_m)?;
        let min_m = self.objects().get(taken.index).map_or(0.0, settle::half_height_m);
        let Some(thing) = self.state.things.get_mut(taken.index) else { return Ok(Done) };
        let heading_rad = heading(act).unwrap_or_else(|| thing.pose.heading_rad());
        let to = Pose::upright(x, y, z.max(min_m), heading_rad);
        let path =
            Path { from: thing.pose, to, begins: now, takes: FOLLOW_TIME, manner: MotionProfile::Glide };
        thing.motion = Motion::InHand { by: taken.by, path };
        Ok(Done)
    }

    fn put(&mut self, now: Instant, act: &TeacherAct) -> Result<Done, RefusedActError> {
        let taken = self.in_hand(act.hand)?;
        let [x, y, _] = place(act.position_m)?;
        let kept = self.state.things.get(taken.index).map_or(0.0, |thing| thing.pose.heading_rad());
        let heading_rad = heading(act).unwrap_or(kept);
        let to = match self.drop_destination(taken.index, [x, y], heading_rad) {
            Ok(to) => to,
            Err(refusal) => {
                self.return_held(now, taken);
                return refuse(format!("{refusal}; it is back where it was"));
            }
        };
        let rest = crate::world::destination(&self.state.things, self.objects(), taken.index, to);
        let Some(rest) = rest else {
            self.return_held(now, taken);
            return refuse("it cannot stand there; it is back where it was");
        };
        let (far_m, turned_rad) = taken.from.difference(&rest.pose);
        let is_elsewhere = far_m > 1e-3 || turned_rad > 1e-2;
        if is_elsewhere {
            self.remember(&taken);
        }
        self.set_down(now, &taken, rest.pose, rest.seat);
        if is_elsewhere {
            let takes = now.since(taken.at) + SETTLE_TIME;
            self.state.recorder.note(taken.by, taken.at, Act::Move { object: taken.index, to, takes });
        }
        Ok(Done)
    }

    /// Puts back what a hand holds, if anything.
    fn cancel(&mut self, now: Instant, hand: u16) -> Result<Done, RefusedActError> {
        if let Ok(taken) = self.in_hand(hand) {
            self.return_held(now, taken);
        }
        Ok(Done)
    }

    /// Puts back everything in people's hands, because their owners are gone.
    pub fn return_all(&mut self, now: Instant) {
        while let Some(&taken) = self.state.taken.last() {
            self.return_held(now, taken);
        }
    }

    fn return_held(&mut self, now: Instant, taken: HeldThing) {
        let rest = self.state.at_rest().into_iter().nth(taken.index);
        let (pose, seat) = rest.map_or((taken.from, taken.seat), |rest| (rest.pose, rest.seat));
        self.set_down(now, &taken, pose, seat);
    }

    /// Carries what a hand holds to a place, where it comes to rest; the hand is empty.
    fn set_down(
        &mut self,
        now: Instant,
        taken: &HeldThing,
        to: Pose<geometry::World, Frame>,
        seat: Option<Seat>,
    ) {
        self.state.taken.retain(|other| other.hand != taken.hand);
        if let Some(thing) = self.state.things.get_mut(taken.index) {
            let path =
                Path { from: thing.pose, to, begins: now, takes: SETTLE_TIME, manner: MotionProfile::Glide };
            thing.motion = Motion::Carried { by: taken.by, path, to: seat };
        }
    }

    fn seat(&mut self, now: Instant, act: &TeacherAct) -> Result<Done, RefusedActError> {
        let (eyes_m, looks_at_m) = (place(act.position_m)?, place(act.second_vector_m)?);
        let sight_m =
            eyes_m.iter().zip(looks_at_m).map(|(eye, point)| (eye - point).powi(2)).sum::<f64>().sqrt();
        if sight_m < MIN_GAZE_M {
            return refuse("the teacher cannot look at the eyes' own position: name another point");
        }
        self.is_here(act.teacher)?;
        let who = act.teacher;
        let Some(teacher) = self.state.teachers.iter_mut().find(|teacher| teacher.number == who) else {
            return Ok(Done);
        };
        let (was_m, looked_at_m) = teacher.looks(now);
        if has_moved(was_m, eyes_m) {
            teacher.eyes.go(now, eyes_m, FOLLOW_TIME);
            self.state.recorder.note(who, now, Act::Walk { eyes_m, takes: FOLLOW_TIME });
        }
        if has_moved(looked_at_m, looks_at_m) {
            teacher.gaze.go(now, looks_at_m, FOLLOW_TIME);
            self.state.recorder.note(who, now, Act::Look { at_m: looks_at_m, takes: FOLLOW_TIME });
        }
        Ok(Done)
    }

    fn set_presence(&mut self, now: Instant, who: u16, comes: bool) -> Result<Done, RefusedActError> {
        if self.is_here(who).is_ok() == comes {
            return refuse(if comes { "the teacher is here already" } else { "the teacher is away already" });
        }
        self.interrupt();
        let held = self.state.taken.iter().find(|taken| taken.by == who).copied();
        if let Some(teacher) = self.state.teachers.iter_mut().find(|teacher| teacher.number == who) {
            teacher.is_present = comes;
        }
        if let Some(taken) = held {
            self.return_held(now, taken);
        }
        self.state.recorder.note(who, now, if comes { Act::Return } else { Act::Leave });
        Ok(Done)
    }

    fn clear(&mut self, now: Instant) -> Done {
        let was_set_up = self.state.mode == SceneMode::SetUp;
        self.state.recorder.close(now, self.people(now));
        if was_set_up {
            self.state.remember_setting();
        } else {
            self.state.undo.clear();
        }
        self.state.clear_table();
        self.state.layout = Some(Arc::default());
        self.state.has_occluders = true;
        self.state.began.get_or_insert(now);
        Done
    }

    fn lay(&mut self, now: Instant, table: u64) -> Result<Done, RefusedActError> {
        let tables = self.lesson.tables().count();
        let Some(table) = usize::try_from(table).ok().filter(|table| *table < tables) else {
            return refuse(format!(
                "the lesson has {tables} tables, numbered from 0: there is no table {table}"
            ));
        };
        self.state.recorder.close(now, self.people(now));
        self.state.undo.clear();
        self.state.clear_table();
        let table_timing = self.lesson.table_timing;
        let stands = table_timing.empty.saturating_sub(table_timing.occluders_first);
        let script_event = |at, event| ScriptEvent { at, table, event };
        self.state
            .script_events
            .extend([script_event(stands, Event::Occlude), script_event(table_timing.empty, Event::Lay)]);
        self.state.lasts = table_timing.empty;
        self.state.began = Some(now);
        Ok(Done)
    }

    /// Ends the script at this point; motions in progress are completed.
    fn interrupt(&mut self) {
        if self.state.mode != SceneMode::Script {
            return;
        }
        let taught_table = self.taught_table();
        self.state.script_events.clear();
        (self.state.next_cue, self.state.first_cue) = (0, 0);
        self.state.layout.get_or_insert_default();
        self.state.has_occluders = true;
        self.state.mode = SceneMode::SetUp;
        if self.state.laid_at.is_none() {
            // The table has not been laid, so clear what it would have contained.
            let layout = Arc::make_mut(self.state.layout.get_or_insert_default());
            layout.objects.clear();
            layout.territory.clear();
        }
        if let Some((laid_at, table)) = taught_table {
            self.state.mode = SceneMode::Teaching;
            self.state.recorder.take_over(laid_at, table);
        }
    }

    /// The current table if its script has already said a sentence, with the steps played so far and the time when it
    /// was laid. A person who takes over then continues teaching on it.
    fn taught_table(&self) -> Option<(Instant, Table)> {
        let table = self.lesson.tables().nth(self.state.table?)?;
        let laid_at = self.state.laid_at?;
        let since = self.state.now.since(laid_at);
        let script: Vec<Step> = table.script.iter().filter(|step| step.at <= since).cloned().collect();
        let is_spoken = script.iter().any(|step| matches!(step.act, Act::Say(_)));
        is_spoken.then(|| (laid_at, Table { script, ..table.clone() }))
    }

    /// Ends the set-up of the table: from now on acts are recorded as a demonstration.
    fn begin_teaching(&mut self, now: Instant) {
        self.state.mode = SceneMode::Teaching;
        self.state.undo.clear();
        let table = self.table_as_it_is(now);
        self.state.recorder.begin(now, table, self.people(now));
    }

    pub(crate) fn people(&self, now: Instant) -> Vec<PersonState> {
        self.state.teachers.iter().map(|teacher| teacher.person_state(now)).collect()
    }

    fn is_here(&self, who: u16) -> Result<(), RefusedActError> {
        let is_here = self.state.teachers.iter().any(|teacher| teacher.number == who && teacher.is_present);
        if is_here { Ok(()) } else { refuse(format!("teacher {who} is away: the teacher must return first")) }
    }

    fn in_hand(&self, hand: u16) -> Result<HeldThing, RefusedActError> {
        let taken = self.state.taken.iter().find(|taken| taken.hand == hand);
        taken.copied().ok_or_else(|| RefusedActError("the hand is empty: take something first".to_owned()))
    }

    fn object_named(&self, name: &str) -> Result<usize, RefusedActError> {
        let found = self.objects().iter().position(|object| object.name == name);
        found.ok_or_else(|| RefusedActError(format!("there is no object `{name}` on the table")))
    }
}

/// The success of an act.
struct Done;

fn refuse<T>(why: impl Into<String>) -> Result<T, RefusedActError> {
    Err(RefusedActError(why.into()))
}

/// Validates a position.
fn place(position_m: [f64; 3]) -> Result<[f64; 3], RefusedActError> {
    // Written so that NaN fails.
    if position_m.iter().all(|coordinate| coordinate.abs() <= FARTHEST_M) {
        Ok(position_m)
    } else {
        refuse(format!("a place has three coordinates from -{FARTHEST_M} to {FARTHEST_M} m"))
    }
}

fn heading(act: &TeacherAct) -> Option<f64> {
    Some(act.heading_rad).filter(|heading| heading.is_finite())
}

//! Undo of the last act.

use clock::{Duration, Instant};
use config::lesson::{Act, Destination, UprightPose};
use message::SceneMode;

use super::{Done, FOLLOW_TIME, RefusedActError, refuse};
use crate::World;
use crate::path::Glide;
use crate::recorder::{MERGE_TIME, has_moved};
use crate::thing::{Motion, Seat, SeatKind, Thing};
use crate::world::{HeldThing, State, Undo};

/// Maximum number of acts that can be undone.
const MAX_UNDO: usize = 64;
/// Duration of moving a thing back.
const UNDO_TIME: Duration = Duration::from_millis(800);

impl World {
    /// Saves where a thing was taken before it is put down elsewhere. Putting it back where it was taken needs no undo.
    pub(super) fn remember(&mut self, taken: &HeldThing) {
        if self.state.mode == SceneMode::SetUp {
            self.state.remember_setting();
            return;
        }
        let to = match taken.seat {
            Some(Seat { on, kind: SeatKind::Hole, .. }) => Destination::Hole(on),
            Some(Seat { on, kind: SeatKind::Top, .. }) => Destination::Top(on),
            None => Destination::UprightPose(UprightPose {
                position_m: taken.from.position_m(),
                heading_rad: taken.from.heading_rad(),
            }),
        };
        self.state.push_undo(Undo::Move { index: taken.index, to });
    }

    pub(super) fn undo(&mut self, now: Instant, who: u16) -> Result<Done, RefusedActError> {
        self.is_here(who)?;
        if !self.state.taken.is_empty() {
            return refuse("something is in a hand: put it down first");
        }
        while self.state.drop_idle_push() {}
        match self.state.undo.pop() {
            None => refuse("there is nothing to take back"),
            Some(Undo::TableLayout { layout, things, screens }) => {
                (self.state.layout, self.state.things, self.state.screens) = (Some(layout), things, screens);
                Ok(Done)
            }
            Some(Undo::Move { index, to }) => {
                let is_still = |thing: &Thing| matches!(thing.motion, Motion::AtRest);
                if !self.state.things.get(index).is_some_and(is_still) {
                    self.state.undo.push(Undo::Move { index, to });
                    return refuse("it still moves: wait until it rests");
                }
                let Some(layout) = self.state.layout.clone() else { return Ok(Done) };
                if crate::world::destination(&self.state.things, &layout.objects, index, to).is_none() {
                    return refuse("its previous place is occupied: it stays where it is");
                }
                crate::world::begin_move(
                    &mut self.state.things,
                    &layout.objects,
                    index,
                    to,
                    (who, now, UNDO_TIME),
                );
                self.state.recorder.note(who, now, Act::Move { object: index, to, takes: UNDO_TIME });
                Ok(Done)
            }
            Some(Undo::Push { occluder, from_m, .. }) => {
                let is_set_up = self.state.mode == SceneMode::SetUp;
                let Some(screen) = self.state.screens.get_mut(occluder) else { return Ok(Done) };
                if is_set_up {
                    *screen = Glide::resting(from_m);
                    return Ok(Done);
                }
                screen.go(now, from_m, UNDO_TIME);
                // Moving there and back is recorded: it differs from not having moved.
                let slide = Act::Slide { occluder, centre_m: from_m, takes: UNDO_TIME };
                self.state.recorder.record_separate(who, now, slide);
                Ok(Done)
            }
        }
    }
}

impl State {
    /// Saves the position of an occluder before a push; consecutive steps of one push are merged.
    pub(super) fn remember_push(&mut self, now: Instant, by: u16, occluder: usize, from_m: [f64; 3]) {
        let until = now + FOLLOW_TIME + MERGE_TIME;
        let goes_on = |undo: &Undo| {
            matches!(*undo, Undo::Push { by: before, occluder: other, until, .. }
                if before == by && other == occluder && now <= until)
        };
        match self.undo.last_mut().filter(|undo| goes_on(undo)) {
            Some(Undo::Push { until: before, .. }) => *before = until,
            _ => self.push_undo(Undo::Push { by, occluder, from_m, until }),
        }
    }

    /// Removes the last push if it changed nothing, because the occluder was pushed back to its place.
    fn drop_idle_push(&mut self) -> bool {
        let Self { undo, screens, .. } = self;
        let is_idle = |undo: &mut Undo| {
            let Undo::Push { occluder, from_m, .. } = *undo else { return false };
            screens.get(occluder).is_none_or(|screen| !has_moved(screen.to_m, from_m))
        };
        undo.pop_if(is_idle).is_some()
    }

    pub(super) fn push_undo(&mut self, undo: Undo) {
        if self.undo.len() == MAX_UNDO {
            self.undo.remove(0);
        }
        self.undo.push(undo);
    }
}

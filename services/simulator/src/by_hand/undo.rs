//! Taking the last act back.

use std::sync::Arc;

use clock::{Duration, Instant};
use config::lesson::{Act, Destination, Place};
use message::SceneMode;

use super::{Done, Refusal, Taken, refuse};
use crate::World;
use crate::path::Glide;
use crate::setting::Setting;
use crate::thing::{Motion, Seat, SeatKind, Thing};
use crate::world::State;

/// Acts that can be taken back.
const MOST: usize = 64;
/// How long a thing takes that is moved back.
const BACK: Duration = Duration::from_millis(800);

/// What is done to take an act back.
#[derive(Clone, Debug)]
pub(crate) enum Undo {
    /// While the table is set: it is as it was, and everything rests.
    Setting { setting: Arc<Setting>, things: Vec<Thing>, screens: Vec<Glide> },
    /// While something is taught: the thing is moved back, for everybody to see.
    Move { index: usize, to: Destination },
}

impl World {
    /// Remembers where something was taken that is about to be let go elsewhere. What goes back to where it was
    /// taken was never moved: there is nothing to take back.
    pub(super) fn remember(&mut self, taken: &Taken) {
        if self.state.mode == SceneMode::SetUp {
            self.state.remember_setting();
            return;
        }
        let to = match taken.seat {
            Some(Seat { on, kind: SeatKind::Hole, .. }) => Destination::Hole(on),
            Some(Seat { on, kind: SeatKind::Top, .. }) => Destination::Top(on),
            None => Destination::Place(Place {
                position_m: taken.from.position_m(),
                heading_rad: taken.from.heading_rad(),
            }),
        };
        self.state.push_undo(Undo::Move { index: taken.index, to });
    }

    pub(super) fn undo(&mut self, now: Instant, who: u16) -> Result<Done, Refusal> {
        self.is_here(who)?;
        if !self.state.taken.is_empty() {
            return refuse("something is in a hand: put it down first");
        }
        match self.state.undo.pop() {
            None => refuse("there is nothing to take back"),
            Some(Undo::Setting { setting, things, screens }) => {
                (self.state.setting, self.state.things, self.state.screens) =
                    (Some(setting), things, screens);
                Ok(Done)
            }
            Some(Undo::Move { index, to }) => {
                let is_still = |thing: &Thing| matches!(thing.motion, Motion::AtRest);
                if !self.state.things.get(index).is_some_and(is_still) {
                    self.state.undo.push(Undo::Move { index, to });
                    return refuse("it still moves: wait until it rests");
                }
                let Some(setting) = self.state.setting.clone() else { return Ok(Done) };
                if crate::world::destination(&self.state.things, &setting.objects, index, to).is_none() {
                    return refuse("where it was there is something else now: it stays where it is");
                }
                crate::world::begin_move(
                    &mut self.state.things,
                    &setting.objects,
                    index,
                    to,
                    (who, now, BACK),
                );
                self.state.diary.note(who, now, Act::Move { object: index, to, takes: BACK });
                Ok(Done)
            }
        }
    }
}

impl State {
    pub(super) fn push_undo(&mut self, undo: Undo) {
        if self.undo.len() == MOST {
            self.undo.remove(0);
        }
        self.undo.push(undo);
    }
}

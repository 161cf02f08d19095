//! Destination of things released by hand.

use config::lesson::{Destination, Role, UprightPose};

use super::{RefusedActError, refuse};
use crate::World;
use crate::settle;
use crate::thing::{Motion, Seat};

/// Snapping distance of a peg to the axis of a hole, in metres.
const SNAP_RADIUS_M: f64 = 0.02;

impl World {
    /// Destination of an object released above a place: a peg goes into the hole there, anything else onto the middle
    /// of the block there, or on the table.
    pub(super) fn drop_destination(
        &self,
        index: usize,
        [x, y]: [f64; 2],
        heading_rad: f64,
    ) -> Result<Destination, RefusedActError> {
        let Some(dropped) = self.objects().get(index) else { return refuse("it is gone") };
        let things = self.state.things.iter().zip(self.objects()).enumerate();
        let below = things.filter(|(other, (thing, _))| {
            *other != index && matches!(thing.motion, Motion::AtRest) && !self.sits_on(*other, index)
        });
        if dropped.kind.role == Role::Peg {
            let hole = below.clone().filter(|(_, (_, object))| object.kind.hole).find(|(_, (thing, _))| {
                let [hole_x, hole_y, _] = thing.pose.position_m();
                (x - hole_x).hypot(y - hole_y) <= SNAP_RADIUS_M
            });
            match hole {
                Some((block, _)) if self.is_free_for(index, block) => {
                    return Ok(Destination::Hole(block));
                }
                Some((_, (_, object))) => return refuse(format!("the hole of `{}` is taken", object.name)),
                None => {}
            }
        }
        let top = |thing: &crate::thing::Thing, half_m: f64| thing.pose.position_m()[2] + half_m;
        let highest = below
            .filter(|(_, (thing, object))| {
                object.kind.role == Role::Block && settle::is_over(&thing.pose, object, x, y)
            })
            .max_by(|(_, (a, of_a)), (_, (b, of_b))| {
                top(a, settle::half_height_m(of_a)).total_cmp(&top(b, settle::half_height_m(of_b)))
            });
        match highest {
            Some((_, (_, object))) if dropped.kind.role == Role::Marker && !object.kind.markable => {
                refuse(format!("`{}` cannot be marked", object.name))
            }
            Some((other, _)) => Ok(Destination::Top(other)),
            None => {
                let position_m = [x, y, settle::half_height_m(dropped)];
                Ok(Destination::UprightPose(UprightPose { position_m, heading_rad }))
            }
        }
    }

    /// Whether a hole is free, and not reserved for a thing that another hand took from it.
    fn is_free_for(&self, index: usize, block: usize) -> bool {
        let mut others = self.state.taken.iter().filter(|taken| taken.index != index);
        settle::is_free(&self.state.things, block) && !others.any(|taken| settle::is_in(taken.seat, block))
    }

    /// Whether one thing sits on another one, directly or indirectly.
    fn sits_on(&self, thing: usize, other: usize) -> bool {
        let mut seat: Option<Seat> = self.state.things.get(thing).and_then(|thing| thing.seat);
        for _ in 0..self.state.things.len() {
            match seat {
                Some(Seat { on, .. }) if on == other => return true,
                Some(Seat { on, .. }) => seat = self.state.things.get(on).and_then(|thing| thing.seat),
                None => return false,
            }
        }
        false
    }
}

//! Computes where a released thing comes to rest.

use clock::{Duration, Instant};
use config::lesson::{Object, Role};
use geometry::{Pose, Position, Thing as Frame, World};

use crate::path::{MotionProfile, Path};
use crate::thing::{Motion, Seat, SeatKind, Thing, above};

/// A released peg slides into a hole whose axis is within this distance, in metres …
const MAX_HOLE_OFFSET_M: f64 = 0.02;
/// … if its lower end is this far below the hole's top, in metres.
const DEPTH_M: std::ops::RangeInclusive<f64> = 0.005..=0.06;
/// Duration of sliding down in a hole.
const SLIDE: Duration = Duration::from_millis(150);
/// Placement tolerance of lessons, in metres.
const PLACEMENT_TOLERANCE_M: f64 = 0.001;
/// Minimum duration of a fall, in seconds; within it the thing also turns upright.
const MIN_FALL_S: f64 = 0.1;
/// Acceleration of free fall, in metres per second squared.
const GRAVITY_M_S2: f64 = 9.81;

/// The final pose of a thing, and what it sits on.
pub(crate) struct Rest {
    pub(crate) pose: Pose<World, Frame>,
    pub(crate) seat: Option<Seat>,
}

impl Rest {
    /// The path to it.
    pub(crate) fn path(&self, from: Pose<World, Frame>, begins: Instant) -> Path {
        let ([.., high], [.., low]) = (from.position_m(), self.pose.position_m());
        let slides = self.seat.is_some_and(|seat| seat.kind == SeatKind::Hole);
        let (manner, takes) = if slides || high <= low {
            (MotionProfile::Glide, SLIDE)
        } else {
            let seconds = (2.0 * (high - low) / GRAVITY_M_S2).sqrt().max(MIN_FALL_S);
            (MotionProfile::Fall, Duration::from_secs_f64(seconds))
        };
        Path { from, to: self.pose, begins, takes, manner }
    }
}

/// Half the height of an object, in metres.
pub(crate) fn half_height_m(object: &Object) -> f64 {
    let [.., half_height_m] = object.kind.half_extents_m;
    half_height_m
}

/// Whether a thing sits in the hole of the object.
pub(crate) fn is_filled(things: &[Thing], block: usize) -> bool {
    things.iter().any(|thing| is_in(thing.seat, block))
}

/// Whether the hole of the object is empty, and no thing is being carried into it.
pub(crate) fn is_free(things: &[Thing], block: usize) -> bool {
    let is_coming = |thing: &Thing| matches!(thing.motion, Motion::Carried { to, .. } if is_in(to, block));
    !is_filled(things, block) && !things.iter().any(is_coming)
}

pub(crate) fn is_in(seat: Option<Seat>, block: usize) -> bool {
    seat.is_some_and(|seat| seat.on == block && seat.kind == SeatKind::Hole)
}

/// The free hole that a released peg slides into, unless `is_kept` reserves it for another one.
pub(crate) fn hole_below(
    things: &[Thing],
    objects: &[Object],
    peg: usize,
    is_kept: impl Fn(usize) -> bool,
) -> Option<Rest> {
    let object = objects.get(peg).filter(|object| object.kind.role == Role::Peg)?;
    let pose = things.get(peg)?.pose;
    let half_height_m = half_height_m(object);
    let [x, y, lower_end_m] = (pose * Position::new(0.0, 0.0, -half_height_m)).to_array();
    let holes = things
        .iter()
        .zip(objects)
        .enumerate()
        .filter(|(_, (thing, object))| object.kind.hole && matches!(thing.motion, Motion::AtRest));
    let (_, depth_m, block) = holes
        .map(|(index, (thing, object))| {
            let [hole_x, hole_y, top_m] = above(&thing.pose, self::half_height_m(object)).position_m();
            ((x - hole_x).hypot(y - hole_y), top_m - lower_end_m, index)
        })
        .filter(|(aside_m, depth_m, _)| *aside_m <= MAX_HOLE_OFFSET_M && DEPTH_M.contains(depth_m))
        .filter(|(.., index)| is_free(things, *index) && !is_kept(*index))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    // The hole goes through the block. The peg slides down until half of it is inside. A deeper peg stays where it is,
    // because nothing lifts it.
    let raised_m = self::half_height_m(objects.get(block)?) + half_height_m - depth_m.max(half_height_m);
    seated(things, block, SeatKind::Hole, raised_m)
}

/// Seats things that were laid in a hole or on top of another one.
pub(crate) fn seat_laid_things(things: &mut [Thing], objects: &[Object]) {
    for index in 0..things.len() {
        let Some(object) = objects.get(index) else { continue };
        let Some(pose) = things.get(index).map(|thing| thing.pose) else { continue };
        let [.., z] = pose.position_m();
        let underside_m = z - half_height_m(object);
        if underside_m < PLACEMENT_TOLERANCE_M {
            continue;
        }
        let seat = if object.kind.role == Role::Peg { enclosing_hole(things, objects, index) } else { None };
        let top = || {
            let rest = support_below(things, objects, index)?;
            let is_there = (rest.pose.position_m()[2] - z).abs() < PLACEMENT_TOLERANCE_M;
            rest.seat.filter(|_| is_there)
        };
        let seat = seat.or_else(top);
        if let Some(thing) = things.get_mut(index) {
            thing.seat = seat;
        }
    }
}

/// The hole that a peg was laid in.
fn enclosing_hole(things: &[Thing], objects: &[Object], peg: usize) -> Option<Seat> {
    let pose = things.get(peg)?.pose;
    let [x, y, z] = pose.position_m();
    let underside_m = z - half_height_m(objects.get(peg)?);
    let block = things.iter().zip(objects).enumerate().position(|(block, (thing, object))| {
        let [hole_x, hole_y, top_m] = above(&thing.pose, half_height_m(object)).position_m();
        let is_round = (x - hole_x).hypot(y - hole_y) < PLACEMENT_TOLERANCE_M
            && underside_m < top_m - PLACEMENT_TOLERANCE_M;
        object.kind.hole && is_round && is_free(things, block)
    })?;
    let x_on_thing = things.get(block)?.pose.inverse() * pose;
    Some(Seat { on: block, kind: SeatKind::Hole, x_on_thing })
}

/// Where a released thing comes to rest: on the highest block below it, or on the table.
pub(crate) fn support_below(things: &[Thing], objects: &[Object], index: usize) -> Option<Rest> {
    let pose = things.get(index)?.pose;
    let half_height_m = half_height_m(objects.get(index)?);
    let [x, y, centre_m] = pose.position_m();
    let top_m = centre_m + half_height_m;
    let supports = things.iter().zip(objects).enumerate().filter(|&(other, (thing, object))| {
        // A thing beside a hole rests on the block's top even if it was released a little lower, because bodies cannot
        // overlap.
        other != index
            && object.kind.role == Role::Block
            && matches!(thing.motion, Motion::AtRest)
            && is_over(&thing.pose, object, x, y)
            && thing.pose.position_m()[2] + self::half_height_m(object) <= top_m
    });
    let highest = supports
        .map(|(other, (thing, object))| (thing.pose.position_m()[2] + self::half_height_m(object), other))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let (support_m, on) = highest.map_or((0.0, None), |(top_m, other)| (top_m, Some(other)));
    let pose = Pose::upright(x, y, support_m + half_height_m, pose.heading_rad());
    let seat = on.and_then(|on| {
        let x_on_thing = things.get(on)?.pose.inverse() * pose;
        Some(Seat { on, kind: SeatKind::Top, x_on_thing })
    });
    Some(Rest { pose, seat })
}

/// An upright pose in the middle of another thing, `raised_m` above its centre.
pub(crate) fn seated(things: &[Thing], on: usize, kind: SeatKind, raised_m: f64) -> Option<Rest> {
    let below = things.get(on)?.pose;
    let pose = above(&below, raised_m);
    Some(Rest { pose, seat: Some(Seat { on, kind, x_on_thing: below.inverse() * pose }) })
}

pub(crate) fn is_over(pose: &Pose<World, Frame>, object: &Object, x: f64, y: f64) -> bool {
    let [_, _, z] = pose.position_m();
    let [x, y, _] = (pose.inverse() * Position::new(x, y, z)).to_array();
    let [half_x, half_y, _] = object.kind.half_extents_m;
    x.abs() <= half_x && y.abs() <= half_y
}

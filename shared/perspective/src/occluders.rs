use clock::{Duration, Instant};
use geometry::{Base, Pose, Position, Thing};
use invariant::invariant;
use message::{Observation, SourceSet};
use scene::Occluders;

use crate::transform::place_of_thing;

/// The last observation of an occluder.
#[derive(Clone, Copy, Debug)]
struct Remembered {
    x_base_box: Pose<Base, Thing>,
    half_extents_m: [f64; 3],
    /// Arrival time of the last frame with it: observation time plus the latency of the source.
    received_at: Instant,
    /// Since when its place has been seen empty.
    empty_since: Option<Instant>,
    /// The source that observed it in the current frame.
    taken_by: Option<u16>,
    /// All sources that ever observed it. Only these can report it as missing.
    seen_by: SourceSet,
}

/// The occluders that a perspective remembers, whether observed at this instant or not.
///
/// They are no beliefs about objects and take no part in learning. Allocates only in `new`.
#[derive(Clone, Debug)]
pub(crate) struct RememberedOccluders {
    remembered: Vec<Remembered>,
    capacity: usize,
    association_distance_m: f64,
    remove_after: Duration,
    shapes: Occluders,
    /// Observations dropped because all slots were taken.
    left_out: u64,
}

impl RememberedOccluders {
    pub(crate) fn new(config: &crate::settings::Occluders) -> Self {
        let capacity = config.max_count.get();
        Self {
            remembered: Vec::with_capacity(capacity),
            capacity,
            association_distance_m: config.association_distance_m.get(),
            remove_after: config.remove_after_ms.duration(),
            shapes: Occluders::new(capacity),
            left_out: 0,
        }
    }

    /// The boxes, in the base frame.
    pub(crate) fn shapes(&self) -> &Occluders {
        &self.shapes
    }

    /// Begins a frame.
    pub(crate) fn begin(&mut self) {
        for remembered in &mut self.remembered {
            remembered.taken_by = None;
        }
    }

    /// Number of occluder observations dropped because all slots were taken.
    pub(crate) const fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Records an observed occluder at arrival time `at`.
    ///
    /// It updates the nearest occluder within `association_distance_m` that this source has not yet observed in this
    /// frame. If all slots are taken, it replaces the one unobserved for longest. If all were observed in
    /// this frame, it is dropped and counted.
    pub(crate) fn observe(&mut self, observation: &Observation, at: Instant) {
        let Some((x_base_box, half_extents_m)) = place_of_thing(observation) else { return };
        let taken_by = Some(observation.source);
        let seen_by = SourceSet::of(observation.source);
        let (received_at, empty_since) = (at, None);
        let new = Remembered { x_base_box, half_extents_m, received_at, empty_since, taken_by, seen_by };
        let nearest = self
            .remembered
            .iter_mut()
            .filter(|old| old.taken_by != taken_by)
            .map(|old| (old.x_base_box.origin().distance(&x_base_box.origin()), old))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(distance, _)| *distance <= self.association_distance_m);
        if let Some((_, old)) = nearest {
            *old = Remembered { seen_by: old.seen_by.union(seen_by), ..new };
        } else if self.remembered.len() < self.capacity {
            self.remembered.push(new);
        } else {
            let not_taken = self.remembered.iter_mut().filter(|old| old.taken_by.is_none());
            match not_taken.min_by_key(|old| old.received_at) {
                Some(old) => *old = new,
                None => self.left_out += 1,
            }
        }
    }

    /// Whether an occluder is remembered within `association_distance_m` of a place.
    pub(crate) fn has_one_at(&self, place: &Position<Base>) -> bool {
        self.remembered
            .iter()
            .any(|old| old.x_base_box.origin().distance(place) <= self.association_distance_m)
    }

    /// Ends a frame.
    pub(crate) fn end(&mut self) {
        self.rebuild();
    }

    /// Restarts the empty-place timers after an absence of the agent.
    pub(crate) fn restart_absence_timers(&mut self) {
        for remembered in &mut self.remembered {
            remembered.empty_since = None;
        }
    }

    /// Removes occluders that stayed unobserved for `remove_after`, although a source that saw them before
    /// `active_sources` and `is_partly_visible` reported part of the box in view all the time.
    ///
    /// An occluder for which `stands` is true stays. Returns whether any was removed.
    pub(crate) fn forget(
        &mut self,
        at: Instant,
        active_sources: SourceSet,
        is_partly_visible: impl Fn(&Pose<Base, Thing>, [f64; 3]) -> bool,
        stands: impl Fn(&Pose<Base, Thing>) -> bool,
    ) -> bool {
        let remove_after = self.remove_after;
        self.remembered.retain_mut(|old| {
            if old.received_at >= at || !active_sources.intersects(old.seen_by) {
                return true;
            }
            let is_empty = is_partly_visible(&old.x_base_box, old.half_extents_m);
            old.empty_since = is_empty.then_some(old.empty_since.unwrap_or(at));
            old.empty_since.is_none_or(|since| at.since(since) < remove_after) || stands(&old.x_base_box)
        });
        let forgot = self.remembered.len() < self.shapes.len();
        if forgot {
            self.rebuild();
        }
        forgot
    }

    fn rebuild(&mut self) {
        self.shapes.clear();
        for old in &self.remembered {
            let added = self.shapes.add(&old.x_base_box, old.half_extents_m);
            invariant!(added.is_ok(), "the capacities are equal, and only valid observations are stored");
        }
    }
}

use clock::{Duration, Instant};
use geometry::{Base, Pose, Position, Thing};
use message::{Observation, SourceSet};
use scene::Occluders;

use crate::transform::place_of_thing;

/// An occluder as it was last observed.
#[derive(Clone, Copy, Debug)]
struct Remembered {
    x_base_box: Pose<Base, Thing>,
    half_extents_m: [f64; 3],
    /// The frame that brought it last: later than it was observed by what its source takes to understand
    /// what it sees.
    noticed_at: Instant,
    /// Since when its place is found empty, if it is.
    empty_since: Option<Instant>,
    /// The source that observed it in the present frame.
    taken_by: Option<u16>,
    /// The sources that ever observed it: they alone can miss it.
    seen_by: SourceSet,
}

/// The occluders that a perspective remembers, observed at this instant or not.
///
/// They are no beliefs about objects of the table: nobody learns a rule about them. Allocates in
/// `new` alone.
#[derive(Clone, Debug)]
pub(crate) struct RememberedOccluders {
    remembered: Vec<Remembered>,
    capacity: usize,
    same_within_m: f64,
    gone_after: Duration,
    shapes: Occluders,
    /// Observations of occluders for which there was no room.
    left_out: u64,
}

impl RememberedOccluders {
    pub(crate) fn new(config: &config::perspective::Occluders) -> Self {
        let capacity = config.most.get();
        Self {
            remembered: Vec::with_capacity(capacity),
            capacity,
            same_within_m: config.same_within_m.get(),
            gone_after: config.gone_after_ms.duration(),
            shapes: Occluders::new(capacity),
            left_out: 0,
        }
    }

    /// The boxes, in the base frame.
    pub(crate) fn shapes(&self) -> &Occluders {
        &self.shapes
    }

    /// A frame begins.
    pub(crate) fn begin(&mut self) {
        for remembered in &mut self.remembered {
            remembered.taken_by = None;
        }
    }

    /// Observations of occluders that hide nothing, because there was no room for them.
    pub(crate) const fn left_out(&self) -> u64 {
        self.left_out
    }

    /// An occluder was observed, and is taken in at `at`: the nearest one that this source has not yet
    /// observed in this frame is the same, if it is near enough. When there is no room, the one longest not
    /// observed is forgotten for it; when all were observed in this frame, the new one is left out and
    /// counted.
    pub(crate) fn observe(&mut self, observation: &Observation, at: Instant) {
        let Some((x_base_box, half_extents_m)) = place_of_thing(observation) else { return };
        let taken_by = Some(observation.source);
        let seen_by = SourceSet::of(observation.source);
        let (noticed_at, empty_since) = (at, None);
        let new = Remembered { x_base_box, half_extents_m, noticed_at, empty_since, taken_by, seen_by };
        let nearest = self
            .remembered
            .iter_mut()
            .filter(|old| old.taken_by != taken_by)
            .map(|old| (old.x_base_box.origin().distance(&x_base_box.origin()), old))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(distance, _)| *distance <= self.same_within_m);
        if let Some((_, old)) = nearest {
            *old = Remembered { seen_by: old.seen_by.union(seen_by), ..new };
        } else if self.remembered.len() < self.capacity {
            self.remembered.push(new);
        } else {
            let not_taken = self.remembered.iter_mut().filter(|old| old.taken_by.is_none());
            match not_taken.min_by_key(|old| old.noticed_at) {
                Some(old) => *old = new,
                None => self.left_out += 1,
            }
        }
    }

    /// Whether one is remembered so near to a place that it would be the same.
    pub(crate) fn has_one_at(&self, place: &Position<Base>) -> bool {
        self.remembered.iter().any(|old| old.x_base_box.origin().distance(place) <= self.same_within_m)
    }

    /// A frame ends.
    pub(crate) fn end(&mut self) {
        self.rebuild();
    }

    /// He whose perspective it is was absent: what was found empty before counts anew.
    pub(crate) fn look_anew(&mut self) {
        for remembered in &mut self.remembered {
            remembered.empty_since = None;
        }
    }

    /// Forgets what has not been observed for long though sources that saw it before `looked`, and
    /// `glimpses` said all the while that some of the box would be seen; unless it `stands` there for another
    /// reason. Whether it forgot any.
    pub(crate) fn forget(
        &mut self,
        at: Instant,
        looked: SourceSet,
        glimpses: impl Fn(&Pose<Base, Thing>, [f64; 3]) -> bool,
        stands: impl Fn(&Pose<Base, Thing>) -> bool,
    ) -> bool {
        let gone_after = self.gone_after;
        self.remembered.retain_mut(|old| {
            if old.noticed_at >= at || !looked.intersects(old.seen_by) {
                return true;
            }
            let is_empty = glimpses(&old.x_base_box, old.half_extents_m);
            old.empty_since = is_empty.then_some(old.empty_since.unwrap_or(at));
            old.empty_since.is_none_or(|since| at.since(since) < gone_after) || stands(&old.x_base_box)
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
            // There is room for as many boxes as are remembered, and only sound observations
            // come here: nothing is refused.
            let _added = self.shapes.add(&old.x_base_box, old.half_extents_m);
        }
    }
}

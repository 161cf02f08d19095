use clock::Instant;

use super::interval::{Interval, IntervalList, MAX_INTERVALS, NO_INTERVALS};

/// The detection history of each belief, which yields the cannot-link constraints: two things that one sensor sees in
/// one frame are two.
///
/// A history is a list of intervals of consecutive frames of a source. So a thing that is always seen needs no more
/// memory than one seen once. Two beliefs cannot be linked exactly if an interval of one overlaps an interval of the
/// other. A belief stores eight intervals. When it is full, the two intervals of one source with the shortest gap are
/// merged. This may add false cannot-links and never removes one. If all intervals are of different sources, the one
/// that ended first is evicted. An interval that contains the frame of the step is never evicted, so a belief cannot be
/// linked with the other detections of that frame.
#[derive(Clone, Debug)]
pub(crate) struct DetectionHistory {
    /// Per slot the only interval, which nearly all beliefs have, in a dense array for the common case.
    only: Box<[InlineIntervals]>,
    /// Per slot the intervals of those that have more than one.
    of: Box<[IntervalList]>,
    /// The frame of the step; the last one if there are several.
    frame: Option<Interval>,
    /// The previous frame of the same source.
    before: Option<Interval>,
    /// Number of frames in the step.
    frames: usize,
}

/// The detection history of a belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InlineIntervals {
    Never,
    /// One interval.
    Interval(Interval),
    /// More than one interval.
    More,
}

impl DetectionHistory {
    pub(crate) fn new(slots: usize) -> Self {
        Self {
            only: vec![InlineIntervals::Never; slots].into_boxed_slice(),
            of: vec![NO_INTERVALS; slots].into_boxed_slice(),
            frame: None,
            before: None,
            frames: 0,
        }
    }

    /// Starts the history of a new belief.
    pub(crate) fn begin(&mut self, slot: usize, run: Interval) {
        if let Some(only) = self.only.get_mut(slot) {
            *only = InlineIntervals::Interval(run);
        }
    }

    /// Clears the history of a slot.
    pub(crate) fn clear(&mut self, slot: usize) {
        if let Some(only) = self.only.get_mut(slot) {
            *only = InlineIntervals::Never;
        }
    }

    /// Sets the previous frame of beliefs that were each detected once, in the frames of one step.
    pub(crate) fn set_previous_frame(
        &mut self,
        slots: &[u32],
        before: impl Fn(u16, Instant) -> Option<Instant>,
    ) {
        (self.frame, self.before, self.frames) = (None, None, 0);
        for &slot in slots {
            let Some(InlineIntervals::Interval(run)) = self.only.get_mut(slot as usize) else { continue };
            // Observations are grouped by frame.
            if !self.frame.is_some_and(|frame| frame.overlaps(run)) {
                self.frame = Some(*run);
                self.frames += 1;
                self.before = before(run.source, run.first).map(|at| Interval::of(run.source, at));
            }
            run.previous_frame = self.before.map(|before| before.first);
        }
    }

    /// Whether a belief was detected in the previous frame of the step's source, if the step has only one frame. Any
    /// two such beliefs cannot be linked.
    #[inline]
    pub(crate) fn was_in_previous_frame(&self, slot: usize) -> bool {
        self.before.as_ref().is_some_and(|before| self.was_detected_in(slot, before))
    }

    /// Whether two beliefs cannot be linked, and still cannot after each was detected in every frame of the step.
    pub(crate) fn remains_cannot_link(&self, a: usize, b: usize) -> bool {
        let remembers = |slot| self.has_room_for(slot, self.frames.max(1));
        self.cannot_link(a, b) && remembers(a) && remembers(b)
    }

    /// Whether `more` intervals can be added to a belief without evicting one.
    pub(crate) fn has_room_for(&self, slot: usize, more: usize) -> bool {
        let intervals = self.intervals(slot);
        // When the list is full, two intervals of one source are merged, which keeps the constraint. An interval is
        // evicted only if there are no such two.
        let room = MAX_INTERVALS.saturating_sub(intervals.len());
        let joins = intervals.windows(2).filter(|pair| matches!(pair, [a, b] if a.source == b.source));
        room >= more || room + joins.count() >= more
    }

    /// Sets the frame of a step whose observations are all of one frame, or that has none.
    pub(crate) fn set_step_frame(&mut self, frame: Option<Interval>) {
        self.frame = frame;
        self.before = frame.and_then(|frame| Some(Interval::of(frame.source, frame.previous_frame?)));
        self.frames = usize::from(frame.is_some());
    }

    /// Whether a belief was detected in an interval.
    #[inline]
    pub(crate) fn was_detected_in(&self, slot: usize, run: &Interval) -> bool {
        match self.only.get(slot) {
            Some(InlineIntervals::Interval(only)) => only.overlaps(run),
            _ => self.intervals(slot).iter().any(|other| other.overlaps(run)),
        }
    }

    /// Whether two beliefs cannot be linked.
    #[inline]
    pub(crate) fn cannot_link(&self, a: usize, b: usize) -> bool {
        if let (Some(InlineIntervals::Interval(a)), Some(InlineIntervals::Interval(b))) =
            (self.only.get(a), self.only.get(b))
        {
            return a.overlaps(b);
        }
        self.intervals(a).iter().any(|run| self.intervals(b).iter().any(|other| run.overlaps(other)))
    }

    /// Whether the only frame in which the belief in `fresh` was detected follows one in which that in `old` was.
    pub(crate) fn continues(&self, old: usize, fresh: usize) -> bool {
        let Some(InlineIntervals::Interval(run)) = self.only.get(fresh) else { return false };
        let before = run.previous_frame.map(|at| Interval::of(run.source, at));
        before.is_some_and(|before| self.was_detected_in(old, &before))
    }

    /// Adds the history of the belief in `gone` to that of the one in `kept`.
    pub(crate) fn merge(&mut self, kept: usize, gone: usize) {
        match self.only.get(gone).copied() {
            Some(InlineIntervals::Interval(next)) => self.add(kept, &next),
            Some(InlineIntervals::More) => {
                let others = self.of.get(gone).copied().unwrap_or(NO_INTERVALS);
                self.unite(kept, others.as_slice());
            }
            Some(InlineIntervals::Never) | None => {}
        }
    }

    /// Adds an interval to the history of a belief.
    #[inline]
    pub(crate) fn add(&mut self, slot: usize, next: &Interval) {
        // The common case: the interval extends an existing one.
        match self.only.get_mut(slot) {
            Some(InlineIntervals::Interval(run)) if run.touches(next) => run.join(next),
            Some(InlineIntervals::More) if self.of.get_mut(slot).is_some_and(|of| of.extend(next)) => {}
            _ => self.unite(slot, std::slice::from_ref(next)),
        }
    }

    fn unite(&mut self, kept: usize, others: &[Interval]) {
        let mut all = NO_INTERVALS;
        for run in self.intervals(kept).iter().chain(others) {
            all.add(*run, self.frame.as_ref());
        }
        let only = match *all.as_slice() {
            [] => InlineIntervals::Never,
            [run] => InlineIntervals::Interval(run),
            _ => InlineIntervals::More,
        };
        if let (Some(held), Some(intervals)) = (self.only.get_mut(kept), self.of.get_mut(kept)) {
            (*held, *intervals) = (only, all);
        }
    }

    #[inline]
    pub(crate) fn intervals(&self, slot: usize) -> &[Interval] {
        match self.only.get(slot) {
            Some(InlineIntervals::Interval(run)) => std::slice::from_ref(run),
            Some(InlineIntervals::More) => self.of.get(slot).map_or(&[], IntervalList::as_slice),
            Some(InlineIntervals::Never) | None => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    /// Beliefs and the frames in which they were detected: a set of (source, frame number).
    fn sighted() -> impl Strategy<Value = Vec<BTreeSet<(u16, u64)>>> {
        let frames = prop::collection::btree_set((0..2_u16, 0..24_u64), 1..10);
        prop::collection::vec(frames, 2..6)
    }

    /// The history of a belief whose detections come one by one, in any order.
    fn remembered(frames: &[(u16, u64)]) -> IntervalList {
        let at = |number: u64| Instant::from_nanos(100 + 10 * number);
        let mut intervals = NO_INTERVALS;
        for &(source, number) in frames {
            let previous_frame = number.checked_sub(1).map(at);
            intervals.add(Interval { previous_frame, ..Interval::of(source, at(number)) }, None);
        }
        intervals
    }

    /// Two beliefs, in slots 0 and 1.
    fn two(a: IntervalList, b: IntervalList) -> DetectionHistory {
        let mut detection_history = DetectionHistory::new(4);
        for (slot, intervals) in [a, b].iter().enumerate() {
            for run in intervals.as_slice() {
                detection_history.begin(3, *run);
                detection_history.merge(slot, 3);
            }
        }
        detection_history
    }

    fn apart(a: IntervalList, b: IntervalList) -> bool {
        two(a, b).cannot_link(0, 1)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn only_simultaneous_detections_cannot_link_within_the_capacity(sighted in sighted(), seed in any::<u64>()) {
            let intervals: Vec<_> = sighted.iter().map(|frames| {
                let mut order: Vec<_> = frames.iter().copied().collect();
                order.sort_by_key(|(source, number)| (number ^ seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(*source));
                remembered(&order)
            }).collect();
            for (a, of_a) in sighted.iter().zip(&intervals) {
                for (b, of_b) in sighted.iter().zip(&intervals) {
                    let at_once = !a.is_disjoint(b);
                    if at_once || (of_a.len < MAX_INTERVALS && of_b.len < MAX_INTERVALS) {
                        prop_assert_eq!(apart(*of_a, *of_b), at_once, "{:?} {:?}", of_a, of_b);
                    }
                }
            }
        }

        #[test]
        fn cannot_links_persist_after_further_detections(
            of in prop::array::uniform2(prop::collection::vec((0..10_u16, 0..40_u64), 1..24)),
            more in prop::array::uniform2((0..10_u16, 0..50_u64)),
            sources in 1..11_u16,
            numbers in 1..40_u64,
        ) {
            let few = |frames: &[(u16, u64)]| -> Vec<_> {
                frames.iter().map(|(source, number)| (source % sources, number % numbers)).collect()
            };
            let [a, b] = of.map(|frames| remembered(&few(&frames)));
            let mut detection_history = two(a, b);
            let remains_cannot_link = detection_history.remains_cannot_link(0, 1);
            for (slot, frame) in few(&more).iter().enumerate() {
                for run in remembered(&[*frame]).as_slice() {
                    detection_history.begin(3, *run);
                    detection_history.merge(slot, 3);
                }
            }
            prop_assert!(detection_history.cannot_link(0, 1) || !remains_cannot_link);
        }

        #[test]
        fn within_the_capacity_merge_order_does_not_change_the_intervals(sighted in sighted()) {
            let all: Vec<_> = sighted.iter().flatten().copied().take(MAX_INTERVALS).collect();
            let mut backwards = all.clone();
            backwards.reverse();
            let (one, other) = (remembered(&all), remembered(&backwards));
            prop_assert_eq!(one.as_slice(), other.as_slice());
        }
    }

    #[test]
    fn uninterrupted_detections_form_one_interval() {
        let frames: Vec<_> = (0..1_000).map(|number| (0, number)).collect();
        assert_eq!(remembered(&frames).len, 1);
    }

    #[test]
    fn beyond_the_capacity_the_shortest_interruption_is_dropped() {
        // Nine detections with growing gaps: the first two are merged into one interval.
        let frames: Vec<_> = (0..9).map(|number| (0, number * (number + 3))).collect();
        let intervals = remembered(&frames);
        assert_eq!(intervals.len, MAX_INTERVALS);
        assert!(apart(intervals, remembered(&[(0, 2)])), "between the first and the second");
        assert!(!apart(intervals, remembered(&[(0, 7)])), "between the second and the third");
    }

    #[test]
    fn alternating_detections_keep_their_cannot_link_at_full_capacity() {
        // Each belief misses every third frame, in turn.
        let frames = |first| (0..60).filter(move |number| number % 3 != first).map(|number| (0, number));
        let [a, b] = [0, 1].map(|first| remembered(&frames(first).collect::<Vec<_>>()));
        assert_eq!([a.len, b.len], [MAX_INTERVALS; 2]);
        assert!(two(a, b).remains_cannot_link(0, 1));
    }

    #[test]
    fn beyond_the_source_capacity_the_latest_sources_are_kept() {
        let frames: Vec<_> = (0..9).map(|number| (u16::try_from(number).unwrap(), number)).collect();
        let intervals = remembered(&frames);
        assert!(!apart(intervals, remembered(&[(0, 0)])) && apart(intervals, remembered(&[(8, 8)])));
    }
}

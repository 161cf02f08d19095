use clock::Instant;

/// Largest number of detection intervals per belief.
const RUNS: usize = 8;

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
pub(crate) struct Sightings {
    /// Per slot the only interval, which nearly all beliefs have, in a dense array for the common case.
    only: Box<[Only]>,
    /// Per slot the intervals of those that have more than one.
    of: Box<[Runs]>,
    /// The frame of the step; the last one if there are several.
    frame: Option<Run>,
    /// The previous frame of the same source.
    before: Option<Run>,
    /// Number of frames in the step.
    frames: usize,
}

/// The detection history of a belief.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Only {
    Never,
    /// One interval.
    Run(Run),
    /// More than one interval.
    More,
}

/// An interval of consecutive frames of a source, in each of which the belief was detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) source: u16,
    pub(crate) first: Instant,
    pub(crate) last: Instant,
    /// The source's frame before the first one of the interval.
    pub(crate) follows: Option<Instant>,
}

impl Run {
    /// The interval of a single frame.
    pub(crate) fn of(source: u16, at: Instant) -> Self {
        Self { source, first: at, last: at, follows: None }
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.source == other.source && self.first <= other.last && other.first <= self.last
    }

    /// Whether the intervals are adjacent: no frame of the source lies between them.
    fn continues(&self, other: &Self) -> bool {
        self.source == other.source && (self.follows == Some(other.last) || other.follows == Some(self.last))
    }

    fn touches(&self, other: &Self) -> bool {
        self.overlaps(other) || self.continues(other)
    }

    fn joined(mut self, other: &Self) -> Self {
        self.join(other);
        self
    }

    fn join(&mut self, other: &Self) {
        if other.first < self.first {
            (self.first, self.follows) = (other.first, other.follows);
        }
        self.last = self.last.max(other.last);
    }
}

/// Intervals, ordered by source and start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Runs {
    len: usize,
    runs: [Run; RUNS],
}

const NO_RUN: Run = Run { source: 0, first: Instant::EPOCH, last: Instant::EPOCH, follows: None };
const NEVER: Runs = Runs { len: 0, runs: [NO_RUN; RUNS] };

impl Sightings {
    pub(crate) fn new(slots: usize) -> Self {
        Self {
            only: vec![Only::Never; slots].into_boxed_slice(),
            of: vec![NEVER; slots].into_boxed_slice(),
            frame: None,
            before: None,
            frames: 0,
        }
    }

    /// Starts the history of a new belief.
    pub(crate) fn begin(&mut self, slot: usize, run: Run) {
        if let Some(only) = self.only.get_mut(slot) {
            *only = Only::Run(run);
        }
    }

    /// Clears the history of a slot.
    pub(crate) fn clear(&mut self, slot: usize) {
        if let Some(only) = self.only.get_mut(slot) {
            *only = Only::Never;
        }
    }

    /// Sets the previous frame of beliefs that were each detected once, in the frames of one step.
    pub(crate) fn follow(&mut self, slots: &[u32], before: impl Fn(u16, Instant) -> Option<Instant>) {
        (self.frame, self.before, self.frames) = (None, None, 0);
        for &slot in slots {
            let Some(Only::Run(run)) = self.only.get_mut(slot as usize) else { continue };
            // Observations are grouped by frame.
            if !self.frame.is_some_and(|frame| frame.overlaps(run)) {
                self.frame = Some(*run);
                self.frames += 1;
                self.before = before(run.source, run.first).map(|at| Run::of(run.source, at));
            }
            run.follows = self.before.map(|before| before.first);
        }
    }

    /// Whether a belief was detected in the previous frame of the step's source, if the step has only one frame. Any
    /// two such beliefs cannot be linked.
    #[inline]
    pub(crate) fn was_there(&self, slot: usize) -> bool {
        self.before.as_ref().is_some_and(|before| self.saw(slot, before))
    }

    /// Whether two beliefs cannot be linked, and still cannot after each was detected in every frame of the step.
    pub(crate) fn stay_apart(&self, a: usize, b: usize) -> bool {
        let remembers = |slot| self.has_room_for(slot, self.frames.max(1));
        self.are_apart(a, b) && remembers(a) && remembers(b)
    }

    /// Whether `more` intervals can be added to a belief without evicting one.
    pub(crate) fn has_room_for(&self, slot: usize, more: usize) -> bool {
        let runs = self.runs(slot);
        // When the list is full, two intervals of one source are merged, which keeps the constraint. An interval is
        // evicted only if there are no such two.
        let room = RUNS.saturating_sub(runs.len());
        let joins = runs.windows(2).filter(|pair| matches!(pair, [a, b] if a.source == b.source));
        room >= more || room + joins.count() >= more
    }

    /// Sets the frame of a step whose observations are all of one frame, or that has none.
    pub(crate) fn follow_frame(&mut self, frame: Option<Run>) {
        self.frame = frame;
        self.before = frame.and_then(|frame| Some(Run::of(frame.source, frame.follows?)));
        self.frames = usize::from(frame.is_some());
    }

    /// Whether a belief was detected in an interval.
    #[inline]
    pub(crate) fn saw(&self, slot: usize, run: &Run) -> bool {
        match self.only.get(slot) {
            Some(Only::Run(only)) => only.overlaps(run),
            _ => self.runs(slot).iter().any(|other| other.overlaps(run)),
        }
    }

    /// Whether two beliefs cannot be linked.
    #[inline]
    pub(crate) fn are_apart(&self, a: usize, b: usize) -> bool {
        if let (Some(Only::Run(a)), Some(Only::Run(b))) = (self.only.get(a), self.only.get(b)) {
            return a.overlaps(b);
        }
        self.runs(a).iter().any(|run| self.runs(b).iter().any(|other| run.overlaps(other)))
    }

    /// Adds the history of the belief in `gone` to that of the one in `kept`.
    pub(crate) fn merge(&mut self, kept: usize, gone: usize) {
        match self.only.get(gone).copied() {
            Some(Only::Run(next)) => self.add(kept, &next),
            Some(Only::More) => {
                let others = self.of.get(gone).copied().unwrap_or(NEVER);
                self.unite(kept, others.as_slice());
            }
            Some(Only::Never) | None => {}
        }
    }

    /// Adds an interval to the history of a belief.
    #[inline]
    pub(crate) fn add(&mut self, slot: usize, next: &Run) {
        // The common case: the interval extends an existing one.
        match self.only.get_mut(slot) {
            Some(Only::Run(run)) if run.touches(next) => run.join(next),
            Some(Only::More) if self.of.get_mut(slot).is_some_and(|of| of.extend(next)) => {}
            _ => self.unite(slot, std::slice::from_ref(next)),
        }
    }

    fn unite(&mut self, kept: usize, others: &[Run]) {
        let mut all = NEVER;
        for run in self.runs(kept).iter().chain(others) {
            all.add(*run, self.frame.as_ref());
        }
        let only = match *all.as_slice() {
            [] => Only::Never,
            [run] => Only::Run(run),
            _ => Only::More,
        };
        if let (Some(held), Some(runs)) = (self.only.get_mut(kept), self.of.get_mut(kept)) {
            (*held, *runs) = (only, all);
        }
    }

    #[inline]
    pub(crate) fn runs(&self, slot: usize) -> &[Run] {
        match self.only.get(slot) {
            Some(Only::Run(run)) => std::slice::from_ref(run),
            Some(Only::More) => self.of.get(slot).map_or(&[], Runs::as_slice),
            Some(Only::Never) | None => &[],
        }
    }
}

impl Runs {
    fn as_slice(&self) -> &[Run] {
        self.runs.get(..self.len).unwrap_or(&[])
    }

    /// Adds an interval. `frame` is that of the step.
    fn add(&mut self, mut run: Run, frame: Option<&Run>) {
        while let Some(index) = self.as_slice().iter().position(|other| run.touches(other)) {
            run.join(&self.remove(index));
        }
        if self.len == RUNS {
            run = self.make_room(run, frame);
        }
        let key = |run: &Run| (run.source, run.first);
        let index = self.as_slice().partition_point(|other| key(other) < key(&run));
        self.len += 1;
        if let Some(tail) = self.runs.get_mut(index..self.len) {
            tail.rotate_right(1);
        }
        if let Some(place) = self.runs.get_mut(index) {
            *place = run;
        }
    }

    /// Adds an interval that touches exactly one other and does not start before it. Otherwise returns `false`, with
    /// nothing changed.
    fn extend(&mut self, run: &Run) -> bool {
        let mut touched = self.runs.iter_mut().take(self.len).filter(|other| run.touches(other));
        match (touched.next(), touched.next()) {
            (Some(only), None) if only.first <= run.first => {
                only.join(run);
                true
            }
            _ => false,
        }
    }

    fn remove(&mut self, index: usize) -> Run {
        if let Some(tail) = self.runs.get_mut(index..self.len) {
            tail.rotate_left(1);
            self.len -= 1;
        }
        self.runs.get(self.len).copied().unwrap_or(NO_RUN)
    }

    /// Makes room for `run` and returns the interval that remains to be added. Merges the two intervals of one source
    /// with the shortest gap. If all are of different sources, it evicts the one that ended first, except one that
    /// contains the `frame` of the step.
    fn make_room(&mut self, run: Run, frame: Option<&Run>) -> Run {
        let gap = |a: &Run, b: &Run| {
            let (earlier, later) = if a.first <= b.first { (a, b) } else { (b, a) };
            later.first.since(earlier.last)
        };
        let runs = self.as_slice();
        let neighbours = runs.windows(2).enumerate().filter_map(|(index, pair)| {
            let [a, b] = pair else { return None };
            (a.source == b.source).then(|| (gap(a, b), a.first, index, index + 1))
        });
        let of_new = runs.iter().enumerate().filter(|(_, other)| other.source == run.source);
        let of_new = of_new.map(|(index, other)| (gap(other, &run), other.first.min(run.first), index, RUNS));
        match neighbours.chain(of_new).min() {
            Some((_, _, index, RUNS)) => run.joined(&self.remove(index)),
            Some((_, _, index, next)) => {
                let joined = self.remove(next).joined(&self.remove(index));
                self.add(joined, frame);
                run
            }
            None => {
                let all = runs.iter().chain([&run]).enumerate();
                let may_go = all.filter(|(_, run)| !frame.is_some_and(|frame| run.overlaps(frame)));
                match may_go.min_by_key(|(_, run)| run.last) {
                    Some((index, _)) if index < RUNS => {
                        self.remove(index);
                        run
                    }
                    // `run` itself is the one to evict: return an existing interval, which is added again.
                    Some(_) | None => self.remove(RUNS - 1),
                }
            }
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
    fn remembered(frames: &[(u16, u64)]) -> Runs {
        let at = |number: u64| Instant::from_nanos(100 + 10 * number);
        let mut runs = NEVER;
        for &(source, number) in frames {
            let follows = number.checked_sub(1).map(at);
            runs.add(Run { follows, ..Run::of(source, at(number)) }, None);
        }
        runs
    }

    /// Two beliefs, in slots 0 and 1.
    fn two(a: Runs, b: Runs) -> Sightings {
        let mut sightings = Sightings::new(4);
        for (slot, runs) in [a, b].iter().enumerate() {
            for run in runs.as_slice() {
                sightings.begin(3, *run);
                sightings.merge(slot, 3);
            }
        }
        sightings
    }

    fn apart(a: Runs, b: Runs) -> bool {
        two(a, b).are_apart(0, 1)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn two_beliefs_sighted_at_once_are_apart_and_within_the_room_no_others(sighted in sighted(), seed in any::<u64>()) {
            let runs: Vec<_> = sighted.iter().map(|frames| {
                let mut order: Vec<_> = frames.iter().copied().collect();
                order.sort_by_key(|(source, number)| (number ^ seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(*source));
                remembered(&order)
            }).collect();
            for (a, of_a) in sighted.iter().zip(&runs) {
                for (b, of_b) in sighted.iter().zip(&runs) {
                    let at_once = !a.is_disjoint(b);
                    if at_once || (of_a.len < RUNS && of_b.len < RUNS) {
                        prop_assert_eq!(apart(*of_a, *of_b), at_once, "{:?} {:?}", of_a, of_b);
                    }
                }
            }
        }

        #[test]
        fn who_stay_apart_are_apart_whatever_each_is_sighted_in_once_more(
            of in prop::array::uniform2(prop::collection::vec((0..10_u16, 0..40_u64), 1..24)),
            more in prop::array::uniform2((0..10_u16, 0..50_u64)),
            sources in 1..11_u16,
            numbers in 1..40_u64,
        ) {
            let few = |frames: &[(u16, u64)]| -> Vec<_> {
                frames.iter().map(|(source, number)| (source % sources, number % numbers)).collect()
            };
            let [a, b] = of.map(|frames| remembered(&few(&frames)));
            let mut sightings = two(a, b);
            let stay_apart = sightings.stay_apart(0, 1);
            for (slot, frame) in few(&more).iter().enumerate() {
                for run in remembered(&[*frame]).as_slice() {
                    sightings.begin(3, *run);
                    sightings.merge(slot, 3);
                }
            }
            prop_assert!(sightings.are_apart(0, 1) || !stay_apart);
        }

        #[test]
        fn within_the_room_the_order_of_merging_makes_no_difference(sighted in sighted()) {
            let all: Vec<_> = sighted.iter().flatten().copied().take(RUNS).collect();
            let mut backwards = all.clone();
            backwards.reverse();
            let (one, other) = (remembered(&all), remembered(&backwards));
            prop_assert_eq!(one.as_slice(), other.as_slice());
        }
    }

    #[test]
    fn a_thing_seen_all_the_time_is_one_run() {
        let frames: Vec<_> = (0..1_000).map(|number| (0, number)).collect();
        assert_eq!(remembered(&frames).len, 1);
    }

    #[test]
    fn without_room_the_shortest_interruption_is_forgotten() {
        // Nine detections with growing gaps: the first two are merged into one interval.
        let frames: Vec<_> = (0..9).map(|number| (0, number * (number + 3))).collect();
        let runs = remembered(&frames);
        assert_eq!(runs.len, RUNS);
        assert!(apart(runs, remembered(&[(0, 2)])), "between the first and the second");
        assert!(!apart(runs, remembered(&[(0, 7)])), "between the second and the third");
    }

    #[test]
    fn two_that_were_missed_often_stay_apart() {
        // Each belief misses every third frame, in turn.
        let frames = |first| (0..60).filter(move |number| number % 3 != first).map(|number| (0, number));
        let [a, b] = [0, 1].map(|first| remembered(&frames(first).collect::<Vec<_>>()));
        assert_eq!([a.len, b.len], [RUNS; 2]);
        assert!(two(a, b).stay_apart(0, 1));
    }

    #[test]
    fn of_more_sources_than_there_is_room_for_the_latest_count() {
        let frames: Vec<_> = (0..9).map(|number| (u16::try_from(number).unwrap(), number)).collect();
        let runs = remembered(&frames);
        assert!(!apart(runs, remembered(&[(0, 0)])) && apart(runs, remembered(&[(8, 8)])));
    }
}

use clock::Instant;
use invariant::require;

/// Largest number of detection intervals per belief.
pub(super) const MAX_INTERVALS: usize = 8;

/// An interval of consecutive frames of a source, in each of which the belief was detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Interval {
    pub(crate) source: u16,
    pub(crate) first: Instant,
    pub(crate) last: Instant,
    /// The source's frame before the first one of the interval.
    pub(crate) previous_frame: Option<Instant>,
}

impl Interval {
    /// The interval of a single frame.
    pub(crate) fn of(source: u16, at: Instant) -> Self {
        Self { source, first: at, last: at, previous_frame: None }
    }

    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.source == other.source && self.first <= other.last && other.first <= self.last
    }

    /// Whether the intervals are adjacent: no frame of the source lies between them.
    fn continues(&self, other: &Self) -> bool {
        self.source == other.source
            && (self.previous_frame == Some(other.last) || other.previous_frame == Some(self.last))
    }

    pub(super) fn touches(&self, other: &Self) -> bool {
        self.overlaps(other) || self.continues(other)
    }

    fn joined(mut self, other: &Self) -> Self {
        self.join(other);
        self
    }

    pub(super) fn join(&mut self, other: &Self) {
        if other.first < self.first {
            (self.first, self.previous_frame) = (other.first, other.previous_frame);
        }
        self.last = self.last.max(other.last);
    }
}

/// Intervals, ordered by source and start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct IntervalList {
    pub(super) len: usize,
    intervals: [Interval; MAX_INTERVALS],
}

const EMPTY_INTERVAL: Interval =
    Interval { source: 0, first: Instant::EPOCH, last: Instant::EPOCH, previous_frame: None };
pub(super) const NO_INTERVALS: IntervalList =
    IntervalList { len: 0, intervals: [EMPTY_INTERVAL; MAX_INTERVALS] };

impl IntervalList {
    pub(super) fn as_slice(&self) -> &[Interval] {
        self.intervals.get(..self.len).unwrap_or(&[])
    }

    /// Adds an interval. `frame` is that of the step.
    pub(super) fn add(&mut self, mut run: Interval, frame: Option<&Interval>) {
        while let Some(index) = self.as_slice().iter().position(|other| run.touches(other)) {
            run.join(&self.remove(index));
        }
        if self.len == MAX_INTERVALS {
            run = self.make_room(run, frame);
        }
        let key = |run: &Interval| (run.source, run.first);
        let index = self.as_slice().partition_point(|other| key(other) < key(&run));
        let tail = require!(self.intervals.get_mut(index..=self.len), "there is room for an interval");
        let Some(tail) = tail else { return };
        tail.rotate_right(1);
        if let Some(place) = tail.first_mut() {
            *place = run;
        }
        self.len += 1;
    }

    /// Adds an interval that touches exactly one other and does not start before it. Otherwise returns `false`, with
    /// nothing changed.
    pub(super) fn extend(&mut self, run: &Interval) -> bool {
        let mut touched = self.intervals.iter_mut().take(self.len).filter(|other| run.touches(other));
        match (touched.next(), touched.next()) {
            (Some(only), None) if only.first <= run.first => {
                only.join(run);
                true
            }
            _ => false,
        }
    }

    fn remove(&mut self, index: usize) -> Interval {
        if let Some(tail) = self.intervals.get_mut(index..self.len) {
            tail.rotate_left(1);
            self.len -= 1;
        }
        let removed = require!(self.intervals.get(self.len), "there was an interval {index}");
        removed.copied().unwrap_or(EMPTY_INTERVAL)
    }

    /// Makes room for `run` and returns the interval that remains to be added. Merges the two intervals of one source
    /// with the shortest gap. If all are of different sources, it evicts the one that ended first, except one that
    /// contains the `frame` of the step.
    fn make_room(&mut self, run: Interval, frame: Option<&Interval>) -> Interval {
        let gap = |a: &Interval, b: &Interval| {
            let (earlier, later) = if a.first <= b.first { (a, b) } else { (b, a) };
            later.first.since(earlier.last)
        };
        let intervals = self.as_slice();
        let neighbours = intervals.windows(2).enumerate().filter_map(|(index, pair)| {
            let [a, b] = pair else { return None };
            (a.source == b.source).then(|| (gap(a, b), a.first, index, index + 1))
        });
        let of_new = intervals.iter().enumerate().filter(|(_, other)| other.source == run.source);
        let of_new =
            of_new.map(|(index, other)| (gap(other, &run), other.first.min(run.first), index, MAX_INTERVALS));
        match neighbours.chain(of_new).min() {
            Some((_, _, index, MAX_INTERVALS)) => run.joined(&self.remove(index)),
            Some((_, _, index, next)) => {
                let joined = self.remove(next).joined(&self.remove(index));
                self.add(joined, frame);
                run
            }
            None => {
                let all = intervals.iter().chain([&run]).enumerate();
                let may_go = all.filter(|(_, run)| !frame.is_some_and(|frame| run.overlaps(frame)));
                match may_go.min_by_key(|(_, run)| run.last) {
                    Some((index, _)) if index < MAX_INTERVALS => {
                        self.remove(index);
                        run
                    }
                    // `run` itself is the one to evict: return an existing interval, which is added again.
                    Some(_) | None => self.remove(MAX_INTERVALS - 1),
                }
            }
        }
    }
}

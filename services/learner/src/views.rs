use std::collections::{BTreeMap, BTreeSet};

use clock::{Duration, Instant};
use message::{Belief, BeliefHead};
use tasks::{Identities, Language, Snapshot, WriterState};

/// For this long after a restart an object is matched only to the nearest one of its class ...
const REMATCH_NEARBY_TIME: Duration = Duration::from_millis(500);
/// ... within this distance, in metres; later at any distance, because it may have been moved.
const REMATCH_NEARBY_M: f64 = 0.05;
/// Time after a restart until unmatched objects count as lost.
const REMATCH_TIMEOUT: Duration = Duration::from_secs(2);
/// Interval of the snapshots for matching objects after a restart.
const SNAPSHOT_PERIOD: Duration = Duration::from_millis(100);

/// The current beliefs of every perspective, with identities that survive a restart of the belief process.
#[derive(Clone, Debug, Default)]
pub(crate) struct Views {
    frames: BTreeMap<u16, Frame>,
    /// The newest snapshots. They provide the previous values of the states (hysteresis), and the objects to match
    /// after a restart.
    known: BTreeMap<u16, Snapshot>,
    known_at: Instant,
    broken: Option<Rematching>,
    broken_at: Option<Instant>,
}

#[derive(Clone, Debug)]
struct Frame {
    head: BeliefHead,
    beliefs: Vec<Belief>,
    identities: Identities,
}

/// A restart of the belief process after which not all perspectives have matched their objects.
#[derive(Clone, Debug)]
struct Rematching {
    since: Instant,
    perspectives: BTreeSet<u16>,
}

/// The validity of the object identities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Continuity {
    /// They are valid.
    Kept,
    /// Objects are being matched.
    Searching,
    /// An object was not matched: the identities are invalid.
    Lost,
}

impl Views {
    /// Stores the beliefs of an instant; `true` if a belief process was restarted.
    pub(crate) fn update(&mut self, now: Instant, beliefs: &[(&BeliefHead, &[Belief])]) -> bool {
        let mut anew = false;
        for (head, entries) in beliefs {
            let Ok(perspective) = u16::try_from(head.perspective) else { continue };
            let frame = self.frames.entry(perspective).or_insert_with(|| Frame {
                head: **head,
                beliefs: Vec::new(),
                identities: Identities::default(),
            });
            frame.head = **head;
            frame.beliefs.clear();
            frame.beliefs.extend_from_slice(entries);
            if frame.identities.observe(head.header.incarnation) == WriterState::Restarted {
                anew = true;
                let since = now;
                let broken = self.broken.get_or_insert(Rematching { since, perspectives: BTreeSet::new() });
                broken.since = since;
                broken.perspectives.insert(perspective);
                self.broken_at = Some(now);
            }
        }
        anew
    }

    /// Matches the objects after a restart, if there was one.
    pub(crate) fn resume(&mut self, now: Instant, language: &Language) -> Continuity {
        let Some(broken) = &mut self.broken else { return Continuity::Kept };
        let elapsed = now.since(broken.since);
        let within_m = if elapsed < REMATCH_NEARBY_TIME { REMATCH_NEARBY_M } else { f64::INFINITY };
        let (frames, known) = (&mut self.frames, &self.known);
        broken.perspectives.retain(|perspective| {
            let (Some(frame), Some(old)) = (frames.get_mut(perspective), known.get(perspective)) else {
                return false;
            };
            let new = frame.snapshot(language, None);
            !frame.identities.rematch(old, &new, within_m)
        });
        if broken.perspectives.is_empty() {
            self.broken = None;
            Continuity::Kept
        } else if elapsed < REMATCH_TIMEOUT {
            Continuity::Searching
        } else {
            self.cancel_rematching();
            Continuity::Lost
        }
    }

    /// Cancels the matching and drops the snapshots.
    pub(crate) fn cancel_rematching(&mut self) {
        self.broken = None;
        self.known.clear();
    }

    /// Whether the belief process restarted recently, so that objects may still be missing.
    pub(crate) fn is_settling(&self, now: Instant) -> bool {
        self.broken_at.is_some_and(|at| now.since(at) < REMATCH_NEARBY_TIME)
    }

    /// Deep copies of the current beliefs of the perspectives.
    pub(crate) fn snapshots(
        &mut self,
        now: Instant,
        language: &Language,
        of: &[u16],
    ) -> BTreeMap<u16, Snapshot> {
        let mut snapshots = BTreeMap::new();
        for perspective in of {
            if let Some(frame) = self.frames.get(perspective) {
                snapshots.insert(*perspective, frame.snapshot(language, self.known.get(perspective)));
            }
        }
        self.known.clone_from(&snapshots);
        self.known_at = now;
        snapshots
    }

    /// Takes a snapshot periodically; returns the robot's own one when it did.
    pub(crate) fn snapshot_periodically(
        &mut self,
        now: Instant,
        language: &Language,
        of: &[u16],
    ) -> Option<&Snapshot> {
        if now.since(self.known_at) < SNAPSHOT_PERIOD {
            return None;
        }
        self.snapshots(now, language, of);
        self.known.get(&0)
    }

    /// A snapshot of the robot's own current beliefs.
    pub(crate) fn own(&self, language: &Language) -> Option<Snapshot> {
        self.frames.get(&0).map(|frame| frame.snapshot(language, self.known.get(&0)))
    }

    /// The time of the robot's own beliefs, if any.
    pub(crate) fn own_at(&self) -> Option<Instant> {
        self.frames.get(&0).map(|frame| Instant::from_nanos(frame.head.header.valid_at_ns))
    }

    /// The robot's own beliefs, as received.
    pub(crate) fn own_beliefs(&self) -> &[Belief] {
        self.frames.get(&0).map_or(&[], |frame| &frame.beliefs)
    }
}

impl Frame {
    fn snapshot(&self, language: &Language, previous: Option<&Snapshot>) -> Snapshot {
        Snapshot::of(language, &self.head, &self.beliefs, &self.identities, previous)
    }
}

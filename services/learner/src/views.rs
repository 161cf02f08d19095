use std::collections::{BTreeMap, BTreeSet};

use clock::{Duration, Instant};
use message::{Belief, BeliefHead};
use tasks::{Identities, Language, Moment, Snapshot};

/// The nearest object of its class is the same object for this long after continuity broke ...
const NEARBY: Duration = Duration::from_millis(500);
/// ... if it is within this distance, in metres; afterwards it may be anywhere (it was moved).
const NEARBY_M: f64 = 0.05;
/// Objects that have not been found again after this long are lost.
const LOST: Duration = Duration::from_secs(2);
/// How often the present is remembered, to find objects again by.
const REMEMBER: Duration = Duration::from_millis(100);

/// What every perspective believes now, with identities that outlive the belief process.
#[derive(Clone, Debug, Default)]
pub(crate) struct Views {
    frames: BTreeMap<u16, Frame>,
    /// The newest snapshots: states in doubt stay as they were here, and after a break of
    /// continuity the objects are looked for from here.
    known: BTreeMap<u16, Snapshot>,
    known_at: Instant,
    broken: Option<Broken>,
    broken_at: Option<Instant>,
}

#[derive(Clone, Debug)]
struct Frame {
    head: BeliefHead,
    beliefs: Vec<Belief>,
    identities: Identities,
}

/// A break of continuity after which not all perspectives have found their objects again.
#[derive(Clone, Debug)]
struct Broken {
    since: Instant,
    perspectives: BTreeSet<u16>,
}

/// Whether identities mean what they meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Continuity {
    /// They do.
    Kept,
    /// Objects are being looked for.
    Searching,
    /// Some object was not found again: what was known of identities is void.
    Lost,
}

impl Views {
    /// Takes the beliefs of an instant; `true` when a belief process began anew.
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
            if frame.identities.observe(head.header.incarnation) == Moment::Anew {
                anew = true;
                let since = now;
                let broken = self.broken.get_or_insert(Broken { since, perspectives: BTreeSet::new() });
                broken.since = since;
                broken.perspectives.insert(perspective);
                self.broken_at = Some(now);
            }
        }
        anew
    }

    /// Finds the objects again after a break, if there was one.
    pub(crate) fn resume(&mut self, now: Instant, language: &Language) -> Continuity {
        let Some(broken) = &mut self.broken else { return Continuity::Kept };
        let elapsed = now.since(broken.since);
        let within_m = if elapsed < NEARBY { NEARBY_M } else { f64::INFINITY };
        let (frames, known) = (&mut self.frames, &self.known);
        broken.perspectives.retain(|perspective| {
            let (Some(frame), Some(old)) = (frames.get_mut(perspective), known.get(perspective)) else {
                return false;
            };
            let new = frame.snapshot(language, None);
            !frame.identities.find_again(old, &new, within_m)
        });
        if broken.perspectives.is_empty() {
            self.broken = None;
            Continuity::Kept
        } else if elapsed < LOST {
            Continuity::Searching
        } else {
            self.forget();
            Continuity::Lost
        }
    }

    /// Nothing need be found again.
    pub(crate) fn forget(&mut self) {
        self.broken = None;
        self.known.clear();
    }

    /// Whether continuity broke less than a while ago, so that objects may still be missing.
    pub(crate) fn is_settling(&self, now: Instant) -> bool {
        self.broken_at.is_some_and(|at| now.since(at) < NEARBY)
    }

    /// Deep copies of what the perspectives believe now.
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

    /// Remembers the present every now and then; what the robot believes then.
    pub(crate) fn remember(&mut self, now: Instant, language: &Language, of: &[u16]) -> Option<&Snapshot> {
        if now.since(self.known_at) < REMEMBER {
            return None;
        }
        self.snapshots(now, language, of);
        self.known.get(&0)
    }

    /// What the robot believes now.
    pub(crate) fn own(&self, language: &Language) -> Option<Snapshot> {
        self.frames.get(&0).map(|frame| frame.snapshot(language, self.known.get(&0)))
    }

    /// Of when the robot's own beliefs are, if there are any.
    pub(crate) fn own_at(&self) -> Option<Instant> {
        self.frames.get(&0).map(|frame| Instant::from_nanos(frame.head.header.valid_at_ns))
    }

    /// The robot's own beliefs as they came.
    pub(crate) fn own_beliefs(&self) -> &[Belief] {
        self.frames.get(&0).map_or(&[], |frame| &frame.beliefs)
    }
}

impl Frame {
    fn snapshot(&self, language: &Language, previous: Option<&Snapshot>) -> Snapshot {
        Snapshot::of(language, &self.head, &self.beliefs, &self.identities, previous)
    }
}

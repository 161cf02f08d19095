//! Publisher authorisation: a subscriber accepts frames only from the processes on the supervisor's roster.

use std::cell::Cell;
use std::fmt;
use std::rc::Rc;

use iceoryx2::unique_id_generator::unique_system_id::UniqueSystemId;
use message::{Process, Roster};

use crate::RosterReader;

/// Maximum number of external sources that a subscriber logs.
const MAX_LOGGED: usize = 8;

/// Frames that the subscribers of one node refused because their publisher is not on the roster.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefusedFrames {
    /// Number of frames.
    pub frames: u64,
    /// Process id of the last of their publishers; zero if there was none.
    pub pid: u32,
}

/// The supervisor's roster, and the count of refused frames.
pub(crate) struct RosterFilter {
    roster: RosterReader,
    unlisted: Cell<RefusedFrames>,
}

impl RosterFilter {
    pub(crate) fn new(roster: RosterReader) -> Rc<Self> {
        Rc::new(Self { roster, unlisted: Cell::default() })
    }

    pub(crate) fn roster(&self) -> Roster {
        self.roster.read()
    }

    pub(crate) fn unlisted(&self) -> RefusedFrames {
        self.unlisted.get()
    }
}

impl fmt::Debug for RosterFilter {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "RosterFilter({:?})", self.unlisted.get())
    }
}

/// The authorised publishers of one topic, for one subscriber.
pub(crate) struct PublisherFilter {
    /// The supervisor's roster; without one, every process may publish.
    listed: Option<Rc<RosterFilter>>,
    /// The process that owns the topic. A source has no owner, so every process may publish there.
    owner: Option<Process>,
    /// Identifier of the last accepted publisher; it differs for every incarnation.
    accepted: u128,
    /// Process ids of the external sources that were logged.
    logged: [u32; MAX_LOGGED],
    logged_count: usize,
}

impl PublisherFilter {
    pub(crate) fn new(listed: Option<Rc<RosterFilter>>, owner: Option<Process>) -> Self {
        Self { listed, owner, accepted: 0, logged: [0; MAX_LOGGED], logged_count: 0 }
    }

    /// Whether frames of a publisher are accepted. No system call, no lock, no allocation, except when an external source
    /// appears; one comparison while the publisher stays the same.
    #[inline]
    pub(crate) fn accept(&mut self, publisher: u128, topic: &str) -> bool {
        publisher == self.accepted || self.check_roster(publisher, topic)
    }

    /// Counts a frame of a publisher that may not publish. The process's health reports it to the supervisor, which
    /// logs it: this thread may be in a real-time loop, and formats no line for a foreign process.
    #[cold]
    fn check_roster(&mut self, publisher: u128, topic: &str) -> bool {
        let Some(listed) = &self.listed else {
            self.accepted = publisher;
            return true;
        };
        let (pid, made_at_ns) = identity(publisher);
        let may_publish = self.owner.is_none_or(|owner| listed.roster().may_publish(owner, pid, made_at_ns));
        if may_publish {
            self.accepted = publisher;
            if self.owner.is_none() && self.is_new(pid) {
                tracing::info!("process {pid} publishes on `{topic}`");
            }
            return true;
        }
        let frames = listed.unlisted.get().frames.saturating_add(1);
        listed.unlisted.set(RefusedFrames { frames, pid });
        false
    }

    /// Whether a process has not been logged yet.
    fn is_new(&mut self, pid: u32) -> bool {
        if self.logged.iter().take(self.logged_count).any(|logged| *logged == pid) {
            return false;
        }
        let Some(slot) = self.logged.get_mut(self.logged_count) else { return false };
        *slot = pid;
        self.logged_count += 1;
        true
    }
}

/// Process id and creation time of a port, from its identifier; the time in nanoseconds of the monotonic clock.
pub(crate) fn identity(port: u128) -> (u32, u64) {
    let id = UniqueSystemId::from(port);
    let made = id.creation_time();
    let made_at_ns =
        made.seconds().saturating_mul(1_000_000_000).saturating_add(u64::from(made.nanoseconds()));
    (u32::try_from(id.pid().value()).unwrap_or(0), made_at_ns)
}

use std::collections::BTreeMap;
use std::path::Path;

use message::{Belief, BeliefHead, Beliefs, Process, Symbols};
use transport::{
    CurrentBoard, Domain, DomainError, Frame, FrameSubscriber, JoinError, Node, OverflowPolicy, PortError,
    Queues, ReceiveError,
};

/// Without effect: a reader creates no topic, so those of the robot keep their own queues.
const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };

/// Reads the beliefs of one robot, and the names of what they refer to. For one thread.
///
/// The fields are dropped in this order: ports before their node.
pub struct Reader {
    frame: Option<Frame<Beliefs>>,
    subscribers: BTreeMap<u32, FrameSubscriber<Beliefs>>,
    symbols: CurrentBoard<Symbols>,
    node: Node,
}

/// Reasons why a robot cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReaderError {
    /// No domain is named.
    #[error("no domain is named: give the directory of a robot, /dev/shm/leo-NAME")]
    NoDomain,
    /// The directory is no domain.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// The domain cannot be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A topic cannot be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// A frame cannot be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
}

impl Reader {
    /// Joins the domain of a robot.
    ///
    /// # Errors
    ///
    /// The directory is no domain of this user, the robot is of another version, or this process joined another
    /// domain before.
    pub fn open(root: &Path) -> Result<Self, ReaderError> {
        let mut node = Node::join(&Domain::at(root)?, "reader", 0, QUEUES)?;
        // Processes that were started by hand have no supervisor, and no roster.
        let _is_supervised = node.follow_roster().is_ok();
        Ok(Self { frame: None, subscribers: BTreeMap::new(), symbols: CurrentBoard::default(), node })
    }

    /// Takes the newest frame of a perspective; its head and its number of beliefs. `None` if there is no new one, or
    /// if no process publishes the perspective.
    ///
    /// # Errors
    ///
    /// The topic has too many subscribers, or the middleware failed.
    pub fn next(&mut self, perspective: u32) -> Result<Option<(BeliefHead, usize)>, ReaderError> {
        // A subscriber may hold few frames at a time.
        self.frame = None;
        if !self.subscribers.contains_key(&perspective)
            && let Some(subscriber) = self.node.existing_subscriber::<Beliefs>(Some(perspective))?
        {
            self.subscribers.insert(perspective, subscriber);
        }
        if let Some(subscriber) = self.subscribers.get_mut(&perspective) {
            self.frame = subscriber.newest()?;
        }
        Ok(self.frame.as_ref().map(|frame| (*frame.head(), frame.entries().len())))
    }

    /// A belief of the newest frame taken, by its index.
    #[must_use]
    pub fn belief(&self, index: usize) -> Option<&Belief> {
        self.frame.as_ref()?.entries().get(index)
    }

    /// The names for beliefs of an incarnation of the belief process; `None` if it has no board of names, or has
    /// ended.
    pub fn symbols(&mut self, incarnation: u64) -> Option<Symbols> {
        self.symbols.read(&self.node, Process::Belief, incarnation)
    }
}

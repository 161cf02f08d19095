use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node as RawNode, NodeBuilder};
use iceoryx2::prelude::{
    FileName, FilePath, LogLevel, NodeName, SemanticString as _, SignalHandlingMode, set_log_level,
};
use iceoryx2::service::ipc::Service;
use message::{Process, Topic};

use crate::writers::{PublisherFilter, RosterFilter, identity};
use crate::{
    Domain, FramePublisher, FrameSubscriber, JoinError, PortError, Queues, RefusedFrames, RosterReader,
    TopicPorts,
};

/// A process's node in a domain, from which its ports are created.
#[derive(Debug)]
pub struct Node {
    node: RawNode<Service>,
    pub(crate) queues: Queues,
    pub(crate) incarnation: u64,
    /// The supervisor's roster, if it decides who may publish.
    listed: Option<Rc<RosterFilter>>,
}

impl Node {
    /// Joins a domain under a name, with the incarnation of the process.
    ///
    /// # Errors
    ///
    /// The robot uses other message layouts, the domain's configuration is damaged, this process already joined
    /// another domain, or shared memory is not available.
    pub fn join(domain: &Domain, name: &str, incarnation: u64, queues: Queues) -> Result<Self, JoinError> {
        domain.check_layouts()?;
        Self::join_any(domain, name, incarnation, queues)
    }

    /// Like [`Self::join`], but accepts robots with other message layouts, for diagnostics. Boards and topics
    /// with other messages cannot be opened.
    ///
    /// # Errors
    ///
    /// As [`Self::join`], except for the message layouts.
    pub fn join_any(
        domain: &Domain,
        name: &str,
        incarnation: u64,
        queues: Queues,
    ) -> Result<Self, JoinError> {
        let config = join_config(domain)?;
        let failed = |reason: String| JoinError::Node { root: domain.root().to_owned(), reason };
        let name = NodeName::new(name).map_err(|error| failed(format!("{error:?}")))?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(config)
            // The processes stop at their supervisor's request; see the crate `process`.
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|error| failed(format!("{error:?}")))?;
        Ok(Self { node, queues, incarnation, listed: None })
    }

    /// Restricts the subscribers that this node opens from now on to publishers on the supervisor's roster. Otherwise
    /// they accept frames from every process of this user.
    ///
    /// # Errors
    ///
    /// No supervisor runs in the domain.
    pub fn follow_roster(&mut self) -> Result<(), PortError> {
        self.listed = Some(RosterFilter::new(RosterReader::open(self, Process::Supervisor, 1)?));
        Ok(())
    }

    /// Whether the supervisor's roster lists this process as the newest incarnation of `process`; false without a
    /// roster.
    #[must_use]
    pub fn is_on_roster(&self, process: Process) -> bool {
        let (pid, made_at_ns) = identity(self.node.id().value());
        let roster = self.listed.as_ref().map(|listed| listed.roster.read());
        roster.is_some_and(|roster| roster.life(process).is_some_and(|life| life.made(pid, made_at_ns)))
    }

    /// Frames that the subscribers of this node refused because their publisher is not on the supervisor's roster.
    #[must_use]
    pub fn unlisted(&self) -> RefusedFrames {
        self.listed.as_ref().map(|listed| listed.unlisted.get()).unwrap_or_default()
    }

    /// The process id of this process as the middleware sees it, which the roster uses.
    #[must_use]
    pub fn pid(&self) -> u32 {
        identity(self.node.id().value()).0
    }

    pub(crate) fn writers(&self, owner: Option<Process>) -> PublisherFilter {
        PublisherFilter::new(self.listed.clone(), owner)
    }

    /// Opens the publisher of a topic for frames of up to `capacity` entries.
    ///
    /// `number` distinguishes topics of one kind: partner, source or process.
    ///
    /// # Errors
    ///
    /// The topic already has a publisher and no roster decides, or it has other message types, or shared memory is
    /// exhausted.
    pub fn publisher<T: TopicPorts>(
        &self,
        number: Option<u32>,
        capacity: usize,
    ) -> Result<FramePublisher<T>, PortError> {
        T::open_publisher(self, number, capacity)
    }

    /// Opens a subscriber to a topic.
    ///
    /// # Errors
    ///
    /// The topic has too many subscribers or other message types, or shared memory is exhausted.
    pub fn subscriber<T: TopicPorts>(&self, number: Option<u32>) -> Result<FrameSubscriber<T>, PortError> {
        T::open_subscriber(self, number, T::writer(number), false)
    }

    /// Like [`Self::subscriber`], for a topic whose writer the configuration defines, such as a source in the
    /// simulator.
    ///
    /// # Errors
    ///
    /// As [`Self::subscriber`].
    pub fn subscriber_from<T: TopicPorts>(
        &self,
        number: Option<u32>,
        owner: Option<Process>,
    ) -> Result<FrameSubscriber<T>, PortError> {
        T::open_subscriber(self, number, owner, false)
    }

    /// Opens a subscriber with notifications: its writer wakes it with every frame. Each such subscriber costs the
    /// writer one system call per frame.
    ///
    /// # Errors
    ///
    /// As [`Self::subscriber`].
    pub fn waking_subscriber<T: TopicPorts>(
        &self,
        number: Option<u32>,
    ) -> Result<FrameSubscriber<T>, PortError> {
        T::open_subscriber(self, number, T::writer(number), true)
    }

    /// Opens a subscriber for an observer of a running robot; `None` if the topic does not exist (yet). In wall time
    /// its queue is eight times as long as those of the robot's processes, because observers run at the lowest
    /// priority and want every frame. It costs the writer no system call, and its queue does not affect other
    /// subscribers.
    ///
    /// # Errors
    ///
    /// The topic has too many subscribers, or other message types.
    pub fn existing_subscriber<T: TopicPorts>(
        &self,
        number: Option<u32>,
    ) -> Result<Option<FrameSubscriber<T>>, PortError> {
        T::open_existing_subscriber(self, number)
    }

    /// Cleans up after dead processes of the domain. It scans directories and allocates. So do not call it in a
    /// real-time thread, and only while no process of the domain is starting.
    pub fn clean_up_dead(&self) {
        self.node.blocking_cleanup_dead_nodes(Duration::from_millis(200));
    }

    pub(crate) fn raw(&self) -> &RawNode<Service> {
        &self.node
    }

    /// Whether the publishers that subscribers accept are those on the supervisor's roster.
    pub(crate) fn is_supervised(&self) -> bool {
        self.listed.is_some()
    }
}

pub(crate) fn topic_name<T: Topic>(number: Option<u32>) -> String {
    number.map_or_else(|| T::NAME.to_owned(), |number| format!("{}/{number}", T::NAME))
}

/// The middleware keeps one global configuration per process, and cleans up dead nodes with it regardless of a node's
/// own configuration. So it must be the domain's.
fn join_config(domain: &Domain) -> Result<&'static Config, JoinError> {
    // The middleware's warnings go to standard error; all errors are returned by its functions.
    set_log_level(LogLevel::Error);
    let file = domain.middleware_file();
    let damaged = |reason: String| JoinError::Configuration { file: file.clone(), reason };
    let path = file.to_str().ok_or_else(|| damaged("its path is no UTF-8".to_owned()))?;
    let path = FilePath::new(path.as_bytes()).map_err(|error| damaged(format!("{error:?}")))?;
    let config =
        Config::setup_global_config_from_file(&path).map_err(|error| damaged(format!("{error:?}")))?;
    let prefix = FileName::new(domain.prefix().as_bytes()).map_err(|error| damaged(format!("{error:?}")))?;
    let root = config.global.root_path();
    let same_root = Path::new(&root.to_string()).components().eq(domain.root().components());
    if config.global.prefix == prefix && same_root {
        Ok(config)
    } else {
        Err(JoinError::AnotherDomain { root: domain.root().to_owned() })
    }
}

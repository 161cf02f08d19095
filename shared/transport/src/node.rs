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

use crate::writers::{Listed, Writers, identity};
use crate::{Domain, Inlet, JoinError, Outlet, PortError, Queues, RosterReader, Unlisted};

/// This process's place in a domain: what its ports are made from.
#[derive(Debug)]
pub struct Node {
    node: RawNode<Service>,
    queues: Queues,
    incarnation: u64,
    /// The supervisor's roster, where it decides who may publish.
    listed: Option<Rc<Listed>>,
}

impl Node {
    /// Joins a domain under a name, as a given life of the process that bears it.
    ///
    /// # Errors
    ///
    /// The domain's robot is run by a program with other messages, the domain's configuration is damaged, this
    /// process is in another domain already, or shared memory is not to be had.
    pub fn join(domain: &Domain, name: &str, incarnation: u64, queues: Queues) -> Result<Self, JoinError> {
        domain.agrees()?;
        Self::join_any(domain, name, incarnation, queues)
    }

    /// The same whatever program runs the robot: for who must look as far as can be seen. A board or topic whose
    /// messages are others than this program's cannot be opened.
    ///
    /// # Errors
    ///
    /// As [`join`](Self::join), but for the program.
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
            // The processes stop when their supervisor says so; see the crate `process`.
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|error| failed(format!("{error:?}")))?;
        Ok(Self { node, queues, incarnation, listed: None })
    }

    /// Lets the supervisor's roster decide from which processes the readers that this node opens from now on take
    /// frames. Without, they take them from every process of this user.
    ///
    /// # Errors
    ///
    /// No supervisor runs in the domain.
    pub fn follow_roster(&mut self) -> Result<(), PortError> {
        self.listed = Some(Listed::new(RosterReader::open(self, Process::Supervisor, 1)?));
        Ok(())
    }

    /// Whether the supervisor's roster names this process as the newest life of `process`; without a roster it does not.
    #[must_use]
    pub fn is_listed(&self, process: Process) -> bool {
        let (pid, made_at_ns) = identity(self.node.id().value());
        let roster = self.listed.as_ref().map(|listed| listed.roster());
        roster.is_some_and(|roster| roster.life(process).is_some_and(|life| life.made(pid, made_at_ns)))
    }

    /// What the readers of this node refused because the supervisor's roster does not name its writer.
    #[must_use]
    pub fn unlisted(&self) -> Unlisted {
        self.listed.as_ref().map(|listed| listed.unlisted()).unwrap_or_default()
    }

    /// The number of this process as the middleware knows it, by which the roster names it.
    #[must_use]
    pub fn pid(&self) -> u32 {
        identity(self.node.id().value()).0
    }

    fn writers(&self, owner: Option<Process>) -> Writers {
        Writers::new(self.listed.clone(), owner)
    }

    /// Opens the writing end of a topic for frames of up to `capacity` entries.
    ///
    /// `number` tells topics of one kind apart: partner, source or process.
    ///
    /// # Errors
    ///
    /// The topic has a writer already, as far as no roster tells the right one from it, other frames than asked for, or shared memory is full.
    pub fn outlet<T: Topic>(&self, number: Option<u32>, capacity: usize) -> Result<Outlet<T>, PortError> {
        let is_supervised = self.listed.is_some();
        Outlet::open(&self.node, number, capacity, self.queues, self.incarnation, is_supervised)
    }

    /// Opens a reading end of a topic.
    ///
    /// # Errors
    ///
    /// The topic has too many readers already, other frames than asked for, or shared memory is
    /// full.
    pub fn inlet<T: Topic>(&self, number: Option<u32>) -> Result<Inlet<T>, PortError> {
        Inlet::open(&self.node, number, self.queues, false, self.writers(T::writer(number)))
    }

    /// The same of a topic that the configuration gives to a process, such as that of a source to the simulator.
    ///
    /// # Errors
    ///
    /// As [`inlet`](Self::inlet).
    pub fn inlet_from<T: Topic>(
        &self,
        number: Option<u32>,
        owner: Option<Process>,
    ) -> Result<Inlet<T>, PortError> {
        Inlet::open(&self.node, number, self.queues, false, self.writers(owner))
    }

    /// Opens a reading end of a topic that can be waited on: its writer rings a bell with every
    /// frame. Every such end costs the writer one system call per frame.
    ///
    /// # Errors
    ///
    /// As [`inlet`](Self::inlet).
    pub fn waking_inlet<T: Topic>(&self, number: Option<u32>) -> Result<Inlet<T>, PortError> {
        Inlet::open(&self.node, number, self.queues, true, self.writers(T::writer(number)))
    }

    /// Opens a reading end of a topic of a robot that runs already, for somebody who looks on: in wall time with a
    /// queue eight times as long as those of its processes, because who looks on is scheduled last and wants every
    /// frame. `None` where nobody has made it (yet). It costs the writer no system call, and nothing that waits
    /// for this reader keeps anything from others.
    ///
    /// # Errors
    ///
    /// The topic has too many readers already, or other frames than asked for.
    pub fn made_inlet<T: Topic>(&self, number: Option<u32>) -> Result<Option<Inlet<T>>, PortError> {
        Inlet::open_made(&self.node, number, self.writers(T::writer(number)))
    }

    /// Cleans up after dead processes of the domain. Scans and allocates: never in a real-time
    /// thread, and only while no process of the domain is starting.
    pub fn clean_up_dead(&self) {
        self.node.blocking_cleanup_dead_nodes(Duration::from_millis(200));
    }

    pub(crate) fn raw(&self) -> &RawNode<Service> {
        &self.node
    }
}

pub(crate) fn topic_name<T: Topic>(number: Option<u32>) -> String {
    number.map_or_else(|| T::NAME.to_owned(), |number| format!("{}/{number}", T::NAME))
}

/// The middleware keeps one configuration per process, and cleans up dead nodes by that one
/// whatever a node was made with: it must be the domain's.
fn join_config(domain: &Domain) -> Result<&'static Config, JoinError> {
    // What the middleware warns of reaches us as an error of the call; it writes to standard error.
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

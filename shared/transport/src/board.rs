//! Boards: blackboards in shared memory, each written by one incarnation of a process.
//!
//! Reading a board involves neither the writer's thread nor its ports, so it costs the writer nothing. A board's name
//! contains the incarnation of its writer: the board of a killed process cannot be reused while a reader has it open.

use std::fmt;

use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use message::{Buses, Health, Joints, LinkHealth, Perspectives, Process, Roster, Sources, Symbols};

use crate::service::service_name;
use crate::{Node, PortError};

/// Key of the only entry of a board.
const KEY: u64 = 0;
/// Maximum number of readers: supervisor, live table, metrics, tests; for the roster also every process of the robot.
const MAX_READERS: usize = 32;

/// The content of a board.
pub trait Board: Copy + Default + fmt::Debug + ZeroCopySend + 'static {
    /// The first part of the names of its boards.
    const NAME: &'static str;

    /// As [`BoardWriter::create`]; compiled once, here (see [`TopicPorts`](crate::TopicPorts)).
    ///
    /// # Errors
    ///
    /// As [`BoardWriter::create`].
    fn create(node: &Node, process: Process, incarnation: u64) -> Result<BoardWriter<Self>, PortError>;

    /// As [`BoardReader::open`].
    ///
    /// # Errors
    ///
    /// As [`BoardReader::open`].
    fn open(node: &Node, process: Process, incarnation: u64) -> Result<BoardReader<Self>, PortError>;
}

/// Writes a board of one incarnation of a process.
pub struct BoardWriter<T: Board> {
    entry: EntryHandleMut<Service, u64, T>,
    _writer: Writer<Service, u64>,
    _board: PortFactory<Service, u64>,
}

impl<T: Board> BoardWriter<T> {
    /// Creates the board of one incarnation of a process.
    ///
    /// # Errors
    ///
    /// The board exists already, or shared memory is exhausted.
    pub fn create(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
        T::create(node, process, incarnation)
    }

    fn create_blackboard(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
        let name = board_name(T::NAME, process, incarnation);
        let failed = |reason: &dyn fmt::Debug| PortError::new(&name, "writing", reason);
        let board = node
            .raw()
            .service_builder(&service_name(&name, "writing")?)
            .blackboard_creator::<u64>()
            .max_readers(MAX_READERS)
            .max_nodes(MAX_READERS)
            .add_with_default::<T>(KEY)
            .create()
            .map_err(|error| failed(&error))?;
        let writer = board.writer_builder().create().map_err(|error| failed(&error))?;
        let entry = writer.entry::<T>(&KEY).map_err(|error| failed(&error))?;
        Ok(Self { entry, _writer: writer, _board: board })
    }

    /// Publishes a value. No system call, no lock, no allocation.
    pub fn write(&mut self, value: &T) {
        self.entry.update_with_copy(*value);
    }
}

impl<T: Board> fmt::Debug for BoardWriter<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "BoardWriter({})", T::NAME)
    }
}

/// Reads a board of one incarnation of a process.
pub struct BoardReader<T: Board> {
    entry: EntryHandle<Service, u64, T>,
    _reader: Reader<Service, u64>,
    _board: PortFactory<Service, u64>,
}

impl<T: Board> BoardReader<T> {
    /// Opens the board of one incarnation of a process.
    ///
    /// # Errors
    ///
    /// The board does not exist (yet), or has too many readers.
    pub fn open(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
        T::open(node, process, incarnation)
    }

    fn open_blackboard(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
        let name = board_name(T::NAME, process, incarnation);
        let failed = |reason: &dyn fmt::Debug| PortError::new(&name, "reading", reason);
        let board = node
            .raw()
            .service_builder(&service_name(&name, "reading")?)
            .blackboard_opener::<u64>()
            .open()
            .map_err(|error| failed(&error))?;
        let reader = board.reader_builder().create().map_err(|error| failed(&error))?;
        let entry = reader.entry::<T>(&KEY).map_err(|error| failed(&error))?;
        Ok(Self { entry, _reader: reader, _board: board })
    }

    /// The last published value.
    #[must_use]
    pub fn read(&self) -> T {
        *self.entry.get()
    }
}

impl<T: Board> fmt::Debug for BoardReader<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "BoardReader({})", T::NAME)
    }
}

/// Reads the board of a process's current incarnation, and opens it again after a restart of the process.
#[derive(Debug)]
pub struct CurrentBoard<T: Board>(Option<(u64, BoardReader<T>)>);

impl<T: Board> Default for CurrentBoard<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T: Board> CurrentBoard<T> {
    /// The last value that an incarnation published; `None` while its board cannot be opened.
    pub fn read(&mut self, node: &Node, process: Process, incarnation: u64) -> Option<T> {
        if self.0.as_ref().is_none_or(|(known, _)| *known != incarnation) {
            self.0 = BoardReader::open(node, process, incarnation).ok().map(|board| (incarnation, board));
        }
        self.0.as_ref().map(|(_, board)| board.read())
    }
}

macro_rules! boards {
    ($($value:ident as $name:literal)+) => {
        $(impl Board for $value {
            const NAME: &'static str = $name;

            fn create(node: &Node, process: Process, incarnation: u64) -> Result<BoardWriter<Self>, PortError> {
                BoardWriter::create_blackboard(node, process, incarnation)
            }

            fn open(node: &Node, process: Process, incarnation: u64) -> Result<BoardReader<Self>, PortError> {
                BoardReader::open_blackboard(node, process, incarnation)
            }
        })+
    };
}

boards! {
    Health as "health"
    Roster as "roster"
    Sources as "sources"
    Buses as "buses"
    Joints as "joints"
    Perspectives as "perspectives"
    LinkHealth as "link"
    Symbols as "symbols"
}

/// Writes the health of one incarnation of a process.
pub type HealthWriter = BoardWriter<Health>;
/// Reads the health of one incarnation of a process.
pub type HealthReader = BoardReader<Health>;
/// Writes the roster: the newest incarnation of each process, and which process may publish. Writer: supervisor.
pub type RosterWriter = BoardWriter<Roster>;
/// Reads the roster.
pub type RosterReader = BoardReader<Roster>;

fn board_name(name: &str, process: Process, incarnation: u64) -> String {
    format!("{name}/{process}/{incarnation}")
}

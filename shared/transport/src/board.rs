//! Boards: blackboards in shared memory, each written by one incarnation of a process.
//!
//! Reading a board involves neither the writer's thread nor its ports, so it costs the writer nothing. A board's name
//! contains the incarnation of its writer: the board of a killed process cannot be reused while a reader has it open.

use std::fmt;

use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use message::{Board, Process};

use crate::service::service_name;
use crate::{Node, PortError};

/// Key of the only entry of a board.
const KEY: u64 = 0;
/// Maximum number of readers: supervisor, live table, metrics, tests; for the roster also every process of the robot.
const MAX_READERS: usize = 32;

/// Writes the board of one incarnation of a process.
pub struct BoardWriter<B: Board> {
    entry: EntryHandleMut<Service, u64, B>,
    _writer: Writer<Service, u64>,
    _board: PortFactory<Service, u64>,
}

impl<B: Board> BoardWriter<B> {
    /// Creates the board of one incarnation of a process.
    ///
    /// # Errors
    ///
    /// The board exists already, or shared memory is exhausted.
    pub fn create(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
        let name = board_name::<B>(process, incarnation);
        let failed = |reason: &dyn fmt::Debug| PortError::new(&name, "writing", reason);
        let board = node
            .raw()
            .service_builder(&service_name(&name, "writing")?)
            .blackboard_creator::<u64>()
            .max_readers(MAX_READERS)
            .max_nodes(MAX_READERS)
            .add_with_default::<B>(KEY)
            .create()
            .map_err(|error| failed(&error))?;
        let writer = board.writer_builder().create().map_err(|error| failed(&error))?;
        let entry = writer.entry::<B>(&KEY).map_err(|error| failed(&error))?;
        Ok(Self { entry, _writer: writer, _board: board })
    }

    /// Publishes a value. No system call, no lock, no allocation.
    pub fn write(&mut self, value: &B) {
        self.entry.update_with_copy(*value);
    }
}

impl<B: Board> fmt::Debug for BoardWriter<B> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "BoardWriter({})", B::ROW.name)
    }
}

/// Reads the board of one incarnation of a process.
pub struct BoardReader<B: Board> {
    entry: EntryHandle<Service, u64, B>,
    _reader: Reader<Service, u64>,
    _board: PortFactory<Service, u64>,
}

impl<B: Board> BoardReader<B> {
    /// Opens the board of one incarnation of a process.
    ///
    /// # Errors
    ///
    /// The board does not exist (yet), or has too many readers.
    pub fn open(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
        let name = board_name::<B>(process, incarnation);
        let failed = |reason: &dyn fmt::Debug| PortError::new(&name, "reading", reason);
        let board = node
            .raw()
            .service_builder(&service_name(&name, "reading")?)
            .blackboard_opener::<u64>()
            .open()
            .map_err(|error| failed(&error))?;
        let reader = board.reader_builder().create().map_err(|error| failed(&error))?;
        let entry = reader.entry::<B>(&KEY).map_err(|error| failed(&error))?;
        Ok(Self { entry, _reader: reader, _board: board })
    }

    /// The last published value.
    #[must_use]
    pub fn read(&self) -> B {
        *self.entry.get()
    }
}

impl<B: Board> fmt::Debug for BoardReader<B> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "BoardReader({})", B::ROW.name)
    }
}

fn board_name<B: Board>(process: Process, incarnation: u64) -> String {
    format!("{}/{process}/{incarnation}", B::ROW.name)
}

//! Boards: blackboards in shared memory, each written by one incarnation of a process.
//!
//! Reading a board involves neither the writer's thread nor its ports, so it costs the writer nothing. A board's name
//! contains the incarnation of its writer: the board of a killed process cannot be reused while a reader has it open.

use std::fmt;

use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use message::{Buses, Health, Joints, LinkHealth, Perspectives, Process, Roster, Sources};

use crate::service::service_name;
use crate::{Node, PortError};

/// Key of the only entry of a board.
const KEY: u64 = 0;
/// Maximum number of readers: supervisor, live table, metrics, tests; for the roster also every process of the robot.
const MAX_READERS: usize = 32;

macro_rules! board {
    ($(#[$writer_doc:meta])* $writer:ident, $(#[$reader_doc:meta])* $reader:ident: $value:ty as $name:literal) => {
        $(#[$writer_doc])*
        pub struct $writer {
            entry: EntryHandleMut<Service, u64, $value>,
            _writer: Writer<Service, u64>,
            _board: PortFactory<Service, u64>,
        }

        impl $writer {
            /// Creates the board of one incarnation of a process.
            ///
            /// # Errors
            ///
            /// The board exists already, or shared memory is exhausted.
            pub fn create(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
                let name = board_name($name, process, incarnation);
                let failed = |reason: &dyn fmt::Debug| PortError::new(&name, "writing", reason);
                let board = node
                    .raw()
                    .service_builder(&service_name(&name, "writing")?)
                    .blackboard_creator::<u64>()
                    .max_readers(MAX_READERS)
                    .max_nodes(MAX_READERS)
                    .add_with_default::<$value>(KEY)
                    .create()
                    .map_err(|error| failed(&error))?;
                let writer = board.writer_builder().create().map_err(|error| failed(&error))?;
                let entry = writer.entry::<$value>(&KEY).map_err(|error| failed(&error))?;
                Ok(Self { entry, _writer: writer, _board: board })
            }

            /// Publishes a value. No system call, no lock, no allocation.
            pub fn write(&mut self, value: &$value) {
                self.entry.update_with_copy(*value);
            }
        }

        impl fmt::Debug for $writer {
            fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str(stringify!($writer))
            }
        }

        $(#[$reader_doc])*
        pub struct $reader {
            entry: EntryHandle<Service, u64, $value>,
            _reader: Reader<Service, u64>,
            _board: PortFactory<Service, u64>,
        }

        impl $reader {
            /// Opens the board of one incarnation of a process.
            ///
            /// # Errors
            ///
            /// The board does not exist (yet), or has too many readers.
            pub fn open(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
                let name = board_name($name, process, incarnation);
                let failed = |reason: &dyn fmt::Debug| PortError::new(&name, "reading", reason);
                let board = node
                    .raw()
                    .service_builder(&service_name(&name, "reading")?)
                    .blackboard_opener::<u64>()
                    .open()
                    .map_err(|error| failed(&error))?;
                let reader = board.reader_builder().create().map_err(|error| failed(&error))?;
                let entry = reader.entry::<$value>(&KEY).map_err(|error| failed(&error))?;
                Ok(Self { entry, _reader: reader, _board: board })
            }

            /// The last published value.
            #[must_use]
            pub fn read(&self) -> $value {
                *self.entry.get()
            }
        }

        impl fmt::Debug for $reader {
            fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str(stringify!($reader))
            }
        }
    };
}

board!(
    /// Writes the health of one incarnation of a process.
    HealthWriter,
    /// Reads the health of one incarnation of a process.
    HealthReader: Health as "health"
);
board!(
    /// Writes the roster: the newest incarnation of each process, and which process may publish. Writer: supervisor.
    RosterWriter,
    /// Reads the roster: the newest incarnation of each process, and which process may publish.
    RosterReader: Roster as "roster"
);

board!(
    /// Writes the counters of the sources. Writer: sensor.
    SourcesWriter,
    /// Reads the counters of the sources.
    SourcesReader: Sources as "sources"
);

board!(
    /// Writes the health of the servo buses. Writer: motor.
    BusesWriter,
    /// Reads the health of the servo buses.
    BusesReader: Buses as "buses"
);

board!(
    /// Writes the joint states. Writer: motor.
    JointsWriter,
    /// Reads the joint states.
    JointsReader: Joints as "joints"
);

board!(
    /// Writes the counters of the perspectives. Writer: belief.
    PerspectivesWriter,
    /// Reads the counters of the perspectives.
    PerspectivesReader: Perspectives as "perspectives"
);

board!(
    /// Writes the health of the link to another machine. Writer: link.
    LinkWriter,
    /// Reads the health of the link to another machine.
    LinkReader: LinkHealth as "link"
);

fn board_name(name: &str, process: Process, incarnation: u64) -> String {
    format!("{name}/{process}/{incarnation}")
}

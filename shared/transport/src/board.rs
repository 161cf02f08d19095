//! Health on blackboards in shared memory: boards of one life of a process, written by it alone.
//!
//! Reading a board touches neither the writer's thread nor its ports: whoever looks costs the
//! loop that is looked at nothing. A board bears the number of the life that wrote it, because
//! the board of a killed process cannot be written again while anybody still reads it.

use std::fmt;

use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::blackboard::PortFactory;
use message::{Buses, Health, Joints, LinkHealth, Perspectives, Process, Roster, Sources};

use crate::service::service_name;
use crate::{Node, PortError};

/// The one entry of a board.
const KEY: u64 = 0;
/// Who looks: the supervisor, a live table, a scrape, a test; at the roster also every process of the robot.
const READERS: usize = 32;

macro_rules! board {
    ($(#[$writer_doc:meta])* $writer:ident, $(#[$reader_doc:meta])* $reader:ident: $value:ty as $name:literal) => {
        $(#[$writer_doc])*
        pub struct $writer {
            entry: EntryHandleMut<Service, u64, $value>,
            _writer: Writer<Service, u64>,
            _board: PortFactory<Service, u64>,
        }

        impl $writer {
            /// Makes the board of one life of a process.
            ///
            /// # Errors
            ///
            /// The board exists already, or shared memory is full.
            pub fn create(node: &Node, process: Process, incarnation: u64) -> Result<Self, PortError> {
                let name = board_name($name, process, incarnation);
                let failed = |reason: &dyn fmt::Debug| PortError::new(&name, "writing", reason);
                let board = node
                    .raw()
                    .service_builder(&service_name(&name, "writing")?)
                    .blackboard_creator::<u64>()
                    .max_readers(READERS)
                    .max_nodes(READERS)
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
            /// Opens the board of one life of a process.
            ///
            /// # Errors
            ///
            /// There is no such board (yet), or it has too many readers.
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

            /// The value published last.
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
    /// Writes the health of one life of a process.
    HealthWriter,
    /// Reads the health of one life of a process.
    HealthReader: Health as "health"
);
board!(
    /// Writes which life of each process is the newest, and which process may publish: the supervisor.
    RosterWriter,
    /// Reads which life of each process is the newest, and which process may publish.
    RosterReader: Roster as "roster"
);

board!(
    /// Writes what became of what each source reported: the sensor process.
    SourcesWriter,
    /// Reads what became of what each source reported.
    SourcesReader: Sources as "sources"
);

board!(
    /// Writes how the servo buses fare: the motor process.
    BusesWriter,
    /// Reads how the servo buses fare.
    BusesReader: Buses as "buses"
);

board!(
    /// Writes what the joints do: the motor process.
    JointsWriter,
    /// Reads what the joints do.
    JointsReader: Joints as "joints"
);

board!(
    /// Writes what was computed of each perspective: the belief process.
    PerspectivesWriter,
    /// Reads what was computed of each perspective.
    PerspectivesReader: Perspectives as "perspectives"
);

board!(
    /// Writes how the link to another machine fares: the link process.
    LinkWriter,
    /// Reads how the link to another machine fares.
    LinkReader: LinkHealth as "link"
);

fn board_name(name: &str, process: Process, incarnation: u64) -> String {
    format!("{name}/{process}/{incarnation}")
}

//! Reads the health boards of a robot's processes without affecting them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use message::{Buses, Health, Joints, LinkHealth, Perspectives, Process, ProcessState, Sources};
use reports::metrics::Readings;
use transport::{CurrentBoard, Node, PortError, RosterReader};

use crate::view::{Row, rows};

/// Facts about a robot that its health boards do not contain.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// The names of the joints by their index, from the configuration.
    pub joint_names: Vec<String>,
    /// The file of the learner's memory.
    pub store: Option<PathBuf>,
}

/// Reads the health boards of one domain. A missing board is looked for again at each read.
pub struct Boards {
    about: About,
    /// The health at the previous look.
    earlier: BTreeMap<Process, Health>,
    roster: RosterReader,
    health: BTreeMap<Process, CurrentBoard<Health>>,
    sources: CurrentBoard<Sources>,
    buses: CurrentBoard<Buses>,
    perspectives: CurrentBoard<Perspectives>,
    joints: CurrentBoard<Joints>,
    link: CurrentBoard<LinkHealth>,
}

impl Boards {
    /// Opens the supervisor's board.
    ///
    /// # Errors
    ///
    /// The board does not exist: the robot is starting, stopping or dead.
    pub fn open(node: &Node, about: About) -> Result<Self, PortError> {
        Ok(Self {
            about,
            earlier: BTreeMap::new(),
            roster: RosterReader::open(node, Process::Supervisor, 1)?,
            health: BTreeMap::new(),
            sources: CurrentBoard::default(),
            buses: CurrentBoard::default(),
            perspectives: CurrentBoard::default(),
            joints: CurrentBoard::default(),
            link: CurrentBoard::default(),
        })
    }

    /// The current readings, and a row per process over the time since the previous call. The first call covers the
    /// whole life of each process.
    pub fn look(&mut self, node: &Node) -> (Readings, Vec<Row>) {
        let readings = self.read(node);
        let rows = rows(&readings, &self.earlier);
        self.earlier.clone_from(&readings.processes);
        (readings, rows)
    }

    /// Reads all boards. Tasks are on no board and stay empty.
    pub fn read(&mut self, node: &Node) -> Readings {
        let roster = self.roster.read();
        let About { joint_names, store } = &self.about;
        let store = store.as_deref().and_then(|file| std::fs::metadata(file).ok());
        let mut readings = Readings {
            read_at_ns: clock::now().as_nanos(),
            joint_names: joint_names.clone(),
            store_bytes: store.map(|store| store.len()),
            ..Readings::default()
        };
        for &process in Process::ALL {
            let Some(incarnation) = roster.incarnation(process) else { continue };
            readings.processes.insert(process, self.health(node, process, incarnation));
        }
        let incarnation = |process| readings.processes.get(&process).map(|health| health.incarnation);
        let [sensor, belief, motor, link] =
            [Process::Sensor, Process::Belief, Process::Motor, Process::Link].map(incarnation);
        if let Some(board) =
            sensor.and_then(|incarnation| self.sources.read(node, Process::Sensor, incarnation))
        {
            readings.sources = board.all().to_vec();
        }
        if let Some(board) =
            belief.and_then(|incarnation| self.perspectives.read(node, Process::Belief, incarnation))
        {
            readings.perspectives = board.all().to_vec();
        }
        if let Some(incarnation) = motor {
            let buses = self.buses.read(node, Process::Motor, incarnation);
            readings.buses = buses.map(|board| board.all().to_vec()).unwrap_or_default();
            if let Some(board) = self.joints.read(node, Process::Motor, incarnation) {
                readings.joints = board.all().to_vec();
                readings.joint_locks = board.locks;
                (readings.goals_limited, readings.goals_refused) = (board.limited, board.refused);
            }
        }
        readings.link = link.and_then(|incarnation| self.link.read(node, Process::Link, incarnation));
        readings
    }

    /// The health of an incarnation. A process that has published no board is reported as down, like a dead one.
    /// A process that cannot restart therefore stays in the list.
    fn health(&mut self, node: &Node, process: Process, incarnation: u64) -> Health {
        let mut health =
            self.health.entry(process).or_default().read(node, process, incarnation).unwrap_or_default();
        health.incarnation = incarnation;
        if is_gone(health.pid) {
            health.set_state(ProcessState::Absent);
        }
        health
    }
}

/// Whether no process has this number. Always `false` where `/proc` is not mounted.
fn is_gone(pid: u32) -> bool {
    let processes = Path::new("/proc");
    let folder: PathBuf = processes.join(pid.to_string());
    processes.join("self").exists() && !folder.exists()
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use transport::janitor::{Janitor, claim};
    use transport::{Domain, HealthWriter, OverflowPolicy, Queues, RosterWriter};

    use super::*;

    #[test]
    fn a_dead_process_and_one_without_a_board_are_reported_as_down() {
        let domain = Domain::named(&format!("boards-{}", std::process::id())).unwrap();
        let claim = claim(&domain).unwrap();
        domain.make().unwrap();
        let node = Node::join(
            &domain,
            "boards",
            1,
            Queues { frames: 1, overflow_policy: OverflowPolicy::DropOldest },
        )
        .unwrap();
        let mut roster = message::Roster::default();
        let incarnations = [(Process::Motor, 1), (Process::Sensor, 2), (Process::Belief, 3)];
        incarnations
            .into_iter()
            .for_each(|(process, incarnation)| roster.set_incarnation(process, incarnation));
        let mut board = RosterWriter::create(&node, Process::Supervisor, 1).unwrap();
        board.write(&roster);
        let mut ended = Command::new("true").spawn().unwrap();
        let dead = ended.id();
        ended.wait().unwrap();
        // The third incarnation of the belief process has no board.
        let written = [(Process::Motor, 1, std::process::id()), (Process::Sensor, 2, dead)];
        let _boards = written.map(|(process, incarnation, pid)| {
            let mut health = Health::default();
            health.pid = pid;
            health.set_state(ProcessState::Running);
            let mut board = HealthWriter::create(&node, process, incarnation).unwrap();
            board.write(&health);
            board
        });
        let readings = Boards::open(&node, About::default()).unwrap().read(&node);
        Janitor::new(&domain).wipe(claim);
        let told: Vec<_> = readings
            .processes
            .iter()
            .map(|(&process, health)| {
                (process, health.incarnation, health.state() == Some(ProcessState::Running))
            })
            .collect();
        assert_eq!(
            told,
            [(Process::Sensor, 2, false), (Process::Belief, 3, false), (Process::Motor, 1, true)]
        );
        let said = reports::metrics::openmetrics(&readings);
        for line in [
            r#"leo_process_running{process="belief"} 0"#,
            r#"leo_process_running{process="sensor"} 0"#,
            r#"leo_process_running{process="motor"} 1"#,
            r#"leo_process_restarts_total{process="belief"} 2"#,
        ] {
            assert!(
                said.contains(line),
                "{line} is not in
{said}"
            );
        }
    }
}

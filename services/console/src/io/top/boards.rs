//! Reads the health boards of a robot's processes without affecting them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use message::{Health, Process, ProcessState};
use metrics::Readings;
use transport::{
    BusesReader, HealthReader, JointsReader, LinkReader, Node, PerspectivesReader, PortError, RosterReader,
    SourcesReader,
};

/// Reads the health boards of one domain. A missing board is looked for again at each read.
pub struct Boards {
    roster: RosterReader,
    health: BTreeMap<Process, Option<(u64, HealthReader)>>,
    sources: Option<(u64, SourcesReader)>,
    buses: Option<(u64, BusesReader)>,
    perspectives: Option<(u64, PerspectivesReader)>,
    joints: Option<(u64, JointsReader)>,
    link: Option<(u64, LinkReader)>,
}

impl Boards {
    /// Opens the supervisor's board.
    ///
    /// # Errors
    ///
    /// The board does not exist: the robot is starting, stopping or dead.
    pub fn open(node: &Node) -> Result<Self, PortError> {
        Ok(Self {
            roster: RosterReader::open(node, Process::Supervisor, 1)?,
            health: BTreeMap::new(),
            sources: None,
            buses: None,
            perspectives: None,
            joints: None,
            link: None,
        })
    }

    /// Reads all boards. Tasks, the memory file and joint names are on no board and stay empty.
    pub fn read(&mut self, node: &Node) -> Readings {
        let roster = self.roster.read();
        let mut readings = Readings { read_at_ns: clock::now().as_nanos(), ..Readings::default() };
        for &process in Process::ALL {
            let Some(life) = roster.incarnation(process) else { continue };
            readings.processes.insert(process, self.health(node, process, life));
        }
        let life = |process| readings.processes.get(&process).map(|health| health.incarnation);
        if let Some(life) = life(Process::Sensor) {
            let sources =
                current(&mut self.sources, life, || SourcesReader::open(node, Process::Sensor, life));
            readings.sources = sources.map(|board| board.read().all().to_vec()).unwrap_or_default();
        }
        if let Some(life) = life(Process::Belief) {
            let open = || PerspectivesReader::open(node, Process::Belief, life);
            let perspectives = current(&mut self.perspectives, life, open);
            readings.perspectives = perspectives.map(|board| board.read().all().to_vec()).unwrap_or_default();
        }
        if let Some(life) = life(Process::Motor) {
            let buses = current(&mut self.buses, life, || BusesReader::open(node, Process::Motor, life));
            readings.buses = buses.map(|board| board.read().all().to_vec()).unwrap_or_default();
            let joints = current(&mut self.joints, life, || JointsReader::open(node, Process::Motor, life));
            if let Some(board) = joints.map(JointsReader::read) {
                readings.joints = board.all().to_vec();
                readings.joint_locks = board.locks;
                (readings.goals_limited, readings.goals_refused) = (board.limited, board.refused);
            }
        }
        if let Some(life) = life(Process::Link) {
            let link = current(&mut self.link, life, || LinkReader::open(node, Process::Link, life));
            readings.link = link.map(LinkReader::read);
        }
        readings
    }

    /// The health of an incarnation. A process that has published no board is reported as down, like a dead one.
    /// A process that cannot restart therefore stays in the list.
    fn health(&mut self, node: &Node, process: Process, life: u64) -> Health {
        let mut health = Health::default();
        if let Some(reader) =
            current(self.health.entry(process).or_default(), life, || HealthReader::open(node, process, life))
        {
            health = reader.read();
        }
        health.incarnation = life;
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

/// The board of an incarnation. Reopens it if the cached one belongs to another incarnation.
fn current<B>(
    kept: &mut Option<(u64, B)>,
    life: u64,
    open: impl FnOnce() -> Result<B, PortError>,
) -> Option<&B> {
    if kept.as_ref().is_none_or(|(known, _)| *known != life) {
        *kept = open().ok().map(|board| (life, board));
    }
    kept.as_ref().map(|(_, board)| board)
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
        let lives = [(Process::Motor, 1), (Process::Sensor, 2), (Process::Belief, 3)];
        lives.into_iter().for_each(|(process, life)| roster.set_incarnation(process, life));
        let mut board = RosterWriter::create(&node, Process::Supervisor, 1).unwrap();
        board.write(&roster);
        let mut ended = Command::new("true").spawn().unwrap();
        let dead = ended.id();
        ended.wait().unwrap();
        // The third incarnation of the belief process has no board.
        let written = [(Process::Motor, 1, std::process::id()), (Process::Sensor, 2, dead)];
        let _boards = written.map(|(process, life, pid)| {
            let mut health = Health::default();
            health.pid = pid;
            health.set_state(ProcessState::Running);
            let mut board = HealthWriter::create(&node, process, life).unwrap();
            board.write(&health);
            board
        });
        let readings = Boards::open(&node).unwrap().read(&node);
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
        let said = metrics::openmetrics(&readings);
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

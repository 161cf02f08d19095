//! Reads the health boards of a robot's processes without affecting them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use message::{
    Board, Buses, Health, Joints, LinkHealth, Perspectives, Process, ProcessState, Roster, Sources,
};
use metrics::Readings;
use transport::{BoardReader, Node, PortError};

/// A board that was found, with the incarnation of its writer.
type Found<B> = Option<(u64, BoardReader<B>)>;

/// Reads the health boards of one domain. A missing board is looked for again at each read.
pub struct Boards {
    roster: BoardReader<Roster>,
    health: BTreeMap<Process, Found<Health>>,
    sources: Found<Sources>,
    buses: Found<Buses>,
    perspectives: Found<Perspectives>,
    joints: Found<Joints>,
    link: Found<LinkHealth>,
}

impl Boards {
    /// Opens the supervisor's board.
    ///
    /// # Errors
    ///
    /// The board does not exist: the robot is starting, stopping or dead.
    pub fn open(node: &Node) -> Result<Self, PortError> {
        Ok(Self {
            roster: BoardReader::open(node, Process::Supervisor, 1)?,
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
        if let Some(sources) = newest(&mut self.sources, node, &roster) {
            readings.sources = sources.all().to_vec();
        }
        if let Some(perspectives) = newest(&mut self.perspectives, node, &roster) {
            readings.perspectives = perspectives.all().to_vec();
        }
        if let Some(buses) = newest(&mut self.buses, node, &roster) {
            readings.buses = buses.all().to_vec();
        }
        if let Some(joints) = newest(&mut self.joints, node, &roster) {
            readings.joints = joints.all().to_vec();
            readings.joint_locks = joints.locks;
            (readings.goals_limited, readings.goals_refused) = (joints.limited, joints.refused);
        }
        readings.link = newest(&mut self.link, node, &roster);
        readings
    }

    /// The health of an incarnation. A process that has published no board is reported as down, like a dead one.
    /// A process that cannot restart therefore stays in the list.
    fn health(&mut self, node: &Node, process: Process, life: u64) -> Health {
        let found = self.health.entry(process).or_default();
        let mut health = read(found, node, process, life).unwrap_or_default();
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

/// The value of a board of the newest incarnation of its writer.
fn newest<B: Board>(found: &mut Found<B>, node: &Node, roster: &Roster) -> Option<B> {
    let process = B::ROW.writer?;
    read(found, node, process, roster.incarnation(process)?)
}

/// The value of the board of an incarnation. Reopens it if the cached one belongs to another incarnation.
fn read<B: Board>(found: &mut Found<B>, node: &Node, process: Process, life: u64) -> Option<B> {
    if found.as_ref().is_none_or(|(known, _)| *known != life) {
        *found = BoardReader::open(node, process, life).ok().map(|board| (life, board));
    }
    found.as_ref().map(|(_, board)| board.read())
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use transport::janitor::{Janitor, claim};
    use transport::{BoardWriter, Domain, OverflowPolicy, Queues};

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
        let mut board = BoardWriter::<Roster>::create(&node, Process::Supervisor, 1).unwrap();
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
            let mut board = BoardWriter::<Health>::create(&node, process, life).unwrap();
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

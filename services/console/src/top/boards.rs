//! The boards of a robot's processes, read without touching who wrote them.

use std::collections::BTreeMap;

use message::{Health, Process};
use metrics::Readings;
use transport::{
    BusesReader, HealthReader, JointsReader, LinkReader, Node, PerspectivesReader, PortError, RosterReader,
    SourcesReader,
};

/// Reads the boards of one domain. What is not there yet, or not any more, is looked for anew each
/// time.
pub struct Boards {
    roster: RosterReader,
    health: BTreeMap<Process, (u64, HealthReader)>,
    sources: Option<(u64, SourcesReader)>,
    buses: Option<(u64, BusesReader)>,
    perspectives: Option<(u64, PerspectivesReader)>,
    joints: Option<(u64, JointsReader)>,
    link: Option<(u64, LinkReader)>,
}

impl Boards {
    /// Finds the supervisor's board.
    ///
    /// # Errors
    ///
    /// It is not there: the robot starts, stops, or is dead.
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

    /// What stands on the boards now. Tasks, the store and the names of joints are not on any board.
    pub fn read(&mut self, node: &Node) -> Readings {
        let roster = self.roster.read();
        let mut readings = Readings::default();
        for &process in Process::ALL {
            let Some(life) = roster.incarnation(process) else { continue };
            let Some(health) = self.health(node, process, life) else { continue };
            readings.processes.insert(process, health);
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
            readings.joints = joints.map(|board| board.read().all().to_vec()).unwrap_or_default();
        }
        if let Some(life) = life(Process::Link) {
            let link = current(&mut self.link, life, || LinkReader::open(node, Process::Link, life));
            readings.link = link.map(LinkReader::read);
        }
        readings
    }

    fn health(&mut self, node: &Node, process: Process, life: u64) -> Option<Health> {
        if self.health.get(&process).is_none_or(|(known, _)| *known != life) {
            // A life that has not put up its board yet is looked for again next time.
            let reader = HealthReader::open(node, process, life).ok()?;
            self.health.insert(process, (life, reader));
        }
        self.health.get(&process).map(|(_, reader)| reader.read())
    }
}

/// The board of a life, opened anew where that kept is of another one.
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

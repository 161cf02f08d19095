//! The live table: what every process's loop counted, read from its board without touching it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use message::{
    BusHealth, Health, Histogram, Loss, PerspectiveHealth, Process, ProcessState, Roster, SourceHealth,
};
use serde::Serialize;
use transport::janitor::is_claimed;
use transport::{
    BusesReader, Delivery, Domain, HealthReader, JoinError, Node, PerspectivesReader, PortError, Queues,
    RosterReader, SourcesReader,
};

/// Why there is nothing to look at.
#[derive(Debug, thiserror::Error)]
pub enum TopError {
    /// No robot runs on this machine, as far as this user may see.
    #[error("no robot runs here: start one with `leo run`")]
    NoRobot,
    /// Several robots run; one must be named.
    #[error("{} robots run here: name one with --domain {}", .0.len(), .0.join(" or --domain "))]
    SeveralRobots(Vec<String>),
    /// The domain could not be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// The supervisor's board is not there.
    #[error("the robot in this domain is starting, stopping or dead: {0}")]
    NoRoster(PortError),
    /// The table could not be written.
    #[error("cannot write the table: {0}")]
    Write(#[from] std::io::Error),
}

/// Looks at the processes of one domain.
pub struct Top {
    node: Node,
    roster: RosterReader,
    readers: BTreeMap<Process, (u64, HealthReader)>,
    sources: Option<(u64, SourcesReader)>,
    buses: Option<(u64, BusesReader)>,
    perspectives: Option<(u64, PerspectivesReader)>,
    earlier: BTreeMap<Process, Health>,
}

/// One row: a process over the last interval.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The process.
    pub process: String,
    /// The operating system's number.
    pub pid: u32,
    /// Starting, running or stopping.
    pub state: &'static str,
    /// Lives begun after the first.
    pub restarts: u64,
    /// Configured rate; none for a process that is woken.
    pub rate_hz: Option<f64>,
    /// Cycles since this life began.
    pub cycles: u64,
    /// Cycles that ended after their deadline.
    pub overruns: u64,
    /// Releases skipped.
    pub skipped: u64,
    /// Frames lost at its inlets.
    pub drops: u64,
    /// Frames or entries refused as nonsense.
    pub refused: u64,
    /// Of the sensor process: its sensory sources.
    pub sources: Vec<SourceRow>,
    /// Of the motor process: its servo buses.
    pub buses: Vec<BusRow>,
    /// Of the belief process: the perspectives of which anything is computed.
    pub perspectives: Vec<PerspectiveRow>,
    /// Page faults since its loop began.
    pub page_faults: u64,
    /// Release to start.
    pub wakeup_us: Quantiles,
    /// Start to end.
    pub execution_us: Quantiles,
    /// Age of the input.
    pub age_us: Quantiles,
}

/// A sensory source, since the sensor process's life began.
#[derive(Clone, Debug, Serialize)]
pub struct SourceRow {
    /// What the configuration calls it.
    pub name: String,
    /// Whether frames are expected of it, and none come.
    pub silent: bool,
    /// Frames that were taken.
    pub frames: u64,
    /// Observations that entered the percept buffer.
    pub observations: u64,
    /// What was lost, by the name of the reason; without those that did not happen.
    pub losses: BTreeMap<&'static str, u64>,
}

/// A servo bus, since the motor process's life began.
#[derive(Clone, Debug, Serialize)]
pub struct BusRow {
    /// What the configuration calls it.
    pub name: String,
    /// Whether its line is lost now.
    pub lost: bool,
    /// Joints on it.
    pub joints: u64,
    /// Joints of it that are quarantined now.
    pub quarantined: u64,
    /// Requests carried out.
    pub exchanges: u64,
    /// Cycles in which it was still busy with the request before.
    pub skipped: u64,
    /// Answers that did not come.
    pub missed: u64,
    /// Answers that arrived broken.
    pub broken: u64,
    /// Answers dropped because they were not of this cycle.
    pub stale: u64,
    /// Bytes that came after their time.
    pub late_bytes: u64,
    /// How long the requests took.
    pub exchange_us: Quantiles,
}

/// A perspective, since the belief process's life began.
#[derive(Clone, Debug, Serialize)]
pub struct PerspectiveRow {
    /// Whose, and within whose: empty for the robot's own, `[1]` for partner 1's.
    pub path: Vec<u16>,
    /// How often its beliefs were brought to an instant.
    pub steps: u64,
    /// Beliefs that it held after each of these steps, all together.
    pub beliefs: u64,
}

/// A distribution in microseconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quantiles {
    /// How many.
    pub count: u64,
    /// Half are not above.
    pub p50: f64,
    /// 99 % are not above.
    pub p99: f64,
    /// 99.9 % are not above.
    pub p999: f64,
    /// None is above.
    pub max: f64,
}

impl Quantiles {
    /// The quantiles of a histogram.
    #[must_use]
    pub fn of(histogram: &Histogram) -> Self {
        let micros = |nanos: u64| Duration::from_nanos(nanos).as_secs_f64() * 1e6;
        Self {
            count: histogram.count(),
            p50: micros(histogram.quantile_ns(0.5)),
            p99: micros(histogram.quantile_ns(0.99)),
            p999: micros(histogram.quantile_ns(0.999)),
            max: micros(histogram.max_ns()),
        }
    }
}

impl Top {
    /// Opens the only domain on this machine, or the one named.
    ///
    /// # Errors
    ///
    /// No robot runs, or several do and none is named.
    pub fn open(domain: Option<Domain>) -> Result<Self, TopError> {
        let domain = match domain {
            Some(domain) => domain,
            None => only(Domain::all().into_iter().filter(is_claimed).collect())?,
        };
        let queues = Queues { frames: 1, delivery: Delivery::Newest };
        let node = Node::join(&domain, "top", 1, queues)?;
        let roster = RosterReader::open(&node, Process::Supervisor, 1).map_err(TopError::NoRoster)?;
        Ok(Self {
            node,
            roster,
            readers: BTreeMap::new(),
            sources: None,
            buses: None,
            perspectives: None,
            earlier: BTreeMap::new(),
        })
    }

    /// A row for every process, over the time since the last look; over its whole life at the
    /// first.
    pub fn rows(&mut self) -> Vec<Row> {
        let roster = self.roster.read();
        let mut rows = Vec::new();
        for &process in Process::ALL {
            if let Some(health) = self.health(process, &roster) {
                let earlier = self.earlier.insert(process, health);
                let mut row = row(process, &health, earlier.filter(|then| then.pid == health.pid));
                if process == Process::Sensor {
                    row.sources = self.sources(health.incarnation);
                }
                if process == Process::Motor {
                    row.buses = self.buses(health.incarnation);
                }
                if process == Process::Belief {
                    row.perspectives = self.perspectives(health.incarnation);
                }
                rows.push(row);
            }
        }
        rows
    }

    fn health(&mut self, process: Process, roster: &Roster) -> Option<Health> {
        let incarnation = roster.incarnation(process)?;
        if self.readers.get(&process).is_none_or(|(life, _)| *life != incarnation) {
            // A life that has not put up its board yet is looked for again next time.
            let reader = HealthReader::open(&self.node, process, incarnation).ok()?;
            self.readers.insert(process, (incarnation, reader));
        }
        self.readers.get(&process).map(|(_, reader)| reader.read())
    }
}

impl Top {
    fn sources(&mut self, incarnation: u64) -> Vec<SourceRow> {
        if self.sources.as_ref().is_none_or(|(life, _)| *life != incarnation) {
            let reader = SourcesReader::open(&self.node, Process::Sensor, incarnation);
            self.sources = reader.ok().map(|reader| (incarnation, reader));
        }
        let sources = self.sources.as_ref().map(|(_, reader)| reader.read());
        sources.iter().flat_map(message::Sources::all).map(source_row).collect()
    }

    fn perspectives(&mut self, incarnation: u64) -> Vec<PerspectiveRow> {
        if self.perspectives.as_ref().is_none_or(|(life, _)| *life != incarnation) {
            let reader = PerspectivesReader::open(&self.node, Process::Belief, incarnation);
            self.perspectives = reader.ok().map(|reader| (incarnation, reader));
        }
        let perspectives = self.perspectives.as_ref().map(|(_, reader)| reader.read());
        perspectives.iter().flat_map(message::Perspectives::all).map(perspective_row).collect()
    }
}

impl Top {
    fn buses(&mut self, incarnation: u64) -> Vec<BusRow> {
        if self.buses.as_ref().is_none_or(|(life, _)| *life != incarnation) {
            let reader = BusesReader::open(&self.node, Process::Motor, incarnation);
            self.buses = reader.ok().map(|reader| (incarnation, reader));
        }
        let buses = self.buses.as_ref().map(|(_, reader)| reader.read());
        buses.iter().flat_map(message::Buses::all).map(bus_row).collect()
    }
}

fn bus_row(bus: &BusHealth) -> BusRow {
    BusRow {
        name: bus.name.as_str().to_owned(),
        lost: bus.lost != 0,
        joints: bus.joints,
        quarantined: bus.quarantined,
        exchanges: bus.exchanges,
        skipped: bus.skipped,
        missed: bus.missed,
        broken: bus.broken,
        stale: bus.stale,
        late_bytes: bus.late_bytes,
        exchange_us: Quantiles::of(&bus.exchange),
    }
}

fn source_row(source: &SourceHealth) -> SourceRow {
    let losses = Loss::ALL.iter().map(|loss| (loss.name(), source.lost(*loss)));
    SourceRow {
        name: source.name.as_str().to_owned(),
        silent: source.silent != 0,
        frames: source.frames,
        observations: source.observations,
        losses: losses.filter(|(_, count)| *count > 0).collect(),
    }
}

fn perspective_row(perspective: &PerspectiveHealth) -> PerspectiveRow {
    PerspectiveRow {
        path: perspective.path.agents().unwrap_or_default().to_vec(),
        steps: perspective.steps,
        beliefs: perspective.beliefs,
    }
}

fn only(mut domains: Vec<Domain>) -> Result<Domain, TopError> {
    match (domains.pop(), domains.is_empty()) {
        (None, _) => Err(TopError::NoRobot),
        (Some(domain), true) => Ok(domain),
        (Some(last), false) => {
            domains.push(last);
            let names = domains.iter().map(|domain| domain.root().display().to_string()).collect();
            Err(TopError::SeveralRobots(names))
        }
    }
}

fn row(process: Process, health: &Health, earlier: Option<Health>) -> Row {
    let earlier = earlier.unwrap_or_default();
    let rate_hz = (health.period_ns > 0).then(|| 1.0 / Duration::from_nanos(health.period_ns).as_secs_f64());
    Row {
        process: process.to_string(),
        pid: health.pid,
        state: match health.state() {
            Some(ProcessState::Starting) => "starting",
            Some(ProcessState::Running) => "running",
            Some(ProcessState::Stopping) => "stopping",
            Some(ProcessState::Absent) | None => "unknown",
        },
        restarts: health.incarnation.saturating_sub(1),
        rate_hz,
        cycles: health.cycles,
        overruns: health.overruns,
        skipped: health.skipped,
        drops: health.drops,
        refused: health.refused,
        sources: Vec::new(),
        buses: Vec::new(),
        perspectives: Vec::new(),
        page_faults: health.page_faults,
        wakeup_us: Quantiles::of(&health.wakeup.since(&earlier.wakeup)),
        execution_us: Quantiles::of(&health.execution.since(&earlier.execution)),
        age_us: Quantiles::of(&health.latency.since(&earlier.latency)),
    }
}

/// The rows as a table of 100 columns, with a line for each sensory source, each perspective and each
/// servo bus below it.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut out = String::from(
        "                              rate            wake-up us      execution us         over  skip        re-\n\
         process        pid state        Hz   cycles    p50    p99    p50    p99     max  runs   ped drops start\n",
    );
    for row in rows {
        let rate = row.rate_hz.map_or_else(|| "woken".to_owned(), |rate| format!("{rate:.0}"));
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{:<10} {:>7} {:<9} {:>5} {:>8} {:>6.0} {:>6.0} {:>6.0} {:>6.0} {:>7.0} {:>5} {:>5} {:>5} {:>5}",
            row.process,
            row.pid,
            row.state,
            rate,
            row.cycles,
            row.wakeup_us.p50,
            row.wakeup_us.p99,
            row.execution_us.p50,
            row.execution_us.p99,
            row.execution_us.max,
            row.overruns,
            row.skipped,
            row.drops,
            row.restarts,
        );
    }
    for (number, source) in rows.iter().flat_map(|row| row.sources.iter().enumerate()) {
        let lost: Vec<String> =
            source.losses.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
        let _ = writeln!(
            out,
            "source {number} {:<14} {:>8} frames {:>9} observations{}{}{}",
            source.name,
            source.frames,
            source.observations,
            if source.silent { "   SILENT" } else { "" },
            if lost.is_empty() { "" } else { "   lost: " },
            lost.join(", "),
        );
    }
    for bus in rows.iter().flat_map(|row| &row.buses) {
        let _ = writeln!(
            out,
            "bus {:<12} {:>8} requests, us p50 {:.0} p99 {:.0}{}{}{}",
            bus.name,
            bus.exchanges,
            bus.exchange_us.p50,
            bus.exchange_us.p99,
            if bus.lost { "   LOST" } else { "" },
            if bus.quarantined > 0 {
                format!("   {} of {} joints quarantined", bus.quarantined, bus.joints)
            } else {
                String::new()
            },
            in_trouble(bus),
        );
    }
    for (number, perspective) in rows.iter().flat_map(|row| row.perspectives.iter().enumerate()) {
        let PerspectiveRow { path, steps, beliefs } = perspective;
        let path = format!("{path:?}");
        let _ = writeln!(out, "perspective {number} {path:<12} {steps:>8} steps {beliefs:>13} beliefs");
    }
    out
}

/// What went wrong on a bus, as far as anything did.
fn in_trouble(bus: &BusRow) -> String {
    let counts = [
        (bus.skipped, "skipped"),
        (bus.missed, "missed"),
        (bus.broken, "broken"),
        (bus.stale, "stale"),
        (bus.late_bytes, "late bytes"),
    ];
    let said: Vec<_> = counts
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    if said.is_empty() { String::new() } else { format!("   {}", said.join(", ")) }
}

/// Shows the table, anew every second until it cannot be written any more; once, as JSON, with
/// `json`. On a terminal each table is drawn over the last.
///
/// # Errors
///
/// As [`Top::open`].
pub fn show(
    domain: Option<Domain>,
    json: bool,
    is_terminal: bool,
    out: &mut impl std::io::Write,
) -> Result<(), TopError> {
    let mut top = Top::open(domain)?;
    if json {
        let rows = serde_json::to_string_pretty(&top.rows()).map_err(std::io::Error::from)?;
        return Ok(writeln!(out, "{rows}")?);
    }
    let mut next = clock::now();
    loop {
        let clear = if is_terminal { "\x1b[H\x1b[2J" } else { "" };
        writeln!(out, "{clear}{}", table(&top.rows()))?;
        out.flush()?;
        if !is_terminal {
            return Ok(());
        }
        next += Duration::from_secs(1);
        clock::sleep_until(next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_counts_what_came_since_the_last_look() {
        let mut then = Health::default();
        then.pid = 7;
        then.execution.record(1_000_000);
        let mut now = then;
        now.execution.record(2_000);
        let row = row(Process::Belief, &now, Some(then));
        assert_eq!(row.execution_us.count, 1);
        assert!(row.execution_us.p99 < 3.0);
    }

    #[test]
    fn each_source_has_a_line_below_the_table() {
        let mut camera = SourceHealth { frames: 12, observations: 34, silent: 1, ..SourceHealth::default() };
        camera.name = message::Text::new("camera");
        camera.losses[usize::from(Loss::Place.raw())] = 7;
        camera.losses[usize::from(Loss::Overtaken.raw())] = 2;
        let mut row = row(Process::Sensor, &Health::default(), None);
        row.sources = vec![source_row(&SourceHealth::default()), source_row(&camera)];
        assert_eq!((row.sources[1].losses.len(), row.sources[1].losses["place"]), (2, 7));
        let table = table(&[row]);
        let last = table.lines().last().unwrap();
        let said: Vec<&str> = last.split_whitespace().collect();
        let should = "source 1 camera 12 frames 34 observations SILENT lost: 2 overtaken, 7 place";
        assert_eq!(said.join(" "), should);
    }

    #[test]
    fn each_perspective_has_a_line_below_the_table() {
        let within = |path: message::Path, agent| path.within(agent).unwrap();
        let partner = within(message::Path::ROBOT, 1);
        let mut row = row(Process::Belief, &Health::default(), None);
        row.perspectives = [message::Path::ROBOT, partner, within(partner, 0)]
            .map(|path| perspective_row(&PerspectiveHealth { path, steps: 7, beliefs: 21 }))
            .to_vec();
        let table = table(&[row]);
        let lines: Vec<String> =
            table.lines().skip(3).map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        let should = ["perspective 0 [] 7 steps 21 beliefs", "perspective 1 [1] 7 steps 21 beliefs"];
        assert_eq!(lines[..2], should);
        assert_eq!(lines[2], "perspective 2 [1, 0] 7 steps 21 beliefs");
    }

    #[test]
    fn several_robots_must_be_told_apart() {
        let domains = ["a", "b"].map(|name| Domain::named(name).unwrap());
        let error = only(domains.to_vec()).unwrap_err().to_string();
        assert_eq!(
            error,
            "2 robots run here: name one with --domain /dev/shm/leo-a or --domain /dev/shm/leo-b"
        );
        assert!(matches!(only(Vec::new()), Err(TopError::NoRobot)));
    }
}

//! What was read of a robot, as rows: the document of `leo top --json`.

use std::collections::BTreeMap;
use std::time::Duration;

use message::{
    BusHealth, Health, JointState, Licences, LinkHealth, Loss, PerspectiveHealth, Process, ProcessState,
    SourceHealth,
};
use metrics::{Quantiles, Readings};
use serde::Serialize;

/// One row: a process over the last interval.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The process.
    pub process: String,
    /// The operating system's number.
    pub pid: u32,
    /// Starting, running or stopping; down where no process is, or none has said anything yet.
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
    /// Frames refused because the roster does not name their publisher.
    pub unlisted_frames: u64,
    /// The process number of the newest such publisher; zero where there was none.
    pub unlisted_pid: u64,
    /// Of the sensor process: its sensory sources.
    pub sources: Vec<SourceRow>,
    /// Of the motor process: its servo buses.
    pub buses: Vec<BusRow>,
    /// Of the motor process: its joints.
    pub joints: Option<JointsRow>,
    /// Of the belief process: the perspectives of which anything is computed.
    pub perspectives: Vec<PerspectiveRow>,
    /// Of the link process: the link to the other machine.
    pub link: Option<LinkRow>,
    /// Page faults since its loop began.
    pub page_faults: u64,
    /// Release to start.
    pub wakeup_us: Quantiles,
    /// Start to end.
    pub execution_us: Quantiles,
    /// Age of the input.
    pub age_us: Quantiles,
}

/// The joints, now.
#[derive(Clone, Debug, Serialize)]
pub struct JointsRow {
    /// How many may move.
    pub armed: usize,
    /// How many do not, until somebody arms them, by the cause.
    pub disarmed: BTreeMap<&'static str, usize>,
    /// How many do not, until a person has acknowledged the cause, by the cause.
    pub locked: BTreeMap<&'static str, usize>,
    /// How often a joint was locked since the motor process started.
    pub locks: u64,
    /// Goals beyond a joint's limits, which became the limit.
    pub goals_limited: u64,
    /// Goals refused: no number, or for no joint.
    pub goals_refused: u64,
    /// Those that a person should look at.
    pub trouble: Vec<JointRow>,
    /// Licences and causes in a line.
    #[serde(skip)]
    pub line: String,
}

/// A joint that a person should look at.
#[derive(Clone, Debug, Serialize)]
pub struct JointRow {
    /// Its name.
    pub joint: String,
    /// What the motor process does with it.
    pub mode: Option<&'static str>,
    /// Why.
    pub cause: Option<&'static str>,
    /// The connection to its servo.
    pub link: Option<&'static str>,
    /// The torque of its servo.
    pub power: Option<&'static str>,
    /// Whether it may move.
    pub licence: Option<&'static str>,
    /// Why it may not.
    pub licence_cause: Option<&'static str>,
    /// How it moves.
    pub motion: Option<&'static str>,
    /// How long ago its servo was read.
    pub reading_age_s: Option<f64>,
}

/// The link to the other machine, since the link process's life began.
#[derive(Clone, Debug, Serialize)]
pub struct LinkRow {
    /// Whether the other machine is heard now.
    pub heard: bool,
    /// To it and back, in microseconds, the newest.
    pub round_trip_us: f64,
    /// By how much instants from there are wrong at most, in microseconds.
    pub clock_error_us: f64,
    /// Frames that were handed to the network.
    pub sent: u64,
    /// Frames that were not, because a newer one came first.
    pub overtaken: u64,
    /// Frames that came.
    pub received: u64,
    /// Bundles of frames that did not come.
    pub lost: u64,
    /// Commands that came too late.
    pub late: u64,
    /// From there to here.
    pub delay_us: Quantiles,
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
    /// Hardware alerts of its servos.
    pub alerts: u64,
    /// Times that a servo of it began anew by itself.
    pub restarts: u64,
    /// Bus watchdogs of its servos that were found to have tripped.
    pub watchdogs: u64,
    /// Instructions that a servo refused by an error number.
    pub refusals: u64,
    /// Identifiers to which two servos were found to answer.
    pub duplicates: u64,
    /// Times that its line was lost.
    pub hang_ups: u64,
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

/// A row for every process, over the time since an earlier look; over its whole life where that saw
/// another life of it, or none.
#[must_use]
pub fn rows(readings: &Readings, earlier: &BTreeMap<Process, Health>) -> Vec<Row> {
    let each = readings.processes.iter();
    each.map(|(&process, health)| {
        let earlier = earlier.get(&process).filter(|then| then.pid == health.pid);
        let mut row = row(process, health, earlier);
        match process {
            Process::Sensor => row.sources = readings.sources.iter().map(source_row).collect(),
            Process::Motor => {
                row.buses = readings.buses.iter().map(bus_row).collect();
                row.joints = joints_row(readings);
            }
            Process::Belief => {
                row.perspectives = readings.perspectives.iter().map(perspective_row).collect();
            }
            Process::Link => row.link = readings.link.as_ref().map(link_row),
            Process::Simulator
            | Process::Learner
            | Process::MockBus
            | Process::Console
            | Process::Supervisor => {}
        }
        row
    })
    .collect()
}

fn joints_row(readings: &Readings) -> Option<JointsRow> {
    if readings.joints.is_empty() {
        return None;
    }
    let licences = Licences::of(&readings.joints);
    let counts = |groups: &[message::LicenceGroup]| {
        groups.iter().map(|group| (group.cause.name(), group.joints.len())).collect()
    };
    let troubled = readings.joints.iter().filter(|joint| joint.is_in_trouble());
    Some(JointsRow {
        armed: licences.armed,
        disarmed: counts(&licences.disarmed),
        locked: counts(&licences.locked),
        locks: readings.joint_locks,
        goals_limited: readings.goals_limited,
        goals_refused: readings.goals_refused,
        trouble: troubled.map(|joint| joint_row(readings, joint)).collect(),
        line: licences.line(),
    })
}

fn joint_row(readings: &Readings, joint: &JointState) -> JointRow {
    let machines = joint.machines();
    JointRow {
        joint: readings.joint_name(joint.joint),
        mode: joint.mode().map(message::JointMode::name),
        cause: joint.cause().map(message::JointCause::name),
        link: machines.map(|machines| machines.link.name()),
        power: machines.map(|machines| machines.power.name()),
        licence: machines.map(|machines| machines.licence.name()),
        licence_cause: machines.map(|machines| machines.licence_cause.name()),
        motion: machines.map(|machines| machines.motion.name()),
        reading_age_s: joint.reading_age_s(readings.read_at_ns),
    }
}

fn link_row(link: &LinkHealth) -> LinkRow {
    let micros = |nanos| Duration::from_nanos(nanos).as_secs_f64() * 1e6;
    LinkRow {
        heard: link.is_heard != 0,
        round_trip_us: micros(link.round_trip_ns),
        clock_error_us: micros(link.clock_error_ns),
        sent: link.sent,
        overtaken: link.overtaken,
        received: link.received,
        lost: link.lost,
        late: link.late,
        delay_us: Quantiles::of(&link.delay),
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
        alerts: bus.alerts,
        restarts: bus.restarts,
        watchdogs: bus.watchdogs,
        refusals: bus.refusals,
        duplicates: bus.duplicates,
        hang_ups: bus.hang_ups,
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

fn row(process: Process, health: &Health, earlier: Option<&Health>) -> Row {
    let earlier = earlier.copied().unwrap_or_default();
    let rate_hz = (health.period_ns > 0).then(|| 1.0 / Duration::from_nanos(health.period_ns).as_secs_f64());
    Row {
        process: process.to_string(),
        pid: health.pid,
        state: match health.state() {
            Some(ProcessState::Starting) => "starting",
            Some(ProcessState::Running) => "running",
            Some(ProcessState::Stopping) => "stopping",
            Some(ProcessState::Absent) => "down",
            None => "unknown",
        },
        restarts: health.incarnation.saturating_sub(1),
        rate_hz,
        cycles: health.cycles,
        overruns: health.overruns,
        skipped: health.skipped,
        drops: health.drops,
        refused: health.refused,
        unlisted_frames: health.unlisted_frames,
        unlisted_pid: health.unlisted_pid,
        sources: Vec::new(),
        buses: Vec::new(),
        joints: None,
        perspectives: Vec::new(),
        link: None,
        page_faults: health.page_faults,
        wakeup_us: Quantiles::of(&health.wakeup.since(&earlier.wakeup)),
        execution_us: Quantiles::of(&health.execution.since(&earlier.execution)),
        age_us: Quantiles::of(&health.latency.since(&earlier.latency)),
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
        let readings = Readings { processes: [(Process::Belief, now)].into(), ..Readings::default() };
        let row = rows(&readings, &[(Process::Belief, then)].into()).remove(0);
        assert_eq!(row.execution_us.count, 1);
        assert!(row.execution_us.p99 < 3.0);
        then.pid = 8;
        let row = rows(&readings, &[(Process::Belief, then)].into()).remove(0);
        assert_eq!(row.execution_us.count, 2, "an earlier life was another process");
    }
}

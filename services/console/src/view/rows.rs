//! The readings of a robot as rows: the document of `leo top --json`.

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
    /// The process id.
    pub pid: u32,
    /// Starting, running or stopping; down if no process runs or it has not reported yet.
    pub state: &'static str,
    /// Number of restarts.
    pub restarts: u64,
    /// Configured rate; `None` for an event-driven process.
    pub rate_hz: Option<f64>,
    /// Cycles since this incarnation began.
    pub cycles: u64,
    /// Cycles that ended after their deadline.
    pub overruns: u64,
    /// Skipped releases.
    pub skipped: u64,
    /// Frames lost at its subscribers.
    pub drops: u64,
    /// Malformed frames or entries that were refused.
    pub refused: u64,
    /// Frames refused because the roster does not list their publisher.
    pub unlisted_frames: u64,
    /// The process id of the newest such publisher; zero if there was none.
    pub unlisted_pid: u64,
    /// Failed checks of invariants.
    pub broken_invariants: u64,
    /// Sensor process only: its sensory sources.
    pub sources: Vec<SourceRow>,
    /// Motor process only: its servo buses.
    pub buses: Vec<BusRow>,
    /// Motor process only: its joints.
    pub joints: Option<JointsRow>,
    /// Belief process only: the perspectives that are computed.
    pub perspectives: Vec<PerspectiveRow>,
    /// Link process only: the link to the other machine.
    pub link: Option<LinkRow>,
    /// Page faults since its loop began.
    pub page_faults: u64,
    /// Wake-up latency: release to start.
    pub wakeup_us: Quantiles,
    /// Execution time: start to end.
    pub execution_us: Quantiles,
    /// Age of the input.
    pub age_us: Quantiles,
}

/// The current state of the joints.
#[derive(Clone, Debug, Serialize)]
pub struct JointsRow {
    /// Number of joints that may move.
    pub armed: usize,
    /// Number of disarmed joints, by cause.
    pub disarmed: BTreeMap<&'static str, usize>,
    /// Number of locked joints, by cause; a person must acknowledge the lock.
    pub locked: BTreeMap<&'static str, usize>,
    /// Number of locks since the motor process started.
    pub locks: u64,
    /// Goals beyond a joint's limits, which were clamped.
    pub goals_limited: u64,
    /// Goals refused: not a number, or for an unknown joint.
    pub goals_refused: u64,
    /// Joints that need attention.
    pub trouble: Vec<JointRow>,
    /// Licences and causes in one line.
    #[serde(skip)]
    pub line: String,
}

/// A joint that needs attention.
#[derive(Clone, Debug, Serialize)]
pub struct JointRow {
    /// Its name.
    pub joint: String,
    /// The mode in which the motor process drives it.
    pub mode: Option<&'static str>,
    /// The cause of the mode.
    pub cause: Option<&'static str>,
    /// State of the connection to its servo.
    pub link: Option<&'static str>,
    /// State of its servo's torque.
    pub power: Option<&'static str>,
    /// Its arming state.
    pub arming: Option<&'static str>,
    /// Why it is not armed.
    pub arming_cause: Option<&'static str>,
    /// State of its motion.
    pub motion: Option<&'static str>,
    /// Time since its servo was last read.
    pub reading_age_s: Option<f64>,
}

/// The link to the other machine, since the link process's incarnation began.
#[derive(Clone, Debug, Serialize)]
pub struct LinkRow {
    /// Whether the other machine is currently reachable.
    pub up: bool,
    /// The newest round-trip time, in microseconds.
    pub round_trip_us: f64,
    /// Maximum error of the clock offset, in microseconds.
    pub clock_error_us: f64,
    /// Frames sent.
    pub sent: u64,
    /// Frames not sent because a newer one replaced them.
    pub overtaken: u64,
    /// Frames received.
    pub received: u64,
    /// Batches of frames lost.
    pub lost: u64,
    /// Commands that arrived too late.
    pub late: u64,
    /// One-way delay from the other machine.
    pub delay_us: Quantiles,
}

/// A sensory source, since the sensor process's incarnation began.
#[derive(Clone, Debug, Serialize)]
pub struct SourceRow {
    /// Its name in the configuration.
    pub name: String,
    /// Whether its frames are overdue.
    pub silent: bool,
    /// Frames accepted.
    pub frames: u64,
    /// Observations published.
    pub observations: u64,
    /// Losses by the name of the reason, without zero counts.
    pub losses: BTreeMap<&'static str, u64>,
}

/// A servo bus, since the motor process's incarnation began.
#[derive(Clone, Debug, Serialize)]
pub struct BusRow {
    /// Its name in the configuration.
    pub name: String,
    /// Whether its serial port is currently lost.
    pub lost: bool,
    /// Number of joints on it.
    pub joints: u64,
    /// Number of its joints that are quarantined now.
    pub quarantined: u64,
    /// Completed requests.
    pub exchanges: u64,
    /// Cycles skipped because the previous request was still in progress.
    pub skipped: u64,
    /// Missing replies.
    pub missed: u64,
    /// Corrupt replies.
    pub broken: u64,
    /// Replies dropped because they belong to an earlier cycle.
    pub stale: u64,
    /// Bytes that arrived too late.
    pub late_bytes: u64,
    /// Hardware alerts of its servos.
    pub alerts: u64,
    /// Unexpected restarts of its servos.
    pub restarts: u64,
    /// Tripped bus watchdogs of its servos.
    pub watchdogs: u64,
    /// Instructions that a servo refused with an error number.
    pub refusals: u64,
    /// Identifiers to which two servos were found to reply.
    pub duplicates: u64,
    /// Number of times that its serial port was lost.
    pub hang_ups: u64,
    /// Duration of the requests.
    pub exchange_us: Quantiles,
}

/// A perspective, since the belief process's incarnation began.
#[derive(Clone, Debug, Serialize)]
pub struct PerspectiveRow {
    /// The path of agents: empty for the robot's own, `[1]` for partner 1's.
    pub path: Vec<u16>,
    /// Number of belief steps.
    pub steps: u64,
    /// Sum of the numbers of beliefs after each step.
    pub beliefs: u64,
}

/// One row per process, over the time since `earlier`. Covers the whole incarnation if `earlier` is of another
/// one, or is missing.
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
        arming: machines.map(|machines| machines.licence.name()),
        arming_cause: machines.map(|machines| machines.licence_cause.name()),
        motion: machines.map(|machines| machines.motion.name()),
        reading_age_s: joint.reading_age_s(readings.read_at_ns),
    }
}

fn link_row(link: &LinkHealth) -> LinkRow {
    let micros = |nanos| Duration::from_nanos(nanos).as_secs_f64() * 1e6;
    LinkRow {
        up: link.is_heard != 0,
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
        broken_invariants: health.broken_invariants,
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
    fn a_row_counts_events_since_the_previous_poll() {
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

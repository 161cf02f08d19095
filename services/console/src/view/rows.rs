//! The readings of a robot as rows: the document of `leo top --json`.

use std::collections::BTreeMap;
use std::time::Duration;

use message::{
    ArmingSummary, BusHealth, Health, JointCause, JointMode, JointState, LinkHealth, Loss, PerspectiveHealth,
    Process, ProcessState, SourceHealth,
};
use reports::metrics::{Quantiles, Readings};
use serde::Serialize;

/// Defines a row by its fields, each with its value.
macro_rules! row {
    ($(#[$doc:meta])* $row:ident($($source:ident: $type:ty),+) {
        $($(#[$field_doc:meta])* $field:ident: $kind:ty = $value:expr,)+
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Serialize)]
        pub struct $row { $($(#[$field_doc])* pub $field: $kind,)+ }

        impl $row {
            pub(crate) fn of($($source: $type),+) -> Self {
                Self { $($field: $value,)+ }
            }
        }
    };
}

row! {
    /// One row: a process over the last interval.
    Row(process: Process, health: &Health, earlier: &Health) {
        /// The process.
        process: String = process.to_string(),
        /// The process id.
        pid: u32 = health.pid,
        /// Starting, running or stopping; down if no process runs or it has not reported yet.
        state: &'static str = health.state().map_or("unknown", ProcessState::name),
        /// Number of restarts.
        restarts: u64 = health.incarnation.saturating_sub(1),
        /// Configured rate; `None` for an event-driven process.
        rate_hz: Option<f64> =
            (health.period_ns > 0).then(|| 1.0 / Duration::from_nanos(health.period_ns).as_secs_f64()),
        /// Cycles since this incarnation began.
        cycles: u64 = health.cycles,
        /// Cycles that ended after their deadline.
        overruns: u64 = health.overruns,
        /// Skipped releases.
        skipped: u64 = health.skipped,
        /// Frames lost at its subscribers.
        drops: u64 = health.drops,
        /// Malformed frames or entries that were refused.
        refused: u64 = health.refused,
        /// Frames refused because the roster does not list their publisher.
        unlisted_frames: u64 = health.unlisted_frames,
        /// The process id of the newest such publisher; zero if there was none.
        unlisted_pid: u64 = health.unlisted_pid,
        /// Failed checks of invariants.
        broken_invariants: u64 = health.broken_invariants,
        /// Sensor process only: its sensory sources.
        sources: Vec<SourceRow> = Vec::new(),
        /// Motor process only: its servo buses.
        buses: Vec<BusRow> = Vec::new(),
        /// Motor process only: its joints.
        joints: Option<JointsRow> = None,
        /// Belief process only: the perspectives that are computed.
        perspectives: Vec<PerspectiveRow> = Vec::new(),
        /// Link process only: the link to the other machine.
        link: Option<LinkRow> = None,
        /// Page faults since its loop began.
        page_faults: u64 = health.page_faults,
        /// Wake-up latency: release to start.
        wakeup_us: Quantiles = Quantiles::of(&health.wakeup.since(&earlier.wakeup)),
        /// Execution time: start to end.
        execution_us: Quantiles = Quantiles::of(&health.execution.since(&earlier.execution)),
        /// Age of the input.
        age_us: Quantiles = Quantiles::of(&health.latency.since(&earlier.latency)),
    }
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
    /// Arming states and causes in one line.
    #[serde(skip)]
    pub line: String,
}

row! {
    /// A joint that needs attention.
    JointRow(readings: &Readings, joint: &JointState) {
        /// Its state.
        #[serde(flatten)]
        state: JointStateRow = JointStateRow::of(readings.joint_name(joint.joint), joint),
        /// Time since its servo was last read.
        reading_age_s: Option<f64> = joint.reading_age_s(readings.read_at_ns),
    }
}

row! {
    /// The state of a joint, in words.
    JointStateRow(name: String, joint: &JointState) {
        /// Its name.
        joint: String = name,
        /// The mode in which the motor process drives it.
        mode: Option<&'static str> = joint.mode().map(JointMode::name),
        /// The cause of the mode.
        cause: Option<&'static str> = joint.cause().map(JointCause::name),
        /// State of the connection to its servo.
        link: Option<&'static str> = joint.machines().map(|machines| machines.link.name()),
        /// State of its servo's torque.
        power: Option<&'static str> = joint.machines().map(|machines| machines.power.name()),
        /// Its arming state.
        arming: Option<&'static str> = joint.machines().map(|machines| machines.arming.name()),
        /// Why it is not armed.
        arming_cause: Option<&'static str> = joint.machines().map(|machines| machines.arming_cause.name()),
        /// State of its motion.
        motion: Option<&'static str> = joint.machines().map(|machines| machines.motion.name()),
    }
}

row! {
    /// The link to the other machine, since the link process's incarnation began.
    LinkRow(link: &LinkHealth) {
        /// Whether the other machine is currently reachable.
        up: bool = link.is_up != 0,
        /// The newest round-trip time, in microseconds.
        round_trip_us: f64 = micros(link.round_trip_ns),
        /// Maximum error of the clock offset, in microseconds.
        clock_error_us: f64 = micros(link.clock_error_ns),
        /// Frames sent.
        sent: u64 = link.sent,
        /// Frames not sent because a newer one replaced them.
        overtaken: u64 = link.overtaken,
        /// Frames received.
        received: u64 = link.received,
        /// Batches of frames lost.
        lost: u64 = link.lost,
        /// Commands that arrived too late.
        late: u64 = link.late,
        /// One-way delay from the other machine.
        delay_us: Quantiles = Quantiles::of(&link.delay),
    }
}

row! {
    /// A sensory source, since the sensor process's incarnation began.
    SourceRow(source: &SourceHealth) {
        /// Its name in the configuration.
        name: String = source.name.as_str().to_owned(),
        /// Whether its frames are overdue.
        silent: bool = source.silent != 0,
        /// Frames accepted.
        frames: u64 = source.frames,
        /// Observations published.
        observations: u64 = source.observations,
        /// Losses by the name of the reason, without zero counts.
        losses: BTreeMap<&'static str, u64> = Loss::ALL
            .iter()
            .map(|loss| (loss.name(), source.lost(*loss)))
            .filter(|(_, count)| *count > 0)
            .collect(),
    }
}

row! {
    /// A servo bus, since the motor process's incarnation began.
    BusRow(bus: &BusHealth) {
        /// Its name in the configuration.
        name: String = bus.name.as_str().to_owned(),
        /// Whether its serial port is currently lost.
        lost: bool = bus.lost != 0,
        /// Number of joints on it.
        joints: u64 = bus.joints,
        /// Number of its joints that are quarantined now.
        quarantined: u64 = bus.quarantined,
        /// Completed requests.
        exchanges: u64 = bus.exchanges,
        /// Cycles skipped because the previous request was still in progress.
        skipped: u64 = bus.skipped,
        /// Missing replies.
        missed: u64 = bus.missed,
        /// Corrupt replies.
        corrupt: u64 = bus.corrupt,
        /// Replies dropped because they belong to an earlier cycle.
        stale: u64 = bus.stale,
        /// Bytes that arrived too late.
        late_bytes: u64 = bus.late_bytes,
        /// Hardware alerts of its servos.
        alerts: u64 = bus.alerts,
        /// Unexpected restarts of its servos.
        restarts: u64 = bus.restarts,
        /// Tripped bus watchdogs of its servos.
        watchdogs: u64 = bus.watchdogs,
        /// Instructions that a servo refused with an error number.
        refusals: u64 = bus.refusals,
        /// Identifiers to which two servos were found to reply.
        duplicates: u64 = bus.duplicates,
        /// Number of times that its serial port was lost.
        hang_ups: u64 = bus.hang_ups,
        /// Duration of the requests.
        exchange_us: Quantiles = Quantiles::of(&bus.exchange),
    }
}

row! {
    /// A perspective, since the belief process's incarnation began.
    PerspectiveRow(perspective: &PerspectiveHealth) {
        /// The path of agents: empty for the robot's own, `[1]` for partner 1's.
        path: Vec<u16> = perspective.path.agents().unwrap_or_default().to_vec(),
        /// Number of belief steps.
        steps: u64 = perspective.steps,
        /// Sum of the numbers of beliefs after each step.
        beliefs: u64 = perspective.beliefs,
    }
}

fn micros(nanos: u64) -> f64 {
    Duration::from_nanos(nanos).as_secs_f64() * 1e6
}

/// One row per process, over the time since `earlier`. Covers the whole incarnation if `earlier` is of another
/// one, or is missing.
pub(crate) fn rows(readings: &Readings, earlier: &BTreeMap<Process, Health>) -> Vec<Row> {
    let each = readings.processes.iter();
    each.map(|(&process, health)| {
        let earlier = earlier.get(&process).filter(|then| then.pid == health.pid);
        let mut row = Row::of(process, health, &earlier.copied().unwrap_or_default());
        match process {
            Process::Sensor => row.sources = readings.sources.iter().map(SourceRow::of).collect(),
            Process::Motor => {
                row.buses = readings.buses.iter().map(BusRow::of).collect();
                row.joints = joints_row(readings);
            }
            Process::Belief => {
                row.perspectives = readings.perspectives.iter().map(PerspectiveRow::of).collect();
            }
            Process::Link => row.link = readings.link.as_ref().map(LinkRow::of),
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
    let summary = ArmingSummary::of(&readings.joints);
    let counts = |groups: &[message::ArmingGroup]| {
        groups.iter().map(|group| (group.cause.name(), group.joints.len())).collect()
    };
    let troubled = readings.joints.iter().filter(|joint| joint.is_in_trouble());
    Some(JointsRow {
        armed: summary.armed,
        disarmed: counts(&summary.disarmed),
        locked: counts(&summary.locked),
        locks: readings.joint_locks,
        goals_limited: readings.goals_limited,
        goals_refused: readings.goals_refused,
        trouble: troubled.map(|joint| JointRow::of(readings, joint)).collect(),
        line: summary.line(),
    })
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

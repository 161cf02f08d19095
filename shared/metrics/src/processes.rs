//! Metrics of the processes' main loops: counters, latencies and execution times.

use message::{Health, Histogram, ProcessState};
use quantity::number::float;

use crate::page::{Kind, MetricsText, seconds};
use crate::readings::Readings;

/// A counter of a process: family name, help text, field.
type Count = (&'static str, &'static str, fn(&Health) -> u64);

const COUNTS: [Count; 11] = [
    ("leo_process_restarts", "Restarts of the process.", |health| health.incarnation.saturating_sub(1)),
    ("leo_process_heartbeats", "Cycles of the loop; a process whose value is constant hangs.", |health| {
        health.beat
    }),
    ("leo_process_cycles", "Cycles begun.", |health| health.cycles),
    ("leo_process_overruns", "Cycles that ended after their deadline.", |health| health.overruns),
    ("leo_process_skipped_releases", "Releases that an overrun ran past.", |health| health.skipped),
    ("leo_process_dropped_frames", "Frames lost because the process was slow to read them.", |health| {
        health.drops
    }),
    ("leo_process_undelivered_frames", "Frames that could not be delivered to a subscriber.", |health| {
        health.undelivered
    }),
    ("leo_process_refused", "Frames or entries refused as malformed.", |health| health.refused),
    (
        "leo_process_unlisted_frames",
        "Frames refused because the roster does not name their publisher.",
        |health| health.unlisted_frames,
    ),
    ("leo_process_broken_invariants", "Failed checks of invariants; each is a bug.", |health| {
        health.broken_invariants
    }),
    ("leo_process_page_faults", "Page faults since the loop began.", |health| health.page_faults),
];

/// A histogram of a process: stem of the family names, help text, field.
type Distribution = (&'static str, &'static str, fn(&Health) -> &Histogram);

const DISTRIBUTIONS: [Distribution; 3] = [
    ("leo_wakeup", "From the release or the notification to the start of the cycle", |health| &health.wakeup),
    ("leo_execution", "From start to end of the cycle", |health| &health.execution),
    ("leo_input_age", "Age of the input when the step on it began", |health| &health.latency),
];

/// Names of the missing rights, by bit.
const RIGHTS: [(u64, &str); 3] = [(1, "priority"), (2, "cores"), (4, "memory")];

pub(crate) fn write(readings: &Readings, page: &mut MetricsText) {
    let each = || readings.processes.iter().map(|(process, health)| (process.name(), health));
    let is = |it| f64::from(u8::from(it));

    let running =
        each().map(|(process, health)| (process, is(health.state() == Some(ProcessState::Running))));
    page.gauges("leo_process_running", "1 while the process is in its loop.", "process", running);
    let rates = each().filter(|(_, health)| health.period_ns > 0);
    let rates = rates.map(|(process, health)| (process, 1e9 / float(health.period_ns)));
    let help = "Configured rate; absent for event-driven processes.";
    page.gauges("leo_process_rate_hertz", help, "process", rates);
    page.family("leo_process_missing_right", Kind::Gauge, "1 where a configured right is not granted.");
    for (process, health) in each() {
        for (bit, right) in RIGHTS {
            page.gauge(&[("process", process), ("right", right)], is(health.missing_rights & bit != 0));
        }
    }
    for (name, help, of) in COUNTS {
        page.counts(name, help, "process", each().map(|(process, health)| (process, of(health))));
    }
    for (stem, help, of) in DISTRIBUTIONS {
        let labelled: Vec<_> = each().map(|(process, health)| (process, of(health))).collect();
        distribution(page, stem, help, "process", &labelled);
    }
}

/// Writes a histogram in three forms: buckets, from which the collector computes quantiles of any period; quantiles
/// over the whole incarnation; and the exact maximum.
pub(crate) fn distribution(
    page: &mut MetricsText,
    stem: &str,
    help: &str,
    label: &str,
    labelled: &[(&str, &Histogram)],
) {
    let labelled = || labelled.iter().filter(|(_, histogram)| histogram.count() > 0);
    page.family(&format!("{stem}_seconds"), Kind::Histogram, &format!("{help}."));
    for (name, histogram) in labelled() {
        page.buckets(&[(label, name)], histogram);
    }
    let life = format!("{help}, since the process started.");
    page.family(&format!("{stem}_since_start_seconds"), Kind::Summary, &life);
    for (name, histogram) in labelled() {
        page.quantiles(&[(label, name)], histogram);
    }
    let max = format!("{help}: the maximum since the process started.");
    page.family(&format!("{stem}_max_seconds"), Kind::Gauge, &max);
    for (name, histogram) in labelled() {
        page.gauge(&[(label, name)], seconds(histogram.max_ns()));
    }
}

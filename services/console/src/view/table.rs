//! The rows as text, for output that is not a terminal.

use std::fmt::Write as _;

use reports::text_table::{Align, TextTable};

use super::rows::{BusRow, PerspectiveRow, Row};

/// The columns of a process. Durations are in microseconds.
const COLUMNS: [(&str, Align); 14] = [
    ("process", Align::Left),
    ("pid", Align::Right),
    ("state", Align::Left),
    ("rate\nHz", Align::Right),
    ("\ncycles", Align::Right),
    ("wake-up\np50 us", Align::Right),
    ("\np99", Align::Right),
    ("execution\np50 us", Align::Right),
    ("\np99", Align::Right),
    ("\nmax", Align::Right),
    ("over\nruns", Align::Right),
    ("\nskipped", Align::Right),
    ("\ndrops", Align::Right),
    ("\nrestarts", Align::Right),
];

/// The rows as a table. Below it, a line for each process that refused frames, each sensory source, each perspective and
/// each servo bus.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut table = TextTable::new(&COLUMNS);
    for row in rows {
        let rate = row.rate_hz.map_or_else(|| "woken".to_owned(), |rate| format!("{rate:.0}"));
        table.add([
            row.process.to_string(),
            row.pid.to_string(),
            row.state.to_string(),
            rate,
            row.cycles.to_string(),
            format!("{:.0}", row.wakeup_us.p50),
            format!("{:.0}", row.wakeup_us.p99),
            format!("{:.0}", row.execution_us.p50),
            format!("{:.0}", row.execution_us.p99),
            format!("{:.0}", row.execution_us.max),
            row.overruns.to_string(),
            row.skipped.to_string(),
            row.drops.to_string(),
            row.restarts.to_string(),
        ]);
    }
    let mut out = table.to_text();
    for line in rows.iter().flat_map(warnings) {
        let _ = writeln!(out, "{line}");
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
    for joints in rows.iter().filter_map(|row| row.joints.as_ref()) {
        let _ = writeln!(out, "joints {}", joints.line);
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

/// A line about frames of processes that the supervisor did not start, and one about broken invariants, if any.
pub(super) fn warnings(row: &Row) -> impl Iterator<Item = String> {
    let unlisted = (row.unlisted_frames > 0).then(|| {
        format!(
            "{:<10} refused {} frames of process {}, which the supervisor did not start",
            row.process, row.unlisted_frames, row.unlisted_pid
        )
    });
    let broken = (row.broken_invariants > 0).then(|| {
        let count = row.broken_invariants;
        format!("{:<10} found {count} broken invariants: a bug; the journal names the place", row.process)
    });
    unlisted.into_iter().chain(broken)
}

/// The non-zero fault counters of a bus.
fn in_trouble(bus: &BusRow) -> String {
    let answers = [
        (bus.skipped, "skipped"),
        (bus.missed, "missed"),
        (bus.corrupt, "corrupt"),
        (bus.stale, "stale"),
        (bus.late_bytes, "late bytes"),
    ];
    nonzero_counts(&[answers.as_slice(), &rare_events(bus)].concat())
}

/// The counters of rare events of a bus and its servos.
pub(super) const fn rare_events(bus: &BusRow) -> [(u64, &'static str); 6] {
    [
        (bus.alerts, "alerts"),
        (bus.restarts, "servo restarts"),
        (bus.watchdogs, "watchdogs tripped"),
        (bus.refusals, "refusals"),
        (bus.duplicates, "duplicate ids"),
        (bus.hang_ups, "hang-ups"),
    ]
}

/// Counters as text, without zeros.
pub(super) fn nonzero_counts(counts: &[(u64, &str)]) -> String {
    let parts: Vec<_> = counts
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    if parts.is_empty() { String::new() } else { format!("   {}", parts.join(", ")) }
}

#[cfg(test)]
mod tests {
    use message::{BusHealth, Health, Loss, Path, PerspectiveHealth, Process, SourceHealth, Text};
    use reports::metrics::Readings;

    use super::*;
    use crate::view::rows::rows;

    fn words(line: &str) -> String {
        line.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    fn told(process: Process, readings: Readings) -> (Vec<Row>, String) {
        let processes = [(process, Health::default())].into();
        let rows = rows(&Readings { processes, ..readings }, &[].into());
        let table = table(&rows);
        (rows, table)
    }

    #[test]
    fn each_source_has_a_line_below_the_table() {
        let mut camera = SourceHealth { frames: 12, observations: 34, silent: 1, ..SourceHealth::default() };
        camera.name = Text::new("camera");
        camera.losses[usize::from(Loss::Position.raw())] = 7;
        camera.losses[usize::from(Loss::Overtaken.raw())] = 2;
        let sources = vec![SourceHealth::default(), camera];
        let (rows, table) = told(Process::Sensor, Readings { sources, ..Readings::default() });
        let sources = &rows[0].sources;
        assert_eq!((sources[1].losses.len(), sources[1].losses["position"]), (2, 7));
        let should = "source 1 camera 12 frames 34 observations SILENT lost: 2 overtaken, 7 position";
        assert_eq!(words(table.lines().last().unwrap()), should);
    }

    #[test]
    fn rare_bus_events_are_listed_below_the_table_and_in_json() {
        let mut bus = BusHealth { exchanges: 7, missed: 1, ..BusHealth::default() };
        bus.name = Text::new("torso");
        (bus.alerts, bus.restarts, bus.watchdogs) = (2, 3, 4);
        (bus.refusals, bus.duplicates, bus.hang_ups) = (5, 6, 8);
        let (rows, table) = told(Process::Motor, Readings { buses: vec![bus], ..Readings::default() });
        let line = words(table.lines().last().unwrap());
        let should = "1 missed, 2 alerts, 3 servo restarts, 4 watchdogs tripped, 5 refusals, 6 duplicate ids, 8 hang-ups";
        assert!(line.ends_with(should), "{line}");
        let document = serde_json::to_value(&rows[0].buses[0]).unwrap();
        let keys = ["alerts", "restarts", "watchdogs", "refusals", "duplicates", "hang_ups"];
        assert_eq!(keys.map(|key| document[key].as_u64()), [2, 3, 4, 5, 6, 8].map(Some));
    }

    #[test]
    fn refused_publishers_are_listed_below_the_table() {
        let mut health = Health::default();
        (health.unlisted_frames, health.unlisted_pid) = (3, 77);
        let processes = [(Process::Motor, health)].into();
        let rows = rows(&Readings { processes, ..Readings::default() }, &[].into());
        let line = words(table(&rows).lines().last().unwrap());
        assert!(line.starts_with("motor ") && line.contains("3 frames of process 77"), "{line}");
        insta::assert_snapshot!(line);
    }

    #[test]
    fn broken_invariants_are_listed_below_the_table() {
        let mut health = Health::default();
        health.broken_invariants = 2;
        let rows = rows(
            &Readings { processes: [(Process::Belief, health)].into(), ..Readings::default() },
            &[].into(),
        );
        let line = words(table(&rows).lines().last().unwrap());
        assert!(line.starts_with("belief ") && line.contains("2 broken invariants"), "{line}");
        insta::assert_snapshot!(line);
    }

    #[test]
    fn each_perspective_has_a_line_below_the_table() {
        let within = |path: Path, agent| path.within(agent).unwrap();
        let partner = within(Path::ROBOT, 1);
        let perspectives = [Path::ROBOT, partner, within(partner, 0)]
            .map(|path| PerspectiveHealth { path, steps: 7, beliefs: 21, ..PerspectiveHealth::default() })
            .to_vec();
        let (_, table) = told(Process::Belief, Readings { perspectives, ..Readings::default() });
        let lines: Vec<String> = table.lines().skip(3).map(words).collect();
        let should = ["perspective 0 [] 7 steps 21 beliefs", "perspective 1 [1] 7 steps 21 beliefs"];
        assert_eq!(lines[..2], should);
        assert_eq!(lines[2], "perspective 2 [1, 0] 7 steps 21 beliefs");
    }
}

//! Draws the screen, for a terminal of 80 columns.

use message::{ArmingSummary, JointCause, JointState, Process};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::{Cell, Paragraph, Row, Table, TableState};

use super::histogram;
use super::rows::BusRow;
use super::screen::{Screen, View};
use super::table::{nonzero_counts, rare_events, warnings};

const KEYS: &str = "q quit  s sort  r reverse  space freeze  h histogram  b buses  j joints  ? help";

const HELP: [&str; 18] = [
    "q, Ctrl-C   quit",
    "s           sort by the next column: the worst first",
    "r           reverse the order",
    "space       freeze, and continue",
    "up, down    select a process",
    "h, Enter    the selected process: wake-up latency, execution time and input age, since its",
    "            start",
    "b           the servo buses",
    "j           the joints that are in trouble",
    "Esc         back to the table",
    "",
    "wake        from the release, or the bell, to the start of the cycle, in µs of the last second:",
    "            half the cycles were no later than wake50, 99 of 100 no later than wake99 (its jitter)",
    "exec        from the start to the end of the cycle, likewise",
    "age         from the publication of its input to the start of the cycle, likewise",
    "over, skip  cycles that ended late; releases skipped because of them, since the start",
    "drop        frames lost because the process was slow to read them",
    "re          number of restarts",
];

pub(crate) fn draw(frame: &mut Frame<'_>, screen: &Screen) {
    let [top, body, bottom] =
        Layout::vertical([Constraint::Length(1), Constraint::Min(0), Constraint::Length(1)])
            .areas(frame.area());
    let strong = Style::new().add_modifier(Modifier::REVERSED);
    frame.render_widget(Paragraph::new(title(screen)).style(strong), top);
    frame.render_widget(Paragraph::new(KEYS), bottom);
    match screen.view {
        View::Processes => processes(frame, body, screen),
        View::Histogram => histograms(frame, body, screen),
        View::Buses => buses(frame, body, screen),
        View::Joints => joints(frame, body, screen),
        View::Help => frame.render_widget(Paragraph::new(HELP.map(Line::from).to_vec()), body),
    }
}

fn title(screen: &Screen) -> String {
    let about = match screen.view {
        View::Processes => format!("processes, {}", screen.column.name()),
        View::Histogram => {
            let process = screen.rows().get(screen.selected()).map_or("", |row| &row.process).to_owned();
            format!("{process}: wake-up, execution and age since its start")
        }
        View::Buses => "servo buses".to_owned(),
        View::Joints => "joints in trouble".to_owned(),
        View::Help => "keys and columns".to_owned(),
    };
    let frozen = if screen.is_frozen { "   FROZEN" } else { "" };
    let gone = if screen.is_running { "" } else { "   THE ROBOT HAS ENDED" };
    // The summary is shown above every view.
    let line = ArmingSummary::of(&screen.readings.joints).line();
    let joints = if line.is_empty() { line } else { format!("   {line}") };
    format!(" leo top   {about}{frozen}{gone}{joints}")
}

fn processes(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let warnings: Vec<Line<'_>> = screen.rows().into_iter().flat_map(warnings).map(Line::from).collect();
    let height = u16::try_from(warnings.len()).unwrap_or(0);
    let [area, below] = Layout::vertical([Constraint::Min(0), Constraint::Length(height)]).areas(area);
    frame.render_widget(Paragraph::new(warnings), below);
    let head = [
        "process", "state", "Hz", "wake50", "wake99", "exec50", "exec99", "age99", "over", "skip", "drop",
        "re",
    ];
    let widths = [9, 8, 5, 6, 6, 6, 6, 6, 5, 5, 4, 3].map(Constraint::Length);
    let rows = screen.rows().into_iter().map(|row| {
        let rate = row.rate_hz.map_or_else(|| "woken".to_owned(), |rate| format!("{rate:.0}"));
        let micros = |value: f64| format!("{value:.0}");
        let (wake, exec) = (&row.wakeup_us, &row.execution_us);
        let numbers = [
            rate,
            micros(wake.p50),
            micros(wake.p99),
            micros(exec.p50),
            micros(exec.p99),
            micros(row.age_us.p99),
            row.overruns.to_string(),
            row.skipped.to_string(),
            row.drops.to_string(),
            row.restarts.to_string(),
        ];
        let words = [row.process.clone(), row.state.to_owned()].map(Cell::from);
        Row::new(words.into_iter().chain(numbers.map(right)))
    });
    let table = Table::new(rows, widths)
        .column_spacing(1)
        .header(header_row(&head))
        .row_highlight_style(Style::new().add_modifier(Modifier::REVERSED));
    let mut state = TableState::default().with_selected(Some(screen.selected()));
    frame.render_stateful_widget(table, area, &mut state);
}

/// A table header: two left-aligned text columns, then right-aligned numbers.
fn header_row(words: &[&'static str]) -> Row<'static> {
    let cell = |(place, word): (usize, &&'static str)| {
        if place < 2 { Cell::from(*word) } else { right((*word).to_owned()) }
    };
    Row::new(words.iter().enumerate().map(cell)).style(Style::new().add_modifier(Modifier::BOLD))
}

fn right(text: String) -> Cell<'static> {
    Cell::from(Line::from(text).right_aligned())
}

fn histograms(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let rows = screen.rows();
    let Some(row) = rows.get(screen.selected()) else {
        return frame.render_widget(Paragraph::new("no process is running"), area);
    };
    let process = row.process.parse::<Process>().ok();
    let health = process.and_then(|process| screen.readings.processes.get(&process));
    let Some(health) = health else { return };
    let sides: [Rect; 3] = Layout::horizontal([Constraint::Ratio(1, 3); 3]).areas(area);
    let distributions =
        [("wake-up", &health.wakeup), ("execution", &health.execution), ("age", &health.latency)];
    for (side, (what, distribution)) in sides.into_iter().zip(distributions) {
        let mut lines = vec![Line::from(format!("{what}: {} cycles", distribution.count()))];
        lines.extend(histogram::lines(distribution).into_iter().map(Line::from));
        frame.render_widget(Paragraph::new(lines), side);
    }
}

fn buses(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let rows = screen.rows();
    let buses: Vec<&BusRow> = rows.iter().flat_map(|row| &row.buses).collect();
    if buses.is_empty() {
        return frame.render_widget(Paragraph::new("the motor process has reported no bus yet"), area);
    }
    let head =
        ["bus", "state", "requests", "p50", "p99", "quar", "skip", "missed", "corrupt", "stale", "late"];
    let widths = [12, 4, 9, 6, 6, 5, 5, 6, 7, 5, 5].map(Constraint::Length);
    // Rare events are listed below the table, one line for each affected bus.
    let befallen = buses.iter().filter_map(|bus| {
        let what = nonzero_counts(&rare_events(bus));
        (!what.is_empty()).then(|| Line::from(format!("{:<12}{what}", bus.name)))
    });
    let below = Paragraph::new(befallen.collect::<Vec<_>>());
    let rows = buses.iter().map(|bus| {
        let numbers = [
            bus.exchanges.to_string(),
            format!("{:.0}", bus.exchange_us.p50),
            format!("{:.0}", bus.exchange_us.p99),
            bus.quarantined.to_string(),
            bus.skipped.to_string(),
            bus.missed.to_string(),
            bus.corrupt.to_string(),
            bus.stale.to_string(),
            bus.late_bytes.to_string(),
        ];
        let words = [bus.name.clone(), if bus.lost { "LOST" } else { "well" }.to_owned()].map(Cell::from);
        Row::new(words.into_iter().chain(numbers.map(right)))
    });
    let height = u16::try_from(buses.len() + 1).unwrap_or(u16::MAX);
    let [above, rest] = Layout::vertical([Constraint::Length(height), Constraint::Min(0)]).areas(area);
    frame.render_widget(Table::new(rows, widths).column_spacing(1).header(header_row(&head)), above);
    frame.render_widget(below, rest);
}

fn joints(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let all = &screen.readings.joints;
    let troubled: Vec<&JointState> = all.iter().filter(|joint| joint.is_in_trouble()).collect();
    if troubled.is_empty() {
        let text = match all.len() {
            0 => "the motor process has reported no joint yet".to_owned(),
            count => format!("none of {count} joints is in trouble: {}", ArmingSummary::of(all).line()),
        };
        return frame.render_widget(Paragraph::new(text), area);
    }
    let head = format!("{:<34} {:<13} {:<16} {:<5} {:<5}", "joint", "does", "because", "°C", "V");
    let mut lines = vec![Line::from(head).style(Style::new().add_modifier(Modifier::BOLD))];
    for joint in troubled {
        let number = |value: Option<f32>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1}"));
        lines.push(Line::from(format!(
            "{:<34} {:<13} {:<16} {:<5} {:<5}",
            screen.readings.joint_name(joint.joint),
            joint.mode().map_or("?", |mode| mode.name()),
            joint.cause().map_or("?", |cause| cause.name()),
            number(joint.present_temperature_c()),
            number(joint.present_input_v()),
        )));
        lines.push(Line::from(machines(joint, screen.readings.read_at_ns)));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

/// The states of a joint's state machines, and the age of its last reading.
fn machines(joint: &JointState, now_ns: u64) -> String {
    let age = joint
        .reading_age_s(now_ns)
        .map_or_else(|| "never read".to_owned(), |age_s| format!("read {age_s:.1} s ago"));
    let Some(machines) = joint.machines() else { return format!("  states unknown; {age}") };
    let cause = Some(machines.arming_cause).filter(|cause| *cause != JointCause::None);
    let cause = cause.map_or_else(String::new, |cause| format!(": {}", cause.name()));
    format!(
        "  link {}, power {}, {}{cause}, {}; {age}",
        machines.link.name(),
        machines.power.name(),
        machines.arming.name(),
        machines.motion.name(),
    )
}

#[cfg(test)]
mod tests;

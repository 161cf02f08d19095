//! The state of the live table. No terminal, no clock.

use std::cmp::Ordering;

use reports::metrics::Readings;

use super::rows::Row;

/// The key Esc.
pub(crate) const ESCAPE: char = '\x1b';

/// The current view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum View {
    Processes,
    Histogram,
    Buses,
    Joints,
    Help,
}

/// The sort column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Column {
    /// In the order of the data flow.
    Process,
    WakeUp,
    Execution,
    Age,
    Overruns,
    Drops,
    Restarts,
}

impl Column {
    const ALL: [Self; 7] = [
        Self::Process,
        Self::WakeUp,
        Self::Execution,
        Self::Age,
        Self::Overruns,
        Self::Drops,
        Self::Restarts,
    ];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Process => "as data flows",
            Self::WakeUp => "wake-up p99",
            Self::Execution => "execution p99",
            Self::Age => "age p99",
            Self::Overruns => "overruns",
            Self::Drops => "drops",
            Self::Restarts => "restarts",
        }
    }

    fn next(self) -> Self {
        let index = Self::ALL.iter().position(|column| *column == self).unwrap_or(0);
        Self::ALL.get(index + 1).copied().unwrap_or(Self::Process)
    }

    /// Sorts the worst first.
    fn compare(self, one: &Row, other: &Row) -> Ordering {
        match self {
            Self::Process => Ordering::Equal,
            Self::WakeUp => other.wakeup_us.p99.total_cmp(&one.wakeup_us.p99),
            Self::Execution => other.execution_us.p99.total_cmp(&one.execution_us.p99),
            Self::Age => other.age_us.p99.total_cmp(&one.age_us.p99),
            Self::Overruns => other.overruns.cmp(&one.overruns),
            Self::Drops => other.drops.cmp(&one.drops),
            Self::Restarts => other.restarts.cmp(&one.restarts),
        }
    }
}

/// The displayed state and its data.
#[derive(Clone, Debug)]
pub(crate) struct Screen {
    pub(crate) view: View,
    pub(crate) column: Column,
    pub(crate) is_frozen: bool,
    /// Whether the robot still runs.
    pub(crate) is_running: bool,
    pub(crate) readings: Readings,
    is_reversed: bool,
    /// The selected process by name, because rows change their order.
    selected: Option<String>,
    rows: Vec<Row>,
}

impl Default for Screen {
    fn default() -> Self {
        Self {
            view: View::Processes,
            column: Column::Process,
            is_frozen: false,
            is_running: true,
            readings: Readings::default(),
            is_reversed: false,
            selected: None,
            rows: Vec::new(),
        }
    }
}

impl Screen {
    /// Updates the data, unless frozen.
    pub(crate) fn update(&mut self, readings: Readings, rows: Vec<Row>) {
        if !self.is_frozen {
            (self.readings, self.rows) = (readings, rows);
        }
    }

    /// Handles a key, given as a character. Returns whether to continue.
    pub(crate) fn press(&mut self, key: char) -> bool {
        match key {
            'q' => return false,
            's' => self.column = self.column.next(),
            'r' => self.is_reversed = !self.is_reversed,
            ' ' => self.is_frozen = !self.is_frozen,
            'h' => self.switch_to(View::Histogram),
            'b' => self.switch_to(View::Buses),
            'j' => self.switch_to(View::Joints),
            '?' => self.switch_to(View::Help),
            ESCAPE => self.view = View::Processes,
            '↑' => self.move_by(|index| index.checked_sub(1)),
            '↓' => self.move_by(|index| index.checked_add(1)),
            _ => {}
        }
        true
    }

    /// The rows in sort order.
    pub(crate) fn rows(&self) -> Vec<&Row> {
        let mut rows: Vec<&Row> = self.rows.iter().collect();
        rows.sort_by(|one, other| self.column.compare(one, other));
        if self.is_reversed {
            rows.reverse();
        }
        rows
    }

    /// The index of the selected row; zero if none is selected.
    pub(crate) fn selected(&self) -> usize {
        let rows = self.rows();
        rows.iter().position(|row| Some(&row.process) == self.selected.as_ref()).unwrap_or(0)
    }

    /// Switches to a view. The same key again returns to the table.
    fn switch_to(&mut self, view: View) {
        self.view = if self.view == view { View::Processes } else { view };
    }

    fn move_by(&mut self, step: impl Fn(usize) -> Option<usize>) {
        let index = step(self.selected());
        let process = index.and_then(|index| self.rows().get(index).map(|row| row.process.clone()));
        self.selected = process.or_else(|| self.selected.take());
    }
}

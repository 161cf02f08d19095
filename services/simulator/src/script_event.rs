//! The timeline of a lesson: the events of all its tables, one table after the other.

use clock::Duration;
use config::lesson::Lesson;

/// A scheduled event of the script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ScriptEvent {
    /// Time since the script's beginning.
    pub(crate) at: Duration,
    /// Index of the table in the lesson.
    pub(crate) table: usize,
    pub(crate) event: Event,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// The previous table is cleared.
    Clear,
    /// The table's occluders are put up.
    Occlude,
    /// The table's objects are laid.
    Lay,
    /// A step of the table's script begins.
    Step(usize),
}

/// The events in order of time, and the time when the last step has ended.
///
/// Each table stays empty for a while, visible to everyone, so that beliefs about the previous objects are culled.
/// Occluders are put up before the objects are laid, so that no one has seen what they hide.
pub(crate) fn timeline(lesson: &Lesson) -> (Vec<ScriptEvent>, Duration) {
    let table_timing = &lesson.table_timing;
    let mut script_events = Vec::new();
    let mut ends = Duration::ZERO;
    for (table, content) in lesson.tables().enumerate() {
        let stands = if table == 0 {
            ends
        } else {
            let clears = ends + table_timing.keep;
            script_events.push(ScriptEvent { at: clears, table, event: Event::Clear });
            clears + table_timing.empty.saturating_sub(table_timing.occluders_first)
        };
        let lies = stands + table_timing.occluders_first;
        script_events.push(ScriptEvent { at: stands, table, event: Event::Occlude });
        script_events.push(ScriptEvent { at: lies, table, event: Event::Lay });
        ends = lies;
        for (index, step) in content.script.iter().enumerate() {
            script_events.push(ScriptEvent { at: lies + step.at, table, event: Event::Step(index) });
            ends = ends.max(lies + step.at + step.act.takes());
        }
    }
    (script_events, ends)
}

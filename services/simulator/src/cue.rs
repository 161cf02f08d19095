//! A lesson's tables one after the other, as cues on one axis of time.

use clock::Duration;
use config::lesson::Lesson;

/// Something that happens by the script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cue {
    /// When, counted from the script's beginning.
    pub(crate) at: Duration,
    /// Which of the lesson's tables it belongs to.
    pub(crate) table: usize,
    pub(crate) event: Event,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// Everything of the table before is taken away.
    Clear,
    /// The table's occluders stand.
    Occlude,
    /// The table's objects lie.
    Lay,
    /// The step of the table's script begins.
    Step(usize),
}

/// The cues in the order of time, and when the last step has ended.
///
/// Before a table is laid it lies empty for a while, in view of everybody, so that the beliefs
/// about the old objects are culled; and the occluders stand before the objects lie, so that
/// nobody has seen what they hide.
pub(crate) fn timeline(lesson: &Lesson) -> (Vec<Cue>, Duration) {
    let laying = &lesson.laying;
    let mut cues = Vec::new();
    let mut ends = Duration::ZERO;
    for (table, content) in lesson.tables().enumerate() {
        let stands = if table == 0 {
            ends
        } else {
            let clears = ends + laying.keep;
            cues.push(Cue { at: clears, table, event: Event::Clear });
            clears + laying.empty.saturating_sub(laying.occluders_first)
        };
        let lies = stands + laying.occluders_first;
        cues.push(Cue { at: stands, table, event: Event::Occlude });
        cues.push(Cue { at: lies, table, event: Event::Lay });
        ends = lies;
        for (index, step) in content.script.iter().enumerate() {
            cues.push(Cue { at: lies + step.at, table, event: Event::Step(index) });
            ends = ends.max(lies + step.at + step.act.takes());
        }
    }
    (cues, ends)
}

//! Endurance test: a day of the same lesson, with new objects on the table each time.

use std::collections::BTreeMap;

use config::Names;
use message::{Event, EventKind};
use reports::lesson::LessonReport;
use testkit::bytes_retained_by;

use crate::cells::{Lines, Seen, TimeLines, tasks};
use crate::narrator::Narrator;
use crate::state_store::StateStore;

/// Number of lessons of 51 s in a day.
const LESSONS: u64 = 1700;
/// Lessons of the warm-up: every bounded collection is full afterwards.
const FULL: u64 = 200;
/// Allowed growth over the day in bytes: digits of numbers and capacity of collections.
const MORE: usize = 64 << 10;

/// All long-lived state of the console, without I/O.
struct Console {
    state_store: StateStore,
    narrator: Narrator,
    lines: Lines,
    report: LessonReport,
    histories: TimeLines,
}

impl Console {
    fn hear(&mut self, t: f64, event: &Event) {
        if let Some(line) = self.narrator.event(1, event) {
            self.lines.add(&mut self.state_store, t, &line);
        }
        self.report.add(event);
    }

    /// Plays one lesson: two demonstrations and a performance, with a dozen new objects.
    fn play(&mut self, lesson: u64) {
        let t = |step: u32| 51.0 * f64::from(u32::try_from(lesson).unwrap()) + f64::from(step);
        let event = |kind, text: &str| {
            let examples = u32::try_from(2 * lesson).unwrap();
            Event { examples, ..Event::new(kind, "task 1", text) }
        };
        for demonstration in 0..2 {
            self.hear(t(demonstration), &event(EventKind::TeachingStarted, "task 1"));
            self.hear(t(demonstration), &event(EventKind::Seen, "blue square, green square and 7 × peg"));
            for _ in 0..5 {
                self.hear(
                    t(demonstration),
                    &event(EventKind::MovementSeen, "the teacher: putting the peg down"),
                );
                self.hear(t(demonstration), &event(EventKind::ActionSeen, "the teacher: red square filled"));
            }
            self.hear(t(demonstration), &event(EventKind::DemonstrationEnded, "task 1"));
            for _ in 0..20 {
                self.hear(t(demonstration), &event(EventKind::Hypothesis, "all but blue"));
            }
            self.hear(t(demonstration), &event(EventKind::RuleChosen, "all"));
            self.hear(t(demonstration), &event(EventKind::Said, "I learned task 1: all"));
        }
        self.hear(t(2), &event(EventKind::PerformanceStarted, "task 1"));
        for _ in 0..5 {
            self.hear(t(2), &event(EventKind::StepStarted, "put a peg into the red square"));
            self.hear(t(2), &event(EventKind::StepDone, "red square filled"));
        }
        self.hear(t(2), &event(EventKind::PerformanceEnded, "filled 5 of 5"));
        tasks(&mut self.state_store, &self.report);
        for step in 0..2 {
            let things: Vec<Seen> =
                (0..12).map(|thing| seen(12 * lesson + thing, t(step), 0.5, true)).collect();
            for perspective in [0, 1] {
                self.histories
                    .note(t(step), perspective, &things, |id| things.iter().find(|seen| seen.id == id));
            }
            self.histories.show(&mut self.state_store, &things);
        }
    }
}

/// A red square of a test at `x` metres.
pub(crate) fn seen(id: u64, x: f64, filled: f64, is_seen: bool) -> Seen {
    Seen {
        id,
        words: "red square".to_owned(),
        position_m: Some([x, 0.5, 0.03]),
        colour_rgb: None,
        shape: None,
        states: BTreeMap::from([("filled".to_owned(), filled)]),
        is_seen,
    }
}

#[test]
fn memory_does_not_grow_over_a_day() {
    let mut console = Console {
        state_store: StateStore::default(),
        narrator: Narrator::new(&Names::default()),
        lines: Lines::default(),
        report: LessonReport::bounded(),
        histories: TimeLines::default(),
    };
    (0..FULL).for_each(|lesson| console.play(lesson));
    let shown = |console: &Console| console.state_store.since(0).unwrap().len();
    let first = shown(&console);
    let ((), kept) = bytes_retained_by(|| (FULL..LESSONS).for_each(|lesson| console.play(lesson)));
    // The difference wraps if more was freed than allocated.
    let kept = if kept > usize::MAX / 2 { 0 } else { kept };
    assert!(kept < MORE, "{kept} bytes more");
    let last = shown(&console);
    assert!(last < first + MORE, "a page is sent {first} bytes, and {last} after a day");
    assert_eq!(console.report.performances_ended(), usize::try_from(LESSONS).unwrap());
}

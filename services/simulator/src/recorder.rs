//! Records interactive demonstrations in the format of lessons.

use std::collections::BTreeMap;

use clock::{Duration, Instant};
use config::lesson::{self, Act, Lesson, Step, Table, is_order};

/// Consecutive small movements of one hand or head within this time are merged into one step.
pub(crate) const MERGE_TIME: Duration = Duration::from_millis(500);
/// Maximum number of acts remembered while a script plays.
const MAX_ASIDE_ACTS: usize = 1000;
/// Minimum duration of an act that has one.
const MIN_DURATION: Duration = Duration::from_millis(50);
/// Eyes that moved less than this have not moved, in metres.
const MIN_EYE_MOVE_M: f64 = 1e-3;

/// A person's position and the point looked at, in metres, and whether they are present.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PersonState {
    pub(crate) number: u16,
    pub(crate) is_present: bool,
    pub(crate) eyes_m: [f64; 3],
    pub(crate) looks_at_m: [f64; 3],
}

/// The recorded tables, in their order.
#[derive(Clone, Debug, Default)]
pub(crate) struct DemonstrationRecorder {
    pages: Vec<RecordedTable>,
    /// Whether the last one is being recorded.
    is_open: bool,
    /// The people when the table was laid, and interactive acts beside a script since then.
    laid: Vec<PersonState>,
    aside: Vec<(u16, Instant, Act)>,
}

#[derive(Clone, Debug)]
struct RecordedTable {
    table: Table,
    began: Instant,
    before: Vec<PersonState>,
    after: Vec<PersonState>,
    left: Instant,
}

impl DemonstrationRecorder {
    /// An empty recording, for a number of people.
    pub(crate) fn new(people: usize) -> Self {
        Self { laid: Vec::with_capacity(people), ..Self::default() }
    }

    /// Number of recorded steps.
    pub(crate) fn steps(&self) -> usize {
        self.pages.iter().map(|page| page.table.script.len()).sum()
    }

    /// Starts a table: its initial state, and the people at it.
    pub(crate) fn begin(&mut self, now: Instant, table: Table, people: Vec<PersonState>) {
        self.pages.push(RecordedTable {
            table,
            began: now,
            after: people.clone(),
            before: people,
            left: now,
        });
        self.is_open = true;
    }

    /// Notes that a script laid a table, with these people at it.
    pub(crate) fn lay(&mut self, people: impl Iterator<Item = PersonState>) {
        self.aside.clear();
        self.laid.clear();
        self.laid.extend(people);
    }

    /// Starts a table from a script that a person took over now; it begins when the table was laid.
    pub(crate) fn take_over(&mut self, laid_at: Instant, table: Table) {
        let people = std::mem::take(&mut self.laid);
        self.begin(laid_at, table, people);
        for (who, from, act) in std::mem::take(&mut self.aside) {
            self.note(who, from, act);
        }
    }

    /// Records an act that began at an instant, if a table is being recorded. It is merged with the person's previous
    /// act if it continues it.
    pub(crate) fn note(&mut self, who: u16, from: Instant, act: Act) {
        let Some(page) = self.pages.last_mut().filter(|_| self.is_open) else {
            if self.aside.len() < MAX_ASIDE_ACTS {
                self.aside.push((who, from, act));
            }
            return;
        };
        let at = from.since(page.began);
        let ends = at + act.takes();
        let script = &mut page.table.script;
        let before = script.iter_mut().rev().find(|step| step.who == who && is_same(&step.act, &act));
        if let Some(step) = before.filter(|step| at <= step.at + step.act.takes() + MERGE_TIME) {
            step.act = lasting(act, ends.saturating_sub(step.at));
            return;
        }
        page.insert(Step { at, who, act });
    }

    /// Records an act that began at an instant and continues no other one, if a table is being recorded.
    pub(crate) fn record_separate(&mut self, who: u16, from: Instant, act: Act) {
        match self.pages.last_mut().filter(|_| self.is_open) {
            Some(page) => page.insert(Step { at: from.since(page.began), who, act }),
            None => self.note(who, from, act),
        }
    }

    /// Ends the table, because it is cleared.
    pub(crate) fn close(&mut self, now: Instant, people: Vec<PersonState>) {
        if let Some(page) = self.pages.last_mut().filter(|_| self.is_open) {
            page.left = now;
            page.after = people;
        }
        self.is_open = false;
    }

    /// The recorded lesson; `None` if no sentence was said. Everything else is taken from the lesson `of`.
    pub(crate) fn lesson(&self, title: &str, now: Instant, of: &Lesson) -> Option<Lesson> {
        let first = self.pages.first()?;
        let last = self.pages.len() - 1;
        let mut keep = of.table_timing.keep;
        let mut tables = Vec::new();
        // A lesson begins with everyone present.
        let mut people: Vec<PersonState> =
            first.before.iter().map(|person| PersonState { is_present: true, ..*person }).collect();
        for (number, page) in self.pages.iter().enumerate() {
            let mut table = page.table.clone();
            table.script.splice(0..0, initial_moves(&people, &page.before));
            people.clone_from(&page.after);
            serialise_moves(&mut table.script);
            let ends = table.script.iter().map(|step| step.at + step.act.takes()).max().unwrap_or_default();
            let left = if number == last && self.is_open { now } else { page.left };
            keep = keep.max(left.since(page.began).saturating_sub(ends));
            tables.push(table);
        }
        let performs = |table: &Table| {
            table.script.iter().any(|step| matches!(&step.act, Act::Say(words) if is_order(words)))
        };
        let novel = if tables.last().is_some_and(performs) { tables.pop() } else { None };
        let teacher = |person: &PersonState| lesson::Teacher {
            number: person.number,
            eyes_m: person.eyes_m,
            looks_at_m: person.looks_at_m,
        };
        Some(Lesson {
            title: title.to_owned(),
            watch: "It was taught by hand.".to_owned(),
            teachers: first.before.iter().map(teacher).collect(),
            table_timing: lesson::TableTiming { keep, ..of.table_timing },
            demonstrations: tables,
            novel,
            ..of.clone()
        })
    }
}

impl RecordedTable {
    /// Inserts a step after those that begin no later.
    fn insert(&mut self, step: Step) {
        let script = &mut self.table.script;
        let index = script.iter().rposition(|before| before.at <= step.at).map_or(0, |last| last + 1);
        script.insert(index, step);
    }
}

/// Whether two acts can be merged: movements of the same occluder, or of the same eyes.
fn is_same(one: &Act, other: &Act) -> bool {
    match (one, other) {
        (Act::Slide { occluder, .. }, Act::Slide { occluder: other, .. }) => occluder == other,
        (Act::Look { .. }, Act::Look { .. }) | (Act::Walk { .. }, Act::Walk { .. }) => true,
        _ => false,
    }
}

fn lasting(mut act: Act, lasts: Duration) -> Act {
    match &mut act {
        Act::Move { takes, .. }
        | Act::Look { takes, .. }
        | Act::Walk { takes, .. }
        | Act::Slide { takes, .. } => {
            *takes = lasts;
        }
        Act::Say(_) | Act::Leave | Act::Return => {}
    }
    act
}

/// Steps for people who moved while the table was set up.
fn initial_moves(from: &[PersonState], to: &[PersonState]) -> Vec<Step> {
    let mut steps = Vec::new();
    for (from, to) in from.iter().zip(to) {
        let mut step = |act| steps.push(Step { at: Duration::ZERO, who: to.number, act });
        if !from.is_present && to.is_present {
            step(Act::Return);
        }
        if from.is_present || to.is_present {
            if has_moved(from.eyes_m, to.eyes_m) {
                step(Act::Walk { eyes_m: to.eyes_m, takes: MIN_DURATION });
            }
            if has_moved(from.looks_at_m, to.looks_at_m) {
                step(Act::Look { at_m: to.looks_at_m, takes: MIN_DURATION });
            }
        }
        if from.is_present && !to.is_present {
            step(Act::Leave);
        }
    }
    steps
}

pub(crate) fn has_moved(from_m: [f64; 3], to_m: [f64; 3]) -> bool {
    from_m.iter().zip(to_m).any(|(from, to)| (from - to).abs() > MIN_EYE_MOVE_M)
}

/// Delays steps so that no hand moves two things at once. If a hand took the next thing while the last one still slid
/// to rest, the step begins when the last one ends. Later steps of the same person keep their order.
fn serialise_moves(script: &mut [Step]) {
    // By person: until when the hands are busy, and when the last step began.
    let mut timelines: BTreeMap<u16, (Duration, Duration)> = BTreeMap::new();
    for step in script.iter_mut() {
        let ends = step.at + step.act.takes();
        let (busy_until, last) = timelines.entry(step.who).or_default();
        step.at = step.at.max(*last);
        if let Act::Move { takes, .. } | Act::Slide { takes, .. } = &mut step.act {
            step.at = step.at.max(*busy_until);
            *takes = ends.saturating_sub(step.at).max(MIN_DURATION);
            *busy_until = step.at + *takes;
        }
        *last = step.at;
    }
    script.sort_by_key(|step| step.at);
}

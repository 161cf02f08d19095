use std::collections::BTreeMap;

use clock::Instant;
use message::{Belief, Event, EventKind, NOBODY};
use motion::{Handled, Mirror};
use tasks::{
    Action, ActionParser, Example, Language, NothingChangedError, Object, Recording, Snapshot, Telling,
    describe_object, vanished,
};

use crate::{Vocabulary, report};

/// A demonstration in progress, with the detectors for movements and actions.
#[derive(Clone, Debug)]
pub(crate) struct Teaching {
    pub(crate) recording: Recording,
    /// What the teacher said about the rule meanwhile.
    pub(crate) told: Vec<Telling>,
    /// A task that Leo performed, at least in part, during the demonstration and that is not recorded yet.
    pub(crate) performed: Option<String>,
    mirror: Mirror,
    parser: ActionParser,
}

impl Teaching {
    pub(crate) fn new(task: &str, teacher: u16, snapshots: &BTreeMap<u16, Snapshot>) -> Self {
        let recording = Recording::new(task, teacher, snapshots);
        Self {
            recording,
            told: Vec::new(),
            performed: None,
            mirror: Mirror::default(),
            parser: ActionParser::default(),
        }
    }

    /// What is said of the sentences about the rule if the demonstration does not count.
    pub(crate) const fn and_what_was_said(&self) -> &'static str {
        if self.told.is_empty() { "" } else { ", nor does what you said about it" }
    }

    /// Resets the detectors after a restart of the belief process: identities changed and movements were missed.
    pub(crate) fn break_off(&mut self) {
        self.mirror = Mirror::default();
        self.parser.reset();
    }

    /// Detects a goal-directed movement like Leo's own; returns the event before the movement is complete.
    pub(crate) fn mirror(&mut self, vocabulary: &Vocabulary, own: &Snapshot) -> Option<Event> {
        let things = own.objects.iter().filter_map(|object| {
            let held_by = object.held_by.unwrap_or(NOBODY);
            Some(Handled { id: object.id, centre: object.position()?, held_by })
        });
        let movement = self.mirror.step(things)?;
        let text = report::movement(vocabulary, &movement, own)?;
        Some(Event::new(EventKind::MovementSeen, &self.recording.task, &text))
    }

    /// Detects an action that has just been completed.
    pub(crate) fn parse(&mut self, now: Instant, language: &Language, own: &[Belief]) -> Option<Action> {
        self.parser.step(now, language, own)
    }

    /// Records an action; returns the event.
    pub(crate) fn record(
        &mut self,
        vocabulary: &Vocabulary,
        actor: u16,
        snapshots: &BTreeMap<u16, Snapshot>,
    ) -> Option<Event> {
        self.append(vocabulary, actor, None, snapshots)
    }

    /// Records the task that Leo performed as a single act; returns the event.
    pub(crate) fn record_performed(
        &mut self,
        vocabulary: &Vocabulary,
        snapshots: &BTreeMap<u16, Snapshot>,
    ) -> Option<Event> {
        let task = self.performed.take()?;
        self.append(vocabulary, 0, Some(&task), snapshots)
    }

    fn append(
        &mut self,
        vocabulary: &Vocabulary,
        actor: u16,
        task: Option<&str>,
        snapshots: &BTreeMap<u16, Snapshot>,
    ) -> Option<Event> {
        let action = self.recording.action(actor, task, snapshots, vocabulary.language.moved_m)?;
        let own = snapshots.get(&0).filter(|_| !action.changes.is_empty())?;
        let text = report::action(vocabulary, &action, own);
        Some(Event::new(EventKind::ActionSeen, &self.recording.task, &text))
    }

    /// Names of the objects that the robot saw at the beginning of the demonstration and does not see any more.
    pub(crate) fn vanished(&self, language: &Language, snapshots: &BTreeMap<u16, Snapshot>) -> Vec<String> {
        let Some((at_start, now)) = self.recording.at_start(0).zip(snapshots.get(&0)) else {
            return Vec::new();
        };
        let named = |object: &Object| describe_object(language, object, report::same_kind(at_start, object));
        vanished(at_start, now).into_iter().map(|object| format!("the {}", named(object))).collect()
    }

    /// Ends the demonstration; an action in progress ends with it.
    pub(crate) fn finish(
        mut self,
        vocabulary: &Vocabulary,
        snapshots: &BTreeMap<u16, Snapshot>,
    ) -> (Option<Event>, Result<Example, NothingChangedError>) {
        let performed = self.record_performed(vocabulary, snapshots);
        let last = performed.or_else(|| self.record(vocabulary, NOBODY, snapshots));
        (last, self.recording.finish(snapshots, vocabulary.language.moved_m))
    }
}

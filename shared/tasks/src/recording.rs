use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::{Change, Course, Deed, Effect, Object, Signature, Snapshot, changes, deeds};

/// A task as taught so far: S, whose hypotheses are computed from its examples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Its name, as first said.
    pub name: String,
    /// Its finished demonstrations, in the order of teaching.
    pub examples: Vec<Example>,
}

impl Task {
    /// What one perspective has of the examples.
    pub fn views(&self, perspective: u16) -> impl Iterator<Item = &View> {
        self.examples.iter().filter_map(move |example| example.view(perspective))
    }

    /// The things that were only asked about, as the answers left them.
    pub fn answers(&self) -> impl Iterator<Item = &Object> {
        self.views(0).filter_map(View::answer)
    }

    /// The teachers' examples: each as its own teacher saw it, see [`Example::taught`].
    pub fn taught<'a>(&'a self, simulated: &'a [u16]) -> impl Iterator<Item = &'a View> {
        self.examples.iter().filter_map(move |example| example.taught(simulated))
    }
}

/// What a schema keeps of one demonstration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Example {
    /// Who taught it: partner 1, 2, …
    pub teacher: u16,
    /// The demonstration as every perspective saw it.
    pub views: Vec<View>,
}

impl Example {
    /// The demonstration as one perspective saw it.
    #[must_use]
    pub fn view(&self, perspective: u16) -> Option<&View> {
        self.views.iter().find(|view| view.perspective == perspective)
    }

    /// The demonstration as he saw it who gave it, where he is among those who are simulated, and as the
    /// robot did where he is not: what another teacher could see says nothing of what this one meant.
    #[must_use]
    pub fn taught(&self, simulated: &[u16]) -> Option<&View> {
        let his = self.view(self.teacher).filter(|view| simulated.contains(&view.perspective));
        his.or_else(|| self.view(0))
    }
}

/// A demonstration as one perspective saw it: [(E1 … Ex), G, 1] with G between the snapshots.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Whose perspective: 0 the robot's, n partner n's.
    pub perspective: u16,
    /// Snp(t0, P).
    pub before: Snapshot,
    /// Snp(t_end, P).
    pub after: Snapshot,
    /// What was done in between, the same acts in every perspective.
    #[serde(default)]
    pub executables: Vec<Executable>,
}

impl View {
    /// The thing that was only asked about, as the answer left it: it is alone in its example, and nowhere.
    /// `None` of what was shown.
    #[must_use]
    pub fn answer(&self) -> Option<&Object> {
        match self.after.objects.as_slice() {
            [only] => Some(only).filter(|only| only.position_m.is_none()),
            _ => None,
        }
    }

    /// What of it concerns him whose perspective it is (the resource perspective): what belongs to
    /// him, and what is everybody's.
    ///
    /// What he leaves alone because it is somebody else's says nothing about what he means. Whoever
    /// works on what is not his does not go by whose things are, and then nothing is left out.
    /// Worked on is what changed its state, or where nothing did, what was moved by more than
    /// `moved_m` metres. The robot itself looks at everything: it is not the one who acts.
    #[must_use]
    pub fn attended(&self, moved_m: f64) -> Self {
        // Whose a thing was when the demonstration began; what came later, as it was in the end.
        let owner = |object: &Object| self.before.object(object.id).unwrap_or(object).owner;
        let attends = |object: &Object| owner(object).is_none_or(|owner| owner == self.perspective);
        let changes = changes(&self.before, &self.after, moved_m);
        let moved = Signature::from([Effect::Moved]);
        let any_state = changes.values().any(|change| change.signature != moved);
        let is_worked_on = |object: &Object| {
            let change = changes.get(&object.id);
            change.is_some_and(|change| !any_state || change.signature != moved)
        };
        let goes_by_owners = || self.after.objects.iter().filter(|object| is_worked_on(object)).all(&attends);
        if self.perspective == 0 || !goes_by_owners() {
            return self.clone();
        }
        Self { before: self.before.filtered(attends), after: self.after.filtered(attends), ..self.clone() }
    }
}

/// An executable of a schema: a primitive act, or another task (E = a | S), and its goal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Executable {
    /// Who did it: 0 the robot, partner 1, 2, …, or `message::NOBODY`.
    pub actor: u16,
    /// The task that was performed, where it was one.
    #[serde(default)]
    pub task: Option<String>,
    /// What it changed in this perspective, by the identity of the object.
    pub changes: BTreeMap<u64, Change>,
    /// What it did with an object in respect of others (placed on, handed), by the identity of the
    /// object.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub deeds: BTreeMap<u64, BTreeSet<Deed>>,
}

/// A demonstration in which no perspective believes that anything changed is no example.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("nothing changed from the beginning of the demonstration to its end: show it again")]
pub struct NothingChanged;

/// A demonstration under way.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The task's name, as said.
    pub task: String,
    /// Who teaches it.
    pub teacher: u16,
    views: Vec<ViewUnderWay>,
}

#[derive(Clone, Debug)]
struct ViewUnderWay {
    view: View,
    /// Snp(t_a, P): at the end of the last act.
    last: Snapshot,
}

impl Recording {
    /// A demonstration that begins with Snp(t0, P) of every perspective.
    #[must_use]
    pub fn new(task: &str, teacher: u16, snapshots: &BTreeMap<u16, Snapshot>) -> Self {
        let views = snapshots
            .iter()
            .map(|(&perspective, snapshot)| ViewUnderWay {
                view: View {
                    perspective,
                    before: snapshot.clone(),
                    after: snapshot.clone(),
                    executables: Vec::new(),
                },
                last: snapshot.clone(),
            })
            .collect();
        Self { task: task.to_owned(), teacher, views }
    }

    /// What a perspective believed at the end of the last act, Snp(t_a, P).
    #[must_use]
    pub fn last(&self, perspective: u16) -> Option<&Snapshot> {
        self.views.iter().find(|under| under.view.perspective == perspective).map(|under| &under.last)
    }

    /// What a perspective believed when the demonstration began, Snp(t0, P).
    #[must_use]
    pub fn began(&self, perspective: u16) -> Option<&Snapshot> {
        self.views.iter().find(|under| under.view.perspective == perspective).map(|under| &under.view.before)
    }

    /// Appends [act, G] to the executables of every perspective, with G the changes from
    /// Snp(t_a, P) to Snp(t_b, P). An act that changed nothing in any perspective is none.
    /// Gives the act as the robot's own perspective has it.
    pub fn act(
        &mut self,
        actor: u16,
        task: Option<&str>,
        snapshots: &BTreeMap<u16, Snapshot>,
        moved_m: f64,
    ) -> Option<Executable> {
        let executable = |under: &ViewUnderWay| {
            let now = snapshots.get(&under.view.perspective);
            let changes = now.map(|now| changes(&under.last, now, moved_m)).unwrap_or_default();
            let course = |after| Course { began: &under.view.before, before: &under.last, after };
            let deeds = now.map(|now| deeds(actor, &course(now), &changes, moved_m)).unwrap_or_default();
            Executable { actor, task: task.map(str::to_owned), changes, deeds }
        };
        let executables: Vec<Executable> = self.views.iter().map(executable).collect();
        if executables.iter().all(|executable| executable.changes.is_empty()) {
            return None;
        }
        let mut own = None;
        for (under, executable) in self.views.iter_mut().zip(executables) {
            if under.view.perspective == 0 {
                own = Some(executable.clone());
            }
            under.view.executables.push(executable);
            if let Some(now) = snapshots.get(&under.view.perspective) {
                under.last = now.clone();
            }
        }
        own
    }

    /// The example that ends with Snp(t_end, P) of every perspective.
    ///
    /// # Errors
    /// [`NothingChanged`] when no perspective believes that anything changed.
    pub fn finish(
        &self,
        snapshots: &BTreeMap<u16, Snapshot>,
        moved_m: f64,
    ) -> Result<Example, NothingChanged> {
        let mut changed = false;
        let mut views = Vec::new();
        for under in &self.views {
            let mut view = under.view.clone();
            if let Some(after) = snapshots.get(&view.perspective) {
                view.after = after.clone();
            }
            changed |= !changes(&view.before, &view.after, moved_m).is_empty();
            views.push(view);
        }
        if changed { Ok(Example { teacher: self.teacher, views }) } else { Err(NothingChanged) }
    }
}

//! A learned goal: which objects shall be in which state.

use std::collections::BTreeSet;

use crate::demonstration::{Object, Signature, Snapshot, has_percepts, is_achieved};
use crate::hypotheses::{Class, Extent, Place, Selection, Template, frame_of};

/// Score and rank of a rule or a spatial configuration among all candidates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standing {
    /// Number of examples that it is consistent with.
    pub tally: usize,
    /// Number of examples seen.
    pub examples: usize,
    /// Posterior probability, summed over all equivalent hypotheses.
    pub posterior: f64,
    /// Rank, counted from 1; ties share a rank.
    pub rank: usize,
    /// Whether its tally is the highest and its posterior is at least the configured share of the best one.
    pub high_likelihood: bool,
}

/// A learned goal: all objects of these classes shall be in the state of the expectation.
///
/// A rule stands for all hypotheses that agree on every object made of the feature values seen. Its template has
/// no redundant feature.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// The expected state of the objects.
    pub expectation: Signature,
    /// The class features that it tests.
    pub template: Template,
    /// The classes: a simple disjunction.
    pub classes: BTreeSet<Class>,
    /// Which objects of the classes: all, a number of them, or those with a spatial relation.
    pub selection: Selection,
    /// Its score and rank among the rules about the same goal.
    pub standing: Standing,
    /// Its name, generated from its classes and the other classes seen.
    pub name: String,
}

impl Rule {
    /// Whether an object is a candidate for the rule: it has one of the classes and the percepts of the
    /// expectation. The selection is not evaluated.
    #[must_use]
    pub fn is_about(&self, object: &Object) -> bool {
        has_percepts(object, &self.expectation) && belongs(object, &self.template, &self.classes)
    }

    /// Whether an object is in the expected state. A movement counts as done, because one snapshot cannot show it.
    #[must_use]
    pub fn is_done(&self, object: &Object) -> bool {
        is_achieved(object, &self.expectation, true)
    }

    /// The objects that the rule applies to and that are not yet in the expected state. The goal is achieved when
    /// there are none ("all objects with the criteria features must match the expectation features").
    ///
    /// A rule about a number of objects yields as many as are still missing, in the order of their identities. An
    /// excluded object is skipped and another one takes its place. Spatial relations are evaluated in the frame of
    /// the snapshot's perspective.
    pub fn open<'a>(
        &'a self,
        snapshot: &'a Snapshot,
        is_excluded: impl Fn(&Object) -> bool + 'a,
    ) -> impl Iterator<Item = &'a Object> {
        let members = self.members(snapshot);
        let done = members.iter().filter(|object| self.is_done(object)).count();
        let wanted = match self.selection {
            Selection::All | Selection::Relation(_) => usize::MAX,
            // If there are too few objects for the number, all of them are wanted.
            Selection::Exactly(count) => count.saturating_sub(done),
            Selection::AllBut(count) => members.len().saturating_sub(count + done),
        };
        members.into_iter().filter(move |object| !self.is_done(object) && !is_excluded(object)).take(wanted)
    }

    /// The objects of a scene that the rule applies to; for a rule about a number of objects, all candidates.
    #[must_use]
    pub fn members<'a>(&self, snapshot: &'a Snapshot) -> Vec<&'a Object> {
        let mut members: Vec<&Object> =
            snapshot.objects.iter().filter(|object| self.is_about(object)).collect();
        if let Selection::Relation(relation) = self.selection {
            let frame = frame_of(snapshot);
            let places: Vec<Option<Place>> = members.iter().map(|object| Place::of(&frame, object)).collect();
            let extent = Extent::of(places.iter().copied().flatten());
            let mut places = places.into_iter();
            members.retain(|_| places.next().flatten().is_some_and(|place| relation.holds(place, &extent)));
        }
        members
    }

    /// Whether a scene has too few objects for the rule: no candidate, or fewer than its number demands. Such a
    /// task would finish at once, or earlier than the teacher meant.
    #[must_use]
    pub fn lacks_objects(&self, snapshot: &Snapshot) -> bool {
        let members = self.members(snapshot).len();
        match self.selection {
            Selection::All | Selection::Relation(_) => members == 0,
            Selection::Exactly(_) | Selection::AllBut(_) => self.selection.wanted(members).is_none(),
        }
    }

    /// Whether two rules have the same meaning; name and score are ignored.
    #[must_use]
    pub fn agrees_with(&self, other: &Self) -> bool {
        self.expectation == other.expectation
            && self.template == other.template
            && self.classes == other.classes
            && self.selection == other.selection
    }
}

/// The class of an object under a template; `None` if it lacks a feature.
fn class_of(object: &Object, template: &Template) -> Option<Class> {
    template.iter().map(|feature| object.features.get(feature).cloned()).collect()
}

/// Whether an object belongs to one of the classes.
fn belongs(object: &Object, template: &Template, classes: &BTreeSet<Class>) -> bool {
    class_of(object, template).is_some_and(|class| classes.contains(&class))
}

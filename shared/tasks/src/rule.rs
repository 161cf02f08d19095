use std::collections::BTreeSet;

use crate::change::{has_percepts, is_achieved};
use crate::hypothesis::belongs;
use crate::selection::{Extent, Place, frame_of};
use crate::{Class, Object, Selection, Signature, Snapshot, Standing, Template};

/// What Leo takes a teacher to have meant: all objects of these classes shall be as the
/// expectation says.
///
/// A rule stands for all the hypotheses that say the same of every object made of the feature
/// values seen: its template has no feature that could be dropped.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// What is expected of the objects.
    pub expectation: Signature,
    /// The class features that it looks at.
    pub template: Template,
    /// The classes, a simple disjunction.
    pub classes: BTreeSet<Class>,
    /// Which objects of the classes: all of them, or a number, or those that stand somewhere.
    pub selection: Selection,
    /// How it stands among the rules about the same goal.
    pub standing: Standing,
    /// What people would call it, computed from its classes and what else was seen.
    pub name: String,
}

impl Rule {
    /// Whether it is about an object, or about it and others of which it selects some: the object
    /// is of one of the classes and has what the expectation is about.
    #[must_use]
    pub fn is_about(&self, object: &Object) -> bool {
        has_percepts(object, &self.expectation) && belongs(object, &self.template, &self.classes)
    }

    /// Whether an object is as the rule wants it. Movements count as done: whether a thing has
    /// moved cannot be seen in one snapshot.
    #[must_use]
    pub fn is_done(&self, object: &Object) -> bool {
        is_achieved(object, &self.expectation, true)
    }

    /// The objects that the rule is about and that are not yet as it wants them. The goal is
    /// achieved when there are none ("all objects with the criteria features must match the
    /// expectation features").
    ///
    /// Of a rule about a number of objects, as many as are still wanted, in the order of their
    /// identities: any will do. What is excluded is not among them, and another one takes its place.
    /// Where they stand is as the snapshot's perspective sees it.
    pub fn open<'a>(
        &'a self,
        snapshot: &'a Snapshot,
        is_excluded: impl Fn(&Object) -> bool + 'a,
    ) -> impl Iterator<Item = &'a Object> {
        let members = self.members(snapshot);
        let done = members.iter().filter(|object| self.is_done(object)).count();
        let wanted = match self.selection {
            Selection::All | Selection::Standing(_) => usize::MAX,
            // Too few for what was said: all of them.
            Selection::Exactly(count) => count.saturating_sub(done),
            Selection::AllBut(count) => members.len().saturating_sub(count + done),
        };
        members.into_iter().filter(move |object| !self.is_done(object) && !is_excluded(object)).take(wanted)
    }

    /// The objects of a scene that the rule is about; of a rule about a number of objects, all
    /// those of which it wants some.
    #[must_use]
    pub fn members<'a>(&self, snapshot: &'a Snapshot) -> Vec<&'a Object> {
        let mut members: Vec<&Object> =
            snapshot.objects.iter().filter(|object| self.is_about(object)).collect();
        if let Selection::Standing(relation) = self.selection {
            let frame = frame_of(snapshot);
            let places: Vec<Option<Place>> = members.iter().map(|object| Place::of(&frame, object)).collect();
            let extent = Extent::of(places.iter().copied().flatten());
            let mut places = places.into_iter();
            members.retain(|_| places.next().flatten().is_some_and(|place| relation.holds(place, &extent)));
        }
        members
    }

    /// Whether a scene has too few objects for what the rule says: none that it is about, or not the
    /// number of which it speaks. Then nothing is left to do sooner than somebody meant, or at once.
    #[must_use]
    pub fn lacks_objects(&self, snapshot: &Snapshot) -> bool {
        let members = self.members(snapshot).len();
        match self.selection {
            Selection::All | Selection::Standing(_) => members == 0,
            Selection::Exactly(_) | Selection::AllBut(_) => self.selection.wanted(members).is_none(),
        }
    }

    /// Whether two rules say the same.
    #[must_use]
    pub fn agrees_with(&self, other: &Self) -> bool {
        self.expectation == other.expectation
            && self.template == other.template
            && self.classes == other.classes
            && self.selection == other.selection
    }
}

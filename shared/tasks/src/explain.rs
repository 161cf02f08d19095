use std::collections::BTreeMap;

use crate::change::{changes, has_percepts};
use crate::counterpart::counterparts;
use crate::describe::{describe_object, listed};
use crate::hypothesis::Evidence;
use crate::{Language, Object, Rule, Selection, Task, View};

/// Why its teachers' rule does not hold in the robot's view, in words that name the objects. A partner
/// is he who gave the example.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Explanation {
    /// Objects that contradict it and that the partner knows nothing of.
    pub unseen: Vec<String>,
    /// Objects that contradict it and that the partner believes to be as the rule wants them.
    pub mistaken: Vec<String>,
    /// Objects that contradict it and that belong to somebody else, as the partner sees it.
    pub foreign: Vec<String>,
    /// Objects that contradict it although the partner knows them as they are.
    pub unexplained: Vec<String>,
    /// The class features of those, each kind once.
    pub unexplained_kinds: Vec<BTreeMap<String, String>>,
    /// Whether some of it is about the showing of another than the one who taught last, to whom it is
    /// said.
    pub of_others: bool,
}

impl Explanation {
    /// Whether every contradiction is explained by what the partner could not know, and there is
    /// one.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let explained = [&self.unseen, &self.mistaken, &self.foreign];
        self.unexplained.is_empty() && explained.iter().any(|objects| !objects.is_empty())
    }

    /// The explanation, said to the one who taught last; empty when nothing contradicts the rule.
    #[must_use]
    pub fn text(&self) -> String {
        let the = |objects: &[String]| {
            let objects: Vec<String> = objects.iter().map(|object| format!("the {object}")).collect();
            listed(&objects)
        };
        let (who, whose) = if self.of_others { ("whoever showed it", "theirs") } else { ("you", "yours") };
        let mut parts = Vec::new();
        if !self.unseen.is_empty() {
            parts.push(format!("{who} could not see {}", the(&self.unseen)));
        }
        if !self.mistaken.is_empty() {
            parts.push(format!("{who} could not know how {} had changed", the(&self.mistaken)));
        }
        if !self.foreign.is_empty() {
            let is = if self.foreign.len() == 1 { "is" } else { "are" };
            parts.push(format!("{} {is} not {whose}", the(&self.foreign)));
        }
        if !self.unexplained.is_empty() {
            parts.push(format!("I do not know why {who} treated {} differently", the(&self.unexplained)));
        }
        listed(&parts)
    }
}

/// Explains why a rule learned from its teachers' views does not hold in the robot's: which objects of
/// the robot's view contradict it, and what he believed of them who gave the example
/// ([`Example::taught`](crate::Example::taught)).
#[must_use]
pub fn explain(language: &Language, task: &Task, simulated: &[u16], rule: &Rule) -> Explanation {
    let mut explanation = Explanation::default();
    let is_number = matches!(rule.selection, Selection::Exactly(_) | Selection::AllBut(_));
    let addressed = task.examples.last().map(|example| example.teacher);
    for example in &task.examples {
        let (Some(own), Some(theirs)) = (example.view(0), example.taught(simulated)) else { continue };
        let against = contradicting(language, own, rule);
        if against.is_empty() {
            continue;
        }
        let known = counterparts(&own.after, &theirs.after);
        for object in against {
            let eligible = own.after.objects.iter().filter(|other| has_percepts(other, &rule.expectation));
            let name = describe_object(language, object, eligible);
            let list = match known.get(&object.id) {
                None => &mut explanation.unseen,
                Some(believed) if believed.owner.is_some_and(|owner| owner != example.teacher) => {
                    &mut explanation.foreign
                }
                Some(believed) if believed.states != object.states => &mut explanation.mistaken,
                // Which of a number are left, is left to him.
                Some(_) if is_number && rule.is_about(object) => continue,
                Some(_) => {
                    if !explanation.unexplained_kinds.contains(&object.features) {
                        explanation.unexplained_kinds.push(object.features.clone());
                    }
                    &mut explanation.unexplained
                }
            };
            if !list.contains(&name) {
                list.push(name);
            }
            explanation.of_others |= Some(example.teacher) != addressed;
        }
    }
    explanation
}

/// The objects of a view that a rule is wrong about: those that it is about and that did not
/// become as it wants, and those that changed as it says although it is not about them.
fn contradicting<'a>(language: &Language, view: &'a View, rule: &Rule) -> Vec<&'a Object> {
    let evidence =
        Evidence { after: &view.after, changes: changes(&view.before, &view.after, language.moved_m) };
    let undone = evidence
        .eligible(&rule.expectation)
        .filter(|object| rule.is_about(object) && !evidence.achieved(object, &rule.expectation));
    let unexpected = evidence.changed(&rule.expectation).filter(|object| !rule.is_about(object));
    undone.chain(unexpected).collect()
}

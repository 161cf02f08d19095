//! Why a rule of the teachers does not hold in the view of the robot.

use std::collections::BTreeMap;

use super::rule::Rule;
use crate::demonstration::{
    Object, Task, View, changes, counterparts, describe_object, has_percepts, is_achieved,
};
use crate::hypotheses::Selection;
use crate::language::{Language, listed};

/// Why the teachers' rule does not hold in the robot's view, with the names of the objects. Below, the partner is
/// the teacher of the example.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Explanation {
    /// Contradicting objects that the partner does not know.
    pub unseen: Vec<String>,
    /// Contradicting objects that the partner believes to be in another state.
    pub mistaken: Vec<String>,
    /// Contradicting objects that have another owner than the partner, in the partner's perspective.
    pub foreign: Vec<String>,
    /// Contradicting objects that the partner knows correctly.
    pub unexplained: Vec<String>,
    /// The distinct class features of the unexplained objects.
    pub unexplained_kinds: Vec<BTreeMap<String, String>>,
    /// Whether any contradiction is in an example of another teacher than the last one, who is addressed.
    pub of_others: bool,
}

impl Explanation {
    /// Whether there is a contradiction and every one is explained by what the partner could not know.
    #[cfg(test)]
    pub(crate) fn is_complete(&self) -> bool {
        let explained = [&self.unseen, &self.mistaken, &self.foreign];
        self.unexplained.is_empty() && explained.iter().any(|objects| !objects.is_empty())
    }

    /// The explanation, addressed to the last teacher; empty if nothing contradicts the rule.
    #[must_use]
    pub fn text(&self) -> String {
        let the = |objects: &[String]| {
            let objects: Vec<String> = objects.iter().map(|object| format!("the {object}")).collect();
            listed(&objects)
        };
        let (who, whose) =
            if self.of_others { ("the teacher who showed it", "theirs") } else { ("you", "yours") };
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

/// Explains why a rule learned from the teachers' views does not hold in the robot's view: which objects
/// contradict it, and what the teacher of each example believed about them
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
                // For a rule about a number, the teacher is free to choose which objects are left out.
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

/// The objects of a view that contradict a rule. Either the rule applies but the expected state was not reached, or
/// the object changed as expected although the rule does not apply.
fn contradicting<'a>(language: &Language, view: &'a View, rule: &Rule) -> Vec<&'a Object> {
    let goal = &rule.expectation;
    let changes = changes(&view.before, &view.after, language.moved_m);
    let eligible = || view.after.objects.iter().filter(|object| has_percepts(object, goal));
    let is_undone = |object: &&Object| {
        let moved = changes.get(&object.id).is_some_and(|change| change.displaced);
        rule.is_about(object) && !is_achieved(object, goal, moved)
    };
    let is_unexpected = |object: &&Object| {
        let change = changes.get(&object.id);
        !rule.is_about(object) && change.is_some_and(|change| change.signature == *goal)
    };
    eligible().filter(is_undone).chain(eligible().filter(is_unexpected)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_explanations_matches_the_snapshot() {
        let objects = |count: usize| -> Vec<String> {
            ["blue square", "red peg"].iter().take(count).map(|name| (*name).to_owned()).collect()
        };
        let one = |part: fn(&mut Explanation) -> &mut Vec<String>| {
            [(1, false), (2, false), (1, true)].map(|(count, of_others)| {
                let mut explanation = Explanation { of_others, ..Explanation::default() };
                *part(&mut explanation) = objects(count);
                explanation.text()
            })
        };
        let texts = [
            one(|explanation| &mut explanation.unseen),
            one(|explanation| &mut explanation.mistaken),
            one(|explanation| &mut explanation.foreign),
            one(|explanation| &mut explanation.unexplained),
        ];
        let several = Explanation { unseen: objects(1), foreign: objects(2), ..Explanation::default() };
        insta::assert_snapshot!(format!("{}\n{}", texts.concat().join("\n"), several.text()));
    }
}

use std::collections::{BTreeMap, BTreeSet};

use crate::change::{has_percepts, is_achieved};
use crate::{Change, Object, Signature, Snapshot};

/// The class features that a hypothesis looks at, T ⊆ F, in alphabetical order.
pub type Template = Vec<String>;

/// A class of objects: their values of the features of a template, in the template's order.
pub type Class = Vec<String>;

/// The prior over hypotheses: log P(h) = -λ (K - 1) + μ (|T| + |E|), with K classes, |T|
/// criteria and |E| expectation features per class.
///
/// "Hypotheses whose goal states apply to the broadest object classes with the most specific
/// class descriptions are preferred (determined by number of classes and criteria/expectation
/// features, respectively)": the fewest classes first, then the most features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// λ: what one class more costs.
    pub lambda: f64,
    /// μ: what one feature more is worth.
    pub mu: f64,
}

impl Default for Prior {
    fn default() -> Self {
        Self { lambda: 4.0, mu: 0.5 }
    }
}

impl Prior {
    fn log(&self, classes: usize, features: usize) -> f64 {
        let more = quantity::number::float_of_count(classes.saturating_sub(1));
        self.mu.mul_add(quantity::number::float_of_count(features), -self.lambda * more)
    }
}

/// A demonstration as hypotheses about one signature are tested on it.
#[derive(Clone, Debug)]
pub(crate) struct Evidence<'a> {
    pub(crate) after: &'a Snapshot,
    pub(crate) changes: BTreeMap<u64, Change>,
}

impl<'a> Evidence<'a> {
    /// The objects at the end that a goal with this signature could be about.
    pub(crate) fn eligible(&self, signature: &Signature) -> impl Iterator<Item = &'a Object> {
        self.after.objects.iter().filter(move |object| has_percepts(object, signature))
    }

    /// The objects whose change has exactly this signature.
    pub(crate) fn changed(&self, signature: &Signature) -> impl Iterator<Item = &'a Object> {
        self.eligible(signature).filter(move |object| {
            self.changes.get(&object.id).is_some_and(|change| change.signature == *signature)
        })
    }

    /// Whether an object is at the end as the signature expects.
    pub(crate) fn achieved(&self, object: &Object, signature: &Signature) -> bool {
        let moved = self.changes.get(&object.id).is_some_and(|change| change.displaced);
        is_achieved(object, signature, moved)
    }
}

/// A goal hypothesis: all objects of these classes shall be as the signature expects.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hypothesis {
    pub(crate) template: Template,
    pub(crate) classes: BTreeSet<Class>,
    pub(crate) tally: usize,
    pub(crate) log_prior: f64,
}

impl Hypothesis {
    /// log P(D|h) P(h), with P(D|h) the share of the examples that it is consistent with.
    pub(crate) fn log_score(&self, examples: usize) -> f64 {
        let share = quantity::number::float_of_count(self.tally) / quantity::number::float_of_count(examples);
        share.ln() + self.log_prior
    }
}

/// The class of an object under a template; `None` where it lacks a feature.
pub(crate) fn class_of(object: &Object, template: &Template) -> Option<Class> {
    template.iter().map(|feature| object.features.get(feature).cloned()).collect()
}

/// Whether an object belongs to one of the classes.
pub(crate) fn belongs(object: &Object, template: &Template, classes: &BTreeSet<Class>) -> bool {
    class_of(object, template).is_some_and(|class| classes.contains(&class))
}

/// Expands the hypotheses about one signature: for every template T ⊆ F the classes of the
/// changed objects, of each demonstration by itself and joined over all of them.
///
/// Every hypothesis of the language (a template and a simple disjunction of classes of changed
/// objects) that is consistent with every demonstration is among them: it must cover all that
/// changed, and may cover nothing else.
pub(crate) fn expand(
    features: &[String],
    signature: &Signature,
    evidence: &[Evidence<'_>],
    prior: &Prior,
) -> Vec<Hypothesis> {
    let mut hypotheses = Vec::new();
    for template in templates(features) {
        let mut disjunctions: BTreeSet<BTreeSet<Class>> = BTreeSet::new();
        let mut joined = BTreeSet::new();
        for demonstration in evidence {
            let classes: BTreeSet<Class> =
                demonstration.changed(signature).filter_map(|object| class_of(object, &template)).collect();
            joined.extend(classes.iter().cloned());
            disjunctions.insert(classes);
        }
        disjunctions.insert(joined);
        for classes in disjunctions.into_iter().filter(|classes| !classes.is_empty()) {
            let consistent = |one: &&Evidence<'_>| is_consistent(&template, &classes, signature, one);
            hypotheses.push(Hypothesis {
                tally: evidence.iter().filter(consistent).count(),
                log_prior: prior.log(classes.len(), template.len() + signature.len()),
                template: template.clone(),
                classes,
            });
        }
    }
    hypotheses
}

/// Whether a demonstration is consistent with a goal: at its end the goal holds for all objects
/// of the classes, and every change with this signature happened to one of them.
///
/// The paper asks that "the state change seen in the example is consistent with the goal
/// representation"; without the second half a rule about fewer objects would always do.
pub(crate) fn is_consistent(
    template: &Template,
    classes: &BTreeSet<Class>,
    signature: &Signature,
    evidence: &Evidence<'_>,
) -> bool {
    let holds = evidence
        .eligible(signature)
        .filter(|object| belongs(object, template, classes))
        .all(|object| evidence.achieved(object, signature));
    holds && evidence.changed(signature).all(|object| belongs(object, template, classes))
}

/// All subsets of the features, each in alphabetical order.
fn templates(features: &[String]) -> Vec<Template> {
    let mut sorted = features.to_vec();
    sorted.sort();
    let mut templates = vec![Template::new()];
    for feature in sorted {
        let with: Vec<Template> =
            templates.iter().map(|smaller| smaller.iter().chain([&feature]).cloned().collect()).collect();
        templates.extend(with);
    }
    templates
}

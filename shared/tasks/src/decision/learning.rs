//! Learns a task from the examples of one perspective.

use std::collections::{BTreeMap, BTreeSet};

use super::arrangement::{ShownArrangement, rank_arrangements};
use super::inquiry::{Inquiry, QueryContext, inquire};
use super::learned::{Learned, Means};
use super::rank::{RankingContext, rank};
use super::rule::Rule;
use crate::demonstration::{Effect, Object, Signature, Snapshot, View, changes, has_percepts};
use crate::hypotheses::{
    DemonstratedObject, Demonstration, GoalBelief, Lexicon, Place, ROUNDING_NATS, Settings, frame_of,
};
use crate::language::Language;

/// Maximum number of rules for each goal.
const MAX_RULES: usize = 512;
/// Hypotheses this many nats below the best are ignored when a query is selected.
const QUERY_WITHIN_NATS: f64 = 10.0;

/// Expands and ranks the hypotheses of one perspective over all its examples. See [`Learning`].
#[must_use]
pub fn learn_with(language: &Language, views: &[&View], settings: &Settings) -> Learned {
    let mut learning = Learning::new(language, settings);
    views.iter().for_each(|view| learning.add(view));
    learning.learned()
}

/// Incremental learning of a task from the examples of one perspective.
///
/// P(h|D) ∝ P(D|h) P(h). Without label noise P(D|h) is the share of the examples that h is consistent with.
/// Rules are then ranked by their tally first, then by their posterior.
///
/// Changes are grouped by signature; each group is a candidate goal belief. A group is only a means, not a goal, if
/// no class explains it. It is also a means if all its objects were displaced while the objects of an explained
/// group stayed in place.
///
/// If only positions change, the goal is a spatial configuration ([`Arrangement`](crate::Arrangement)).
///
/// Adding an example costs only what is new in it; earlier results are kept. Class features beyond
/// [`MAX_FEATURES`](crate::MAX_FEATURES) are ignored.
#[derive(Clone, Debug)]
pub struct Learning {
    language: Language,
    settings: Settings,
    lexicon: Lexicon,
    demonstrations: Vec<Demonstration>,
    goals: BTreeMap<Signature, GoalBelief>,
    /// The figure of each example; `None` once a change was more than a displacement.
    arrangements: Option<Vec<ShownArrangement>>,
}

impl Learning {
    /// A learner without examples.
    #[must_use]
    pub fn new(language: &Language, settings: &Settings) -> Self {
        Self {
            lexicon: Lexicon::new(language.features.iter().map(|words| words.name.as_str())),
            language: language.clone(),
            settings: *settings,
            demonstrations: Vec::new(),
            goals: BTreeMap::new(),
            arrangements: Some(Vec::new()),
        }
    }

    /// Number of examples added.
    #[must_use]
    pub fn examples(&self) -> usize {
        self.demonstrations.len()
    }

    /// Adds an example.
    pub fn add(&mut self, view: &View) {
        self.add_view(view, view.answer().is_some());
    }

    /// Adds a sentence as an example of hypothetical objects ([`told`](crate::told)). It says nothing about numbers and
    /// spatial relations.
    pub fn add_told(&mut self, view: &View) {
        self.add_view(view, true);
    }

    fn add_view(&mut self, view: &View, is_hypothetical: bool) {
        let mut changes = changes(&view.before, &view.after, self.language.moved_m);
        let moved = Signature::from([Effect::Moved]);
        if changes.values().any(|change| change.signature != moved) {
            self.arrangements = None;
        } else if let Some(arrangements) = &mut self.arrangements {
            arrangements.push(ShownArrangement::of(view, self.language.moved_m));
        }
        let (before, after) = (frame_of(&view.before), frame_of(&view.after));
        let objects = view.after.objects.iter().map(|object| DemonstratedObject {
            key: self.lexicon.key(object),
            change: changes.remove(&object.id),
            place: match view.before.object(object.id) {
                Some(then) => Place::of(&before, then),
                None => Place::of(&after, object),
            },
            object: object.clone(),
        });
        let new = Demonstration { objects: objects.collect(), is_hypothetical, count: None };
        let signatures: BTreeSet<&Signature> = new
            .objects
            .iter()
            .filter_map(|shown| shown.change.as_ref())
            .map(|change| &change.signature)
            .collect();
        for signature in signatures {
            if !self.goals.contains_key(signature) {
                let mut goal = GoalBelief::new(signature, &self.lexicon, &self.settings);
                self.demonstrations.iter().for_each(|past| goal.add(past, &self.lexicon));
                self.goals.insert(signature.clone(), goal);
            }
        }
        self.goals.values_mut().for_each(|goal| goal.add(&new, &self.lexicon));
        self.demonstrations.push(new);
    }

    /// Adds a sentence: the rule applies to this number of objects. Only rules of
    /// [`HypothesisLanguage::Extended`](crate::HypothesisLanguage::Extended) have numbers.
    pub fn add_count(&mut self, count: usize) {
        let new = Demonstration { objects: Vec::new(), is_hypothetical: true, count: Some(count) };
        self.goals.values_mut().for_each(|goal| goal.add(&new, &self.lexicon));
        self.demonstrations.push(new);
    }

    /// The result from the examples so far.
    pub fn learned(&mut self) -> Learned {
        self.leading(MAX_RULES, ROUNDING_NATS)
    }

    /// As [`Learning::learned`], with at most `max_count` rules for each goal, from hypotheses at most `within_nats`
    /// below the best. The posteriors omit the hypotheses beyond that.
    pub fn leading(&mut self, max_count: usize, within_nats: f64) -> Learned {
        let Self { language, settings, lexicon, demonstrations, goals, arrangements } = self;
        let examples = demonstrations.len();
        if let Some(arrangements) = arrangements.as_deref().filter(|_| !goals.is_empty()) {
            return Learned { examples, arrangements: rank_arrangements(arrangements), ..Learned::default() };
        }
        let mut groups = Vec::new();
        for goal in goals.values_mut() {
            let scored = goal.hypotheses(lexicon, settings, within_nats, max_count);
            let best = scored.hypotheses.iter().map(|one| one.log_score).fold(f64::NEG_INFINITY, f64::max);
            let subject = RankingContext { language, lexicon, goal, examples };
            let rules = rank(&subject, scored, settings, max_count);
            // With label noise, a few stray changes do not make a goal.
            let is_explained = match goal.log_likelihood_of_noise(settings) {
                Some(nothing) => best > nothing,
                None => rules.first().is_some_and(|rule| rule.standing.tally > 0),
            };
            groups.push(Group { goal, is_explained, rules });
        }
        let in_place = groups.iter().any(|group| group.is_explained && !group.goal.is_displaced);
        let is_candidate = |group: &Group<'_>| group.is_explained && !(in_place && group.goal.is_displaced);
        let best = groups.iter().filter(|group| is_candidate(group)).map(Group::best_tally).max();
        let slips = settings.noise.logs().is_some();
        let mut learned = Learned { examples, ..Learned::default() };
        for group in groups {
            if is_candidate(&group) && (slips || Some(group.best_tally()) == best) {
                learned.goals.push(group.rules);
            } else {
                let GoalBelief { signature, kinds, .. } = group.goal;
                learned.means.push(Means { signature: signature.clone(), kinds: kinds.clone() });
            }
        }
        learned
    }

    /// The posterior predictive probability, for every object of a scene, that the rule about this goal applies.
    /// `None` for an object that lacks the percepts of the goal (a peg has no hole), and for an unknown goal.
    ///
    /// Numbers and relations are evaluated within the objects of the scene.
    pub fn probabilities(&mut self, goal: &Signature, scene: &Snapshot) -> Vec<Option<f64>> {
        let Self { settings, lexicon, goals, .. } = self;
        let Some(goal) = goals.get_mut(goal) else { return vec![None; scene.objects.len()] };
        let frame = frame_of(scene);
        let is_eligible = |object: &&Object| has_percepts(object, &goal.signature);
        let asked: Vec<_> = scene
            .objects
            .iter()
            .filter(is_eligible)
            .map(|object| (lexicon.key_of_known(object), Place::of(&frame, object)))
            .collect();
        let is_eligible: Vec<bool> = scene.objects.iter().map(|object| is_eligible(&object)).collect();
        let mut answers = goal.probabilities(lexicon, settings, &asked).into_iter();
        is_eligible.into_iter().map(|is_eligible| if is_eligible { answers.next() } else { None }).collect()
    }

    /// Selects the objects, at most `max_count`, with the highest expected information gain about the teacher's goal.
    /// One object makes a question; several make a request for a demonstration. `None` if no object is
    /// informative.
    pub fn inquire(&mut self, goal: &Signature, max_count: usize) -> Option<Inquiry> {
        let Self { language, settings, lexicon, goals, .. } = self;
        let goal = goals.get_mut(goal)?;
        let scored = goal.hypotheses(lexicon, settings, QUERY_WITHIN_NATS, MAX_RULES);
        let GoalBelief { signature, seen, .. } = goal;
        inquire(
            &QueryContext { language, lexicon, signature, seen, noise: settings.noise },
            &scored,
            max_count,
        )
    }
}

/// A goal and the rules that explain its changes.
struct Group<'a> {
    goal: &'a GoalBelief,
    is_explained: bool,
    rules: Vec<Rule>,
}

impl Group<'_> {
    fn best_tally(&self) -> usize {
        self.rules.first().map_or(0, |rule| rule.standing.tally)
    }
}

#[cfg(test)]
impl Learning {
    /// The rules about a goal, even if it is only a means to another.
    pub(crate) fn rules(&mut self, goal: &Signature) -> Vec<Rule> {
        let Self { language, settings, lexicon, demonstrations, goals, .. } = self;
        let Some(goal) = goals.get_mut(goal) else { return Vec::new() };
        let scored = goal.hypotheses(lexicon, settings, ROUNDING_NATS, usize::MAX);
        let subject = RankingContext { language, lexicon, goal, examples: demonstrations.len() };
        rank(&subject, scored, settings, usize::MAX)
    }

    /// The hypotheses about a goal before equivalent ones are merged: template, classes, tally.
    pub(crate) fn hypotheses(
        &mut self,
        goal: &Signature,
    ) -> Vec<(crate::hypotheses::Template, BTreeSet<crate::hypotheses::Class>, usize)> {
        let Self { settings, lexicon, goals, .. } = self;
        let Some(goal) = goals.get_mut(goal) else { return Vec::new() };
        let scored = goal.hypotheses(lexicon, settings, ROUNDING_NATS, usize::MAX);
        let named = scored.hypotheses.into_iter().map(|one| {
            let classes = one.classes.into_iter().map(|key| lexicon.class(one.mask, key)).collect();
            (lexicon.template(one.mask), classes, one.tally)
        });
        named.collect()
    }
}

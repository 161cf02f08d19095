use std::collections::{BTreeMap, BTreeSet};

use crate::change::{changes, has_percepts};
use crate::figure::{Shown as ShownFigure, rank_figures};
use crate::goal::{Demonstration, Goal, Shown};
use crate::inquiry::{Asking, Inquiry, inquire};
use crate::lexicon::Lexicon;
use crate::log_sum::ROUNDING;
use crate::rank::{Subject, rank};
use crate::selection::{Place, frame_of};
#[cfg(test)]
use crate::{Class, Template};
use crate::{Effect, FigureRule, Language, Object, Prior, Rule, Settings, Signature, Snapshot, View};

/// Rules given for each goal at most.
const RULES_MOST: usize = 512;
/// Hypotheses further below the best than this are not worth asking about, in nats.
const INQUIRING: f64 = 10.0;

/// What one perspective makes of the examples of a task.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Learned {
    /// Examples that the perspective has.
    pub examples: usize,
    /// For every goal belief of the task its rules, best first; the first is the primary one.
    pub goals: Vec<Vec<Rule>>,
    /// What was built, where the task is about how things stand: best first.
    pub figures: Vec<FigureRule>,
    /// What else changed, and with what: the means to the goals.
    pub means: Vec<Means>,
}

impl Learned {
    /// The primary rule of every goal belief.
    pub fn primary(&self) -> impl Iterator<Item = &Rule> {
        self.goals.iter().filter_map(|rules| rules.first())
    }

    /// Of its examples, how many its primary rules or its first figure are consistent with: where
    /// there are fewer than examples, no rule explains all of them.
    #[must_use]
    pub fn tally(&self) -> usize {
        let rules = self.primary().map(|rule| rule.standing.tally).min();
        rules.or_else(|| self.figures.first().map(|figure| figure.standing.tally)).unwrap_or(0)
    }

    /// Whether anything was learned.
    #[must_use]
    pub fn explains(&self) -> bool {
        !self.goals.is_empty() || !self.figures.is_empty()
    }
}

/// Changes to *some* objects of a kind: a peg goes into every hole, and which peg does not matter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Means {
    /// How the objects changed.
    pub signature: Signature,
    /// The class features of those that did.
    pub kinds: BTreeSet<BTreeMap<String, String>>,
}

/// Expands and ranks the hypotheses of one perspective over all its examples, as the robot of the
/// paper would with this prior; `share` is the share of the best posterior that a high-likelihood
/// rule has at least. See [`Learning`].
#[must_use]
pub fn learn(language: &Language, views: &[&View], prior: &Prior, share: f64) -> Learned {
    let settings = Settings { prior: *prior, high_likelihood: share, ..Settings::default() };
    learn_with(language, views, &settings)
}

/// Expands and ranks the hypotheses of one perspective over all its examples. See [`Learning`].
#[must_use]
pub fn learn_with(language: &Language, views: &[&View], settings: &Settings) -> Learned {
    let mut learning = Learning::new(language, settings);
    views.iter().for_each(|view| learning.add(view));
    learning.learned()
}

/// One perspective learning a task, example by example.
///
/// P(h|D) ∝ P(D|h) P(h). Where teachers do not slip, P(D|h) is the share of the examples that h
/// is consistent with, and rules are ranked by their tally first, then by their posterior.
///
/// Changes are grouped by their signature, one goal belief for each. A group that no class
/// explains means *some* of its objects, and so does one whose objects were all moved about
/// where another group's were changed in their place: those are the means.
///
/// Where nothing but places changes, that a thing is somewhere else is no goal: where it stands is, and
/// what is learned is a figure.
///
/// An example costs what is new in it: what earlier ones came to is kept. Class features beyond
/// [`FEATURES_MOST`](crate::FEATURES_MOST) are not looked at.
#[derive(Clone, Debug)]
pub struct Learning {
    language: Language,
    settings: Settings,
    lexicon: Lexicon,
    demonstrations: Vec<Demonstration>,
    goals: BTreeMap<Signature, Goal>,
    /// The figure of each example; `None` since more than places changed.
    figures: Option<Vec<ShownFigure>>,
}

impl Learning {
    /// Nothing learned yet.
    #[must_use]
    pub fn new(language: &Language, settings: &Settings) -> Self {
        Self {
            lexicon: Lexicon::new(language.features.iter().map(|words| words.name.as_str())),
            language: language.clone(),
            settings: *settings,
            demonstrations: Vec::new(),
            goals: BTreeMap::new(),
            figures: Some(Vec::new()),
        }
    }

    /// Examples taken in.
    #[must_use]
    pub fn examples(&self) -> usize {
        self.demonstrations.len()
    }

    /// Takes in an example.
    pub fn add(&mut self, view: &View) {
        let mut changes = changes(&view.before, &view.after, self.language.moved_m);
        let moved = Signature::from([Effect::Moved]);
        if changes.values().any(|change| change.signature != moved) {
            self.figures = None;
        } else if let Some(figures) = &mut self.figures {
            figures.push(ShownFigure::of(view, self.language.moved_m));
        }
        let (before, after) = (frame_of(&view.before), frame_of(&view.after));
        let objects = view.after.objects.iter().map(|object| Shown {
            key: self.lexicon.key(object),
            change: changes.remove(&object.id),
            place: match view.before.object(object.id) {
                Some(then) => Place::of(&before, then),
                None => Place::of(&after, object),
            },
            object: object.clone(),
        });
        let new = Demonstration { objects: objects.collect(), is_answer: view.answer().is_some() };
        let signatures: BTreeSet<&Signature> = new
            .objects
            .iter()
            .filter_map(|shown| shown.change.as_ref())
            .map(|change| &change.signature)
            .collect();
        for signature in signatures {
            if !self.goals.contains_key(signature) {
                let mut goal = Goal::new(signature, &self.lexicon, &self.settings);
                self.demonstrations.iter().for_each(|past| goal.add(past, &self.lexicon));
                self.goals.insert(signature.clone(), goal);
            }
        }
        self.goals.values_mut().for_each(|goal| goal.add(&new, &self.lexicon));
        self.demonstrations.push(new);
    }

    /// What the examples so far come to.
    pub fn learned(&mut self) -> Learned {
        self.leading(RULES_MOST, ROUNDING)
    }

    /// As [`Learning::learned`], but only so many rules for each goal, and from hypotheses no more
    /// than so many nats below the best: a posterior leaves out what is less probable than that.
    pub fn leading(&mut self, most: usize, within_nats: f64) -> Learned {
        let Self { language, settings, lexicon, demonstrations, goals, figures } = self;
        let examples = demonstrations.len();
        if let Some(figures) = figures.as_deref().filter(|_| !goals.is_empty()) {
            return Learned { examples, figures: rank_figures(figures), ..Learned::default() };
        }
        let mut groups = Vec::new();
        for goal in goals.values_mut() {
            let scored = goal.hypotheses(lexicon, settings, within_nats, most);
            let best = scored.hypotheses.iter().map(|one| one.log_score).fold(f64::NEG_INFINITY, f64::max);
            let subject = Subject { language, lexicon, goal, examples };
            let rules = rank(&subject, scored, settings, most);
            // Where teachers slip, a few stray changes are no goal.
            let is_explained = match goal.log_nothing_but_slips(settings) {
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
                let Goal { signature, kinds, .. } = group.goal;
                learned.means.push(Means { signature: signature.clone(), kinds: kinds.clone() });
            }
        }
        learned
    }

    /// For every object of a scene the posterior predictive probability that the rule about this
    /// goal holds for it; `None` for an object that no such rule can be about (a peg has no hole),
    /// and of a goal that no example had.
    ///
    /// Numbers and relations are taken among the objects of the scene.
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

    /// The objects, `most` at most, of which the teacher's treatment is expected to tell most about
    /// his goal: one to ask him about, or several to have him show. `None` when there is nothing
    /// to be told that way.
    pub fn inquire(&mut self, goal: &Signature, most: usize) -> Option<Inquiry> {
        let Self { language, settings, lexicon, goals, .. } = self;
        let goal = goals.get_mut(goal)?;
        let scored = goal.hypotheses(lexicon, settings, INQUIRING, RULES_MOST);
        let Goal { signature, seen, .. } = goal;
        inquire(&Asking { language, lexicon, signature, seen, noise: settings.noise }, &scored, most)
    }
}

#[cfg(test)]
impl Learning {
    /// The rules about a goal, whether it is one or only the means to another.
    pub(crate) fn rules(&mut self, goal: &Signature) -> Vec<Rule> {
        let Self { language, settings, lexicon, demonstrations, goals, .. } = self;
        let Some(goal) = goals.get_mut(goal) else { return Vec::new() };
        let scored = goal.hypotheses(lexicon, settings, ROUNDING, usize::MAX);
        let subject = Subject { language, lexicon, goal, examples: demonstrations.len() };
        rank(&subject, scored, settings, usize::MAX)
    }

    /// The hypotheses about a goal before those that say the same are one: template, classes, tally.
    pub(crate) fn hypotheses(&mut self, goal: &Signature) -> Vec<(Template, BTreeSet<Class>, usize)> {
        let Self { settings, lexicon, goals, .. } = self;
        let Some(goal) = goals.get_mut(goal) else { return Vec::new() };
        let scored = goal.hypotheses(lexicon, settings, ROUNDING, usize::MAX);
        let named = scored.hypotheses.into_iter().map(|one| {
            let classes = one.classes.into_iter().map(|key| lexicon.class(one.mask, key)).collect();
            (lexicon.template(one.mask), classes, one.tally)
        });
        named.collect()
    }
}

/// A goal, and the rules that explain its changes.
struct Group<'a> {
    goal: &'a Goal,
    is_explained: bool,
    rules: Vec<Rule>,
}

impl Group<'_> {
    fn best_tally(&self) -> usize {
        self.rules.first().map_or(0, |rule| rule.standing.tally)
    }
}

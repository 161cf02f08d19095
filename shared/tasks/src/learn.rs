use std::collections::{BTreeMap, BTreeSet};

use crate::change::changes;
use crate::describe::describe_classes;
use crate::hypothesis::{Evidence, Hypothesis, class_of, expand};
use crate::{Class, Effect, FigureRule, Language, Prior, Rule, Signature, Template, View, figures};

/// Scores closer than this are a tie: they differ by rounding.
const TIE: f64 = 1e-9;

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

/// The changes of one signature over all examples, and the hypotheses that explain them.
struct Group {
    signature: Signature,
    displaced: bool,
    rules: Vec<Rule>,
}

impl Group {
    fn best_tally(&self) -> usize {
        self.rules.first().map_or(0, |rule| rule.tally)
    }
}

/// Expands and ranks the hypotheses of one perspective over all its examples.
///
/// P(h|D) ∝ P(D|h) P(h), where P(D|h) is the share of the examples that h is consistent with.
/// Rules are ranked by their tally first, then by their posterior. `share` is the share of the
/// best posterior that a high-likelihood rule has at least.
///
/// Changes are grouped by their signature, one goal belief for each. A group that no class
/// explains means *some* of its objects, and so does one whose objects were all moved about
/// where another group's were changed in their place: those are the means.
#[must_use]
pub fn learn(language: &Language, views: &[&View], prior: &Prior, share: f64) -> Learned {
    let evidence: Vec<Evidence<'_>> = views
        .iter()
        .map(|view| Evidence {
            after: &view.after,
            changes: changes(&view.before, &view.after, language.moved_m),
        })
        .collect();
    let signatures: BTreeSet<&Signature> =
        evidence.iter().flat_map(|one| one.changes.values().map(|change| &change.signature)).collect();
    let groups: Vec<Group> = signatures
        .into_iter()
        .map(|signature| Group {
            signature: signature.clone(),
            displaced: evidence
                .iter()
                .flat_map(|one| one.changes.values())
                .filter(|change| change.signature == *signature)
                .all(|change| change.displaced),
            rules: rank(language, signature, &evidence, prior, share),
        })
        .collect();
    let in_place = groups.iter().any(|group| !group.displaced && group.best_tally() > 0);
    let is_candidate = |group: &&Group| group.best_tally() > 0 && !(in_place && group.displaced);
    let best = groups.iter().filter(is_candidate).map(Group::best_tally).max().unwrap_or(0);
    let mut learned = Learned { examples: views.len(), ..Learned::default() };
    for group in groups {
        if is_candidate(&&group) && group.best_tally() == best {
            learned.goals.push(group.rules);
        } else {
            let changed = evidence.iter().flat_map(|one| one.changed(&group.signature));
            let kinds = changed.map(|object| object.features.clone()).collect();
            learned.means.push(Means { signature: group.signature, kinds });
        }
    }
    // Where nothing but places changed, that a thing is somewhere else is no goal: where it stands is.
    let moved = Signature::from([Effect::Moved]);
    let all = evidence.iter().flat_map(|one| one.changes.values());
    if all.map(|change| &change.signature).all(|signature| *signature == moved) {
        learned.goals.clear();
        learned.means.clear();
        learned.figures = figures(views, language.moved_m);
    }
    learned
}

/// The rules about one signature, best first.
fn rank(
    language: &Language,
    signature: &Signature,
    evidence: &[Evidence<'_>],
    prior: &Prior,
    share: f64,
) -> Vec<Rule> {
    let features: Vec<String> = language.features.iter().map(|feature| feature.name.clone()).collect();
    let seen = Seen::of(&features, signature, evidence);
    let examples = evidence.len();
    // The sum over the hypotheses that say the same, in log space.
    let mut rules: BTreeMap<(Template, BTreeSet<Class>), (usize, LogSum)> = BTreeMap::new();
    let mut total = LogSum::default();
    for hypothesis in expand(&features, signature, evidence, prior) {
        let score = hypothesis.log_score(examples);
        let tally = hypothesis.tally;
        let rule = rules.entry(seen.reduce(hypothesis)).or_insert((tally, LogSum::default()));
        rule.0 = rule.0.max(tally);
        rule.1.add(score);
        total.add(score);
    }
    let mut rules: Vec<(f64, Rule)> = rules
        .into_iter()
        .map(|((template, classes), (tally, sum))| {
            let log_posterior =
                if total.value() > f64::NEG_INFINITY { sum.value() - total.value() } else { sum.value() };
            let rule = Rule {
                expectation: signature.clone(),
                name: describe_classes(language, &template, &classes, &seen.classes(&template)),
                template,
                classes,
                tally,
                examples,
                posterior: log_posterior.exp(),
                rank: 0,
                high_likelihood: false,
            };
            (log_posterior, rule)
        })
        .collect();
    // A stable sort: ties stay in the order of their templates and classes.
    rules.sort_by(|(a_log, a), (b_log, b)| {
        let by_posterior =
            if ties(*a_log, *b_log) { std::cmp::Ordering::Equal } else { b_log.total_cmp(a_log) };
        b.tally.cmp(&a.tally).then(by_posterior)
    });
    number(&mut rules, share);
    rules.into_iter().map(|(_, rule)| rule).collect()
}

fn number(rules: &mut [(f64, Rule)], share: f64) {
    let Some((best_log, best_tally)) = rules.first().map(|(log, rule)| (*log, rule.tally)) else { return };
    let mut above: Option<(f64, usize, usize)> = None;
    for (index, (log, rule)) in rules.iter_mut().enumerate() {
        rule.rank = match above {
            Some((above_log, tally, rank)) if tally == rule.tally && ties(above_log, *log) => rank,
            _ => index + 1,
        };
        above = Some((*log, rule.tally, rule.rank));
        rule.high_likelihood =
            rule.tally == best_tally && rule.tally > 0 && *log >= best_log + share.ln() - TIE;
    }
}

#[expect(clippy::float_cmp, reason = "two infinities tie, and their difference is no number")]
fn ties(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() < TIE
}

/// What the eligible objects of all examples looked like.
struct Seen<'a> {
    objects: Vec<&'a crate::Object>,
    values: BTreeMap<String, BTreeSet<String>>,
}

impl<'a> Seen<'a> {
    fn of(features: &[String], signature: &Signature, evidence: &[Evidence<'a>]) -> Self {
        let objects: Vec<_> = evidence.iter().flat_map(|one| one.eligible(signature)).collect();
        let mut values = BTreeMap::new();
        for feature in features {
            // A feature that some object lacks divides the objects even with a single value.
            let seen: Option<BTreeSet<String>> =
                objects.iter().map(|object| object.features.get(feature).cloned()).collect();
            if let Some(seen) = seen {
                values.insert(feature.clone(), seen);
            }
        }
        Self { objects, values }
    }

    /// The same classes without the features that make no difference to any object made of the
    /// values seen: for every class, every other value of the feature is in the classes, too.
    fn reduce(&self, hypothesis: Hypothesis) -> (Template, BTreeSet<Class>) {
        let Hypothesis { mut template, mut classes, .. } = hypothesis;
        let mut index = 0;
        while let Some(feature) = template.get(index) {
            let redundant = self.values.get(feature).is_some_and(|values| {
                classes.iter().all(|class| {
                    values.iter().all(|value| classes.contains(&with(class, index, Some(value))))
                })
            });
            if redundant {
                classes = classes.iter().map(|class| with(class, index, None)).collect();
                template.remove(index);
            } else {
                index += 1;
            }
        }
        (template, classes)
    }

    /// The classes that were seen under a template.
    fn classes(&self, template: &Template) -> BTreeSet<Class> {
        self.objects.iter().filter_map(|object| class_of(object, template)).collect()
    }
}

/// The class with another value at an index, or with none.
fn with(class: &Class, index: usize, value: Option<&String>) -> Class {
    let (before, from) = class.split_at(index.min(class.len()));
    before.iter().chain(value).chain(from.iter().skip(1)).cloned().collect()
}

/// A sum of numbers given by their logarithms, kept by its logarithm.
#[derive(Clone, Copy, Debug)]
struct LogSum {
    most: f64,
    scaled: f64,
}

impl Default for LogSum {
    fn default() -> Self {
        Self { most: f64::NEG_INFINITY, scaled: 0.0 }
    }
}

impl LogSum {
    fn add(&mut self, log: f64) {
        if log > self.most {
            self.scaled = self.scaled.mul_add((self.most - log).exp(), 1.0);
            self.most = log;
        } else if log > f64::NEG_INFINITY {
            self.scaled += (log - self.most).exp();
        }
    }

    fn value(&self) -> f64 {
        if self.scaled > 0.0 { self.most + self.scaled.ln() } else { f64::NEG_INFINITY }
    }
}

/// The perspective whose rules Leo follows: the teacher's, where he is simulated and his view
/// explains anything ("take the perspective of the teacher, and assume that their schema is
/// correct"), else Leo's own (0). `None` where neither explains anything.
#[must_use]
pub fn decide(learned: &BTreeMap<u16, Learned>, teacher: u16) -> Option<u16> {
    [teacher, 0].into_iter().find(|perspective| learned.get(perspective).is_some_and(Learned::explains))
}

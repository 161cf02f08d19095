//! Descriptions of object sets in disjunctive normal form.

use invariant::require;

use crate::hypotheses::hypothesis::Described;
use crate::hypotheses::key::{Key, MAX_FEATURES, Mask, field, has, with_field};
use crate::hypotheses::lexicon::Lexicon;
use crate::hypotheses::seen_kinds::{SeenKinds, reduce};

/// Maximum cost of a description: one for each literal and one for each negation ...
const MAX_COST: usize = 4;
/// ... lowered further if there would be more descriptions than this.
const MAX_DESCRIPTIONS: u128 = 100_000;

/// "red", or "not red". Neither holds for an object that lacks the feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Literal {
    pub(crate) feature: usize,
    pub(crate) value: u32,
    pub(crate) negated: bool,
}

impl Literal {
    pub(crate) fn holds(self, key: Key) -> bool {
        let value = field(key, self.feature);
        value != 0 && (value == self.value) != self.negated
    }

    /// Whether this literal logically implies the other.
    fn implies(self, other: Self) -> bool {
        let excludes = !self.negated && other.negated && self.value != other.value;
        self == other || (self.feature == other.feature && excludes)
    }
}

/// A conjunction of literals over different features.
#[derive(Clone, Debug)]
pub(crate) struct Term {
    /// Indices of the literals, ascending.
    pub(crate) literals: Vec<usize>,
    cost: usize,
    mask: Mask,
}

/// A disjunction of conjunctions: its parent disjunction plus one term.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Description {
    /// The disjunction without the last term; the empty one is its own parent.
    pub(crate) parent: usize,
    pub(crate) term: usize,
    pub(crate) cost: usize,
}

/// All descriptions over the values seen, by ascending number of terms; a set comes after its parent.
#[derive(Clone, Debug)]
pub(crate) struct Descriptions {
    pub(crate) literals: Vec<Literal>,
    /// The first is the empty conjunction, which always holds.
    pub(crate) terms: Vec<Term>,
    /// The first is the empty disjunction, which is not a hypothesis. The second covers everything.
    pub(crate) sets: Vec<Description>,
    /// The maximum cost of a description.
    pub(crate) longest: usize,
}

impl Descriptions {
    pub(crate) fn new(lexicon: &Lexicon, seen: &SeenKinds) -> Self {
        let mut literals = Vec::new();
        for (feature, values) in seen.values().iter().enumerate() {
            let mut values = values.clone();
            values.sort_unstable_by_key(|&value| lexicon.value(feature, value));
            let both = values.iter().flat_map(|&value| [(value, false), (value, true)]);
            literals.extend(both.map(|(value, negated)| Literal { feature, value, negated }));
        }
        let all = terms(&literals);
        let longest = longest(&all);
        let terms: Vec<Term> = all.into_iter().filter(|term| term.cost <= longest).collect();
        let mut sets =
            vec![Description { parent: 0, term: 0, cost: 0 }, Description { parent: 0, term: 0, cost: 0 }];
        let mut frontier: Vec<usize> = vec![0];
        while !frontier.is_empty() {
            let mut grown = Vec::new();
            for parent in frontier {
                let set = require!(sets.get(parent), "description {parent} exists");
                let Some(&Description { term: last, cost, .. }) = set else { continue };
                for (term, new) in terms.iter().enumerate().skip(last + 1) {
                    if cost + new.cost > longest {
                        // The terms are sorted by cost.
                        break;
                    }
                    if is_new_term(&literals, &terms, &sets, parent, new) {
                        grown.push(sets.len());
                        sets.push(Description { parent, term, cost: cost + new.cost });
                    }
                }
            }
            frontier = grown;
        }
        Self { literals, terms, sets, longest }
    }

    fn term(&self, number: usize) -> impl Iterator<Item = Literal> {
        let term = require!(self.terms.get(number), "term {number} exists");
        let literals = term.map_or(&[][..], |term| &term.literals);
        literals.iter().filter_map(|&literal| self.literals.get(literal).copied())
    }

    /// Indices of the terms of a set.
    fn terms_of(&self, set: usize) -> Vec<usize> {
        terms_of(&self.sets, set)
    }

    fn holds(&self, terms: &[usize], key: Key) -> bool {
        terms.iter().any(|&term| self.term(term).all(|literal| literal.holds(key)))
    }

    /// The set as classes of a template, over all combinations of the values seen. Features that make no
    /// difference are removed, so equivalent sets yield equal results.
    pub(crate) fn classes(&self, set: usize, seen: &SeenKinds) -> (Mask, Vec<Key>) {
        let terms = self.terms_of(set);
        let mask =
            terms.iter().filter_map(|&term| self.terms.get(term)).fold(0, |mask, term| mask | term.mask);
        let mut classes: Vec<Key> = vec![0];
        for feature in (0..MAX_FEATURES).filter(|&feature| has(mask, feature)) {
            let values = seen.values().get(feature).map_or(&[][..], Vec::as_slice);
            let with = |key: Key| values.iter().map(move |&value| with_field(key, feature, value));
            classes = classes.into_iter().flat_map(with).collect();
        }
        classes.retain(|&class| self.holds(&terms, class));
        classes.sort_unstable();
        reduce(mask, classes, seen)
    }

    /// Cost of a set.
    pub(crate) fn cost(&self, set: usize) -> usize {
        require!(self.sets.get(set), "description {set} exists").map_or(0, |set| set.cost)
    }

    /// Index and cost of a set.
    pub(crate) fn described(&self, set: usize) -> Described {
        Described { cost: self.cost(set), set }
    }

    /// The description in words: "red or not small square".
    pub(crate) fn phrase(&self, set: usize, lexicon: &Lexicon, order: impl Fn(&str) -> usize) -> String {
        let word = |literal: Literal| {
            let value = lexicon.value(literal.feature, literal.value);
            let word = if literal.negated { format!("not {value}") } else { value.to_owned() };
            (order(lexicon.feature(literal.feature)), word)
        };
        let mut terms: Vec<Vec<(usize, String)>> = Vec::new();
        for term in self.terms_of(set) {
            let mut words: Vec<(usize, String)> = self.term(term).map(word).collect();
            words.sort();
            terms.push(words);
        }
        terms.sort();
        let spoken = |words: Vec<(usize, String)>| {
            words.into_iter().map(|(_, word)| word).collect::<Vec<String>>().join(" ")
        };
        terms.into_iter().map(spoken).collect::<Vec<String>>().join(" or ")
    }
}

fn terms_of(sets: &[Description], mut set: usize) -> Vec<usize> {
    // Set 1, everything, consists of the empty term.
    let mut terms = if set == 1 { vec![0] } else { Vec::new() };
    while let Some(one) = sets.get(set).filter(|one| one.term != 0) {
        terms.push(one.term);
        set = one.parent;
    }
    terms
}

/// Whether a term extends the set: the term neither implies a term of the set nor is implied by one.
fn is_new_term(literals: &[Literal], terms: &[Term], sets: &[Description], set: usize, new: &Term) -> bool {
    let literal = |number: &usize| literals.get(*number).copied();
    let implies = |a: &Term, b: &Term| {
        b.literals
            .iter()
            .filter_map(literal)
            .all(|wanted| a.literals.iter().filter_map(literal).any(|given| given.implies(wanted)))
    };
    let others = terms_of(sets, set);
    let mut others = others.iter().filter_map(|&term| terms.get(term));
    !others.any(|other| implies(new, other) || implies(other, new))
}

/// All conjunctions up to the maximum cost, sorted by cost.
fn terms(literals: &[Literal]) -> Vec<Term> {
    let mut terms = vec![Term { literals: Vec::new(), cost: 0, mask: 0 }];
    let mut frontier = 0;
    while frontier < terms.len() {
        let Some(term) = terms.get(frontier).cloned() else { break };
        frontier += 1;
        let next = term.literals.last().map_or(0, |last| last + 1);
        for (number, literal) in literals.iter().enumerate().skip(next) {
            let cost = term.cost + 1 + usize::from(literal.negated);
            if cost <= MAX_COST && !has(term.mask, literal.feature) {
                let literals = term.literals.iter().copied().chain([number]).collect();
                terms.push(Term { literals, cost, mask: term.mask | 1 << literal.feature });
            }
        }
    }
    terms.sort_by_key(|term| term.cost);
    terms
}

/// The largest cost for which the number of descriptions stays within [`MAX_DESCRIPTIONS`].
fn longest(terms: &[Term]) -> usize {
    // Upper bound on the number of descriptions of each cost; implications among terms only reduce it.
    let mut counts: [u128; MAX_COST + 1] = [1, 0, 0, 0, 0];
    for term in terms.iter().filter(|term| term.cost > 0) {
        let before = counts;
        for (count, less) in counts.iter_mut().skip(term.cost).zip(before) {
            *count = count.saturating_add(less);
        }
    }
    let mut sum = 0_u128;
    let fit = counts.iter().take_while(|&&count| {
        sum = sum.saturating_add(count);
        sum <= MAX_DESCRIPTIONS
    });
    fit.count().saturating_sub(1).max(1)
}

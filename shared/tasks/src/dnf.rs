//! Sets of objects by description: disjunctions of conjunctions of literals.

use rustc_hash::FxHashSet;

use crate::hypothesis::Described;
use crate::lexicon::{FEATURES_MOST, Key, Lexicon, Mask, Seen, field, has, key_mask, with_field};

/// A description costs no more than this, one for a literal and one for its negation ...
const COST_MOST: usize = 4;
/// ... and less where there would be more descriptions than this.
const SETS_MOST: u128 = 100_000;

/// "red", or "not red". An object without the feature is neither.
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

    /// Whether whatever this is true of, the other is true of, too.
    fn implies(self, other: Self) -> bool {
        let excludes = !self.negated && other.negated && self.value != other.value;
        self == other || (self.feature == other.feature && excludes)
    }
}

/// A conjunction of literals about different features.
#[derive(Clone, Debug)]
pub(crate) struct Term {
    /// The literals by number, in ascending order.
    pub(crate) literals: Vec<usize>,
    cost: usize,
    mask: Mask,
}

/// A disjunction of conjunctions: one that stands before it, and one conjunction more.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Set {
    /// The set without the last term; the empty one is its own.
    pub(crate) parent: usize,
    pub(crate) term: usize,
    pub(crate) cost: usize,
}

/// All descriptions over the values seen, the shortest first; a set stands after its parent.
#[derive(Clone, Debug)]
pub(crate) struct Descriptions {
    pub(crate) literals: Vec<Literal>,
    /// The first is the empty conjunction, which is true of everything.
    pub(crate) terms: Vec<Term>,
    /// The first is the empty disjunction, which is no hypothesis; the second is everything.
    pub(crate) sets: Vec<Set>,
    /// How long a description can be.
    pub(crate) longest: usize,
}

impl Descriptions {
    pub(crate) fn new(lexicon: &Lexicon, seen: &Seen) -> Self {
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
        let mut sets = vec![Set { parent: 0, term: 0, cost: 0 }, Set { parent: 0, term: 0, cost: 0 }];
        let mut begun: Vec<usize> = vec![0];
        while !begun.is_empty() {
            let mut grown = Vec::new();
            for parent in begun {
                let Some(&Set { term: last, cost, .. }) = sets.get(parent) else { continue };
                for (term, new) in terms.iter().enumerate().skip(last + 1) {
                    if cost + new.cost > longest {
                        // The terms stand in the order of their cost.
                        break;
                    }
                    if adds(&literals, &terms, &sets, parent, new) {
                        grown.push(sets.len());
                        sets.push(Set { parent, term, cost: cost + new.cost });
                    }
                }
            }
            begun = grown;
        }
        Self { literals, terms, sets, longest }
    }

    fn term(&self, number: usize) -> impl Iterator<Item = Literal> {
        let literals = self.terms.get(number).map_or(&[][..], |term| &term.literals);
        literals.iter().filter_map(|&literal| self.literals.get(literal).copied())
    }

    /// The terms of a set, by number.
    fn terms_of(&self, set: usize) -> Vec<usize> {
        terms_of(&self.sets, set)
    }

    fn holds(&self, terms: &[usize], key: Key) -> bool {
        terms.iter().any(|&term| self.term(term).all(|literal| literal.holds(key)))
    }

    /// The set as classes of a template: those made of the values seen that it is true of, under
    /// the features that make a difference. Sets that say the same of everything made of the
    /// values seen have the same.
    pub(crate) fn classes(&self, set: usize, seen: &Seen) -> (Mask, Vec<Key>) {
        let terms = self.terms_of(set);
        let mask =
            terms.iter().filter_map(|&term| self.terms.get(term)).fold(0, |mask, term| mask | term.mask);
        let mut classes: Vec<Key> = vec![0];
        for feature in (0..FEATURES_MOST).filter(|&feature| has(mask, feature)) {
            let values = seen.values().get(feature).map_or(&[][..], Vec::as_slice);
            let with = |key: Key| values.iter().map(move |&value| with_field(key, feature, value));
            classes = classes.into_iter().flat_map(with).collect();
        }
        classes.retain(|&class| self.holds(&terms, class));
        classes.sort_unstable();
        reduce(mask, classes, seen)
    }

    /// What a set is called by number, and what it costs.
    pub(crate) fn described(&self, set: usize) -> Described {
        Described { cost: self.sets.get(set).map_or(0, |set| set.cost), set }
    }

    /// A set in words: "red or not small square".
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

fn terms_of(sets: &[Set], mut set: usize) -> Vec<usize> {
    // Everything is one empty term.
    let mut terms = if set == 1 { vec![0] } else { Vec::new() };
    while let Some(one) = sets.get(set).filter(|one| one.term != 0) {
        terms.push(one.term);
        set = one.parent;
    }
    terms
}

/// Whether a term says something that the set did not say: neither of it and any of the set's
/// terms implies the other.
fn adds(literals: &[Literal], terms: &[Term], sets: &[Set], set: usize, new: &Term) -> bool {
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

/// The conjunctions, in the order of their cost.
fn terms(literals: &[Literal]) -> Vec<Term> {
    let mut terms = vec![Term { literals: Vec::new(), cost: 0, mask: 0 }];
    let mut begun = 0;
    while begun < terms.len() {
        let Some(term) = terms.get(begun).cloned() else { break };
        begun += 1;
        let next = term.literals.last().map_or(0, |last| last + 1);
        for (number, literal) in literals.iter().enumerate().skip(next) {
            let cost = term.cost + 1 + usize::from(literal.negated);
            if cost <= COST_MOST && !has(term.mask, literal.feature) {
                let literals = term.literals.iter().copied().chain([number]).collect();
                terms.push(Term { literals, cost, mask: term.mask | 1 << literal.feature });
            }
        }
    }
    terms.sort_by_key(|term| term.cost);
    terms
}

/// The longest descriptions that are not too many.
fn longest(terms: &[Term]) -> usize {
    // Ways to make up each cost; implications among the terms only make them fewer.
    let mut ways: [u128; COST_MOST + 1] = [1, 0, 0, 0, 0];
    for term in terms.iter().filter(|term| term.cost > 0) {
        let before = ways;
        for (way, less) in ways.iter_mut().skip(term.cost).zip(before) {
            *way = way.saturating_add(less);
        }
    }
    let mut sum = 0_u128;
    let fit = ways.iter().take_while(|&&way| {
        sum = sum.saturating_add(way);
        sum <= SETS_MOST
    });
    fit.count().saturating_sub(1).max(1)
}

/// The same classes without the features that make no difference to anything made of the values
/// seen: for every class, every other value of the feature is in the classes, too.
pub(crate) fn reduce(template: Mask, mut classes: Vec<Key>, seen: &Seen) -> (Mask, Vec<Key>) {
    let mut mask = template;
    for feature in (0..FEATURES_MOST).filter(|&feature| has(template, feature)) {
        let Some(values) = seen.all_values(feature).filter(|values| !values.is_empty()) else { continue };
        // Whole rows of values, or it makes a difference.
        if !classes.len().is_multiple_of(values.len()) {
            continue;
        }
        let set: FxHashSet<Key> = classes.iter().copied().collect();
        let has_row =
            |&class: &Key| values.iter().all(|&value| set.contains(&with_field(class, feature, value)));
        if classes.iter().all(has_row) {
            mask &= !(1 << feature);
            let bits = key_mask(mask);
            for class in &mut classes {
                *class &= bits;
            }
            classes.sort_unstable();
            classes.dedup();
        }
    }
    (mask, classes)
}

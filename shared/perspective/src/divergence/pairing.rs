use std::cmp::Ordering;

use belief::percepts;
use clock::Duration;
use quantity::distance;

use super::Meaning;
use super::thing::{ComparedPercepts, Thing, apart};

/// The belief distance D (Eq. 4) over the frame-independent terms.
#[derive(Clone, Debug)]
pub(super) struct BeliefDistance {
    terms: Vec<Term>,
    threshold: f64,
    normalised: bool,
    /// Lower bound of the growth of D per metre.
    per_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct Term {
    percept: u16,
    weight: f64,
    of_place: bool,
}

impl BeliefDistance {
    pub(super) fn new(config: &percepts::Belief, aspects: &ComparedPercepts) -> Self {
        let terms: Vec<Term> = config
            .distance
            .iter()
            .filter(|term| term.weight > 0.0)
            .filter_map(|term| {
                let meaning = aspects.meaning(term.percept)?;
                let of_place = meaning == Meaning::Place;
                Some(Term { percept: term.percept, weight: term.weight, of_place })
            })
            .collect();
        let total: f64 = terms.iter().map(|term| term.weight).sum();
        let share = if config.normalised { total } else { 1.0 };
        let place = terms.iter().find(|term| term.of_place);
        let per_m = place.map_or(0.0, |term| term.weight / share);
        Self { terms, threshold: config.threshold, normalised: config.normalised, per_m }
    }

    /// D of two beliefs; `None` if not below the threshold.
    pub(super) fn distance(&self, one: &Thing, other: &Thing) -> Option<f64> {
        self.over(self.terms.iter(), one, other)
    }

    /// D without positions; `None` if not below the threshold.
    fn likeness(&self, one: &Thing, other: &Thing) -> Option<f64> {
        self.over(self.terms.iter().filter(|term| !term.of_place), one, other)
    }

    fn over<'a>(&self, terms: impl Iterator<Item = &'a Term>, one: &Thing, other: &Thing) -> Option<f64> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for term in terms {
            let (Some(of_one), Some(of_other)) = (one.feature(term.percept), other.feature(term.percept))
            else {
                continue;
            };
            let Some(apart) = apart(of_one, of_other) else { continue };
            sum += term.weight * apart;
            weights += term.weight;
        }
        let measured = if self.normalised { sum / weights } else { sum };
        // Beliefs that share no comparable term never form a pair, whatever the belief systems'
        // configuration. The comparison is written so that NaN is rejected.
        if weights > 0.0 && measured < self.threshold { Some(measured) } else { None }
    }
}

/// Sort key of a candidate pair: lower is closer. Symmetric in the two sides.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Closeness {
    first: f64,
    then: f64,
    ids: (u64, u64),
}

impl Closeness {
    fn new(first: f64, then: f64, one: &Thing, other: &Thing) -> Self {
        Self { first, then, ids: (one.id.min(other.id), one.id.max(other.id)) }
    }

    fn order(&self, other: &Self) -> Ordering {
        self.first
            .total_cmp(&other.first)
            .then_with(|| self.then.total_cmp(&other.then))
            .then_with(|| self.ids.cmp(&other.ids))
    }
}

/// Maximum of candidates examined for one thing to each side along the line.
const MAX_CANDIDATES_PER_SIDE: usize = 64;
/// Budget of examined candidates for one instant: a constant, and a share for each unpaired thing. Only the
/// round in progress may exceed it.
const CANDIDATE_BUDGET: usize = 4096;
const CANDIDATE_BUDGET_PER_THING: usize = 192;
/// No thing is replaced by a similar one at the same place within this time.
const MOMENT: Duration = Duration::from_millis(500);
/// Bound of the rounding error of a distance along the line, in metres.
const ROUNDING_M: f64 = 1e-6;

/// Finds mutually closest pairs, round by round, until none is left or the budget of the instant is spent.
///
/// The result is the greedy pairing by closeness, without a list of all candidate pairs.
#[derive(Clone, Debug)]
pub(super) struct Pairing {
    one: Search,
    other: Search,
}

/// The unpaired things of one side.
#[derive(Clone, Debug)]
struct Search {
    /// Their indices in the side's list, sorted by group and then along the line.
    open: Vec<usize>,
    /// For each thing of the side's list, the closest of the other side.
    closest: Vec<Option<usize>>,
}

/// The rule that decides which pairs are possible.
struct PairingRule<L, G, C> {
    /// Whether a thing is still unpaired.
    looks: L,
    /// A pair needs two things of the same group.
    group: G,
    /// The closeness of two things; `None` if they cannot be a pair.
    closeness: C,
    /// Lower bound of the growth of `Closeness::first` per metre.
    per_m: f64,
    /// Upper bound of `Closeness::first`.
    below: f64,
}

impl Search {
    fn new(capacity: usize) -> Self {
        Self { open: Vec::with_capacity(capacity), closest: Vec::with_capacity(capacity) }
    }

    fn begin(&mut self, things: &[Thing], looks: impl Fn(&Thing) -> bool) {
        self.open.clear();
        self.open.extend(things.iter().enumerate().filter(|(_, thing)| looks(thing)).map(|(index, _)| index));
        self.closest.clear();
        self.closest.resize(things.len(), None);
    }

    fn sort(&mut self, things: &[Thing], group: impl Fn(&Thing) -> u64) {
        self.open.sort_unstable_by(|a, b| match (things.get(*a), things.get(*b)) {
            (Some(a), Some(b)) => order(&group, a, b),
            (None, _) | (_, None) => Ordering::Equal,
        });
    }

    fn closest(&self, index: usize) -> Option<usize> {
        self.closest.get(index).copied().flatten()
    }
}

fn order(group: impl Fn(&Thing) -> u64, a: &Thing, b: &Thing) -> Ordering {
    group(a).cmp(&group(b)).then_with(|| a.along_m.total_cmp(&b.along_m))
}

impl<L: Fn(&Thing) -> bool, G: Fn(&Thing) -> u64, C: Fn(&Thing, &Thing) -> Option<Closeness>>
    PairingRule<L, G, C>
{
    /// The closest unpaired thing of the other side, and the number of candidates examined.
    fn closest(&self, thing: &Thing, open: &[usize], others: &[Thing]) -> (Option<usize>, usize) {
        let is_before =
            |index: &usize| others.get(*index).is_some_and(|other| order(&self.group, other, thing).is_lt());
        let (before, after) = open.split_at(open.partition_point(is_before));
        let mut best: Option<(Closeness, usize)> = None;
        let mut examined = 0;
        // Scan to each side along the line, nearest first.
        self.look(thing, before.iter().rev(), others, &mut best, &mut examined);
        self.look(thing, after.iter(), others, &mut best, &mut examined);
        (best.map(|(_, index)| index), examined)
    }

    fn look<'a>(
        &self,
        thing: &Thing,
        candidates: impl Iterator<Item = &'a usize>,
        others: &[Thing],
        best: &mut Option<(Closeness, usize)>,
        examined: &mut usize,
    ) {
        for &index in candidates.take(MAX_CANDIDATES_PER_SIDE) {
            let Some(other) = others.get(index) else { continue };
            *examined += 1;
            let at_least = self.per_m * (along(thing, other) - ROUNDING_M);
            let max = best.map_or(self.below, |(closeness, _)| closeness.first);
            if (self.group)(other) != (self.group)(thing) || at_least > max {
                return;
            }
            if (self.looks)(other)
                && let Some(closeness) = (self.closeness)(thing, other)
                && best.is_none_or(|(best, _)| closeness.order(&best).is_lt())
            {
                *best = Some((closeness, index));
            }
        }
    }

    /// Updates the closest candidate of each open thing of one side, if it has none or its candidate is paired already.
    /// `opposite` is the side of the candidates. Returns the number of candidates examined.
    fn find(&self, side: &mut Search, things: &[Thing], opposite: &Search, others: &[Thing]) -> usize {
        let Search { open, closest } = side;
        let mut examined = 0;
        for &index in open.iter() {
            let (Some(thing), Some(slot)) = (things.get(index), closest.get_mut(index)) else { continue };
            if slot.and_then(|closest| others.get(closest)).is_some_and(&self.looks) {
                continue;
            }
            let (found, looks) = self.closest(thing, &opposite.open, others);
            *slot = found;
            examined += looks;
        }
        examined
    }

    /// Pairs the things of two sides, round by round.
    fn run(&self, pairing: &mut Pairing, one: &mut [Thing], other: &mut [Thing]) {
        let Pairing { one: of_one, other: of_other } = pairing;
        of_one.begin(one, &self.looks);
        of_other.begin(other, &self.looks);
        let looking = of_one.open.len() + of_other.open.len();
        if of_one.open.is_empty() || of_other.open.is_empty() {
            return;
        }
        of_one.sort(one, &self.group);
        of_other.sort(other, &self.group);
        let max = looking.saturating_mul(CANDIDATE_BUDGET_PER_THING).saturating_add(CANDIDATE_BUDGET);
        let mut examined = 0;
        while examined < max {
            examined += self.find(of_one, one, of_other, other);
            examined += self.find(of_other, other, of_one, one);
            let mut found = false;
            for &i in &of_one.open {
                let Some(j) = of_one.closest(i) else { continue };
                if of_other.closest(j) == Some(i) {
                    pair(one, i, j, other);
                    pair(other, j, i, one);
                    found = true;
                }
            }
            if !found {
                return;
            }
            // A thing without a candidate in this round will have none in later rounds.
            for (Search { open, closest }, things) in [(&mut *of_one, &*one), (&mut *of_other, &*other)] {
                open.retain(|&index| {
                    let has = closest.get(index).is_some_and(Option::is_some);
                    has && things.get(index).is_some_and(&self.looks)
                });
            }
        }
    }
}

/// Distance of two things along the line; 0 if neither has a position.
fn along(one: &Thing, other: &Thing) -> f64 {
    let apart = (one.along_m - other.along_m).abs();
    // Difference of two infinities.
    if apart.is_nan() { 0.0 } else { apart }
}

impl Pairing {
    pub(super) fn new(capacity: usize) -> Self {
        Self { one: Search::new(capacity), other: Search::new(capacity) }
    }

    /// Pairs things that were last perceived at one instant and are closer than the threshold.
    pub(super) fn by_observation(
        &mut self,
        measure: &BeliefDistance,
        one: &mut [Thing],
        other: &mut [Thing],
    ) {
        let possible = PairingRule {
            looks: |thing: &Thing| !thing.is_sure,
            group: |thing: &Thing| thing.perceived_at_ns,
            closeness: |one: &Thing, other: &Thing| {
                Some(Closeness::new(measure.distance(one, other)?, 0.0, one, other))
            },
            per_m: measure.per_m,
            below: measure.threshold,
        };
        possible.run(self, one, other);
    }

    /// Pairs similar things that could not have been observed together, or that were perceived within
    /// [`MOMENT`] at one place.
    pub(super) fn by_likeness(
        &mut self,
        measure: &BeliefDistance,
        began_at_ns: u64,
        one: &mut [Thing],
        other: &mut [Thing],
    ) {
        let possible = PairingRule {
            looks: |thing: &Thing| thing.pair.is_none(),
            group: |_: &Thing| 0,
            closeness: |one: &Thing, other: &Thing| {
                let apart_in_time =
                    one.born_at_ns > other.perceived_at_ns || other.born_at_ns > one.perceived_at_ns;
                let earlier = one.born_at_ns < began_at_ns && other.born_at_ns < began_at_ns;
                // A thing that one side also touches has a later perception time on that side.
                let in_a_moment = one.perceived_at_ns.abs_diff(other.perceived_at_ns) <= clock::nanos(MOMENT);
                let places = one.place_m.zip(other.place_m);
                let at_one_place = || places.is_some() && measure.distance(one, other).is_some();
                if !(apart_in_time || earlier || in_a_moment && at_one_place()) {
                    return None;
                }
                let metres = places.map_or(f64::INFINITY, |(one, other)| distance(&one, &other));
                Some(Closeness::new(metres, measure.likeness(one, other)?, one, other))
            },
            per_m: 1.0,
            below: f64::INFINITY,
        };
        possible.run(self, one, other);
    }
}

/// Pairs a thing with one of the other side, and dissolves the pair that it had before.
fn pair(things: &mut [Thing], index: usize, pair: usize, others: &mut [Thing]) {
    let Some(thing) = things.get_mut(index) else { return };
    thing.is_sure = true;
    let left = thing.pair.replace(pair).filter(|left| *left != pair);
    if let Some(thing) = left.and_then(|left| others.get_mut(left)) {
        thing.pair = None;
    }
}

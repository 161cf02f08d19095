use std::cmp::Ordering;

use config::percepts;

use super::Meaning;
use super::thing::{Aspects, Thing, apart, distance};

/// The belief distance D (Eq. 4) over the terms that mean the same to everybody.
#[derive(Clone, Debug)]
pub(super) struct Measure {
    terms: Vec<Term>,
    threshold: f64,
    normalised: bool,
    /// Whoever is further away than this is not closer than the threshold, in metres.
    reach_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct Term {
    percept: u16,
    weight: f64,
    of_place: bool,
}

impl Measure {
    pub(super) fn new(config: &percepts::Belief, aspects: &Aspects) -> Self {
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
        // A little more, so that rounding leaves nobody out.
        let reach_m =
            place.map_or(f64::INFINITY, |term| config.threshold * share / term.weight * 1.000_001 + 1e-6);
        Self { terms, threshold: config.threshold, normalised: config.normalised, reach_m }
    }

    /// D of two beliefs, where it is below the threshold.
    pub(super) fn distance(&self, one: &Thing, other: &Thing) -> Option<f64> {
        self.over(self.terms.iter(), one, other)
    }

    /// D without places, where it is below the threshold.
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
        // Strangers that no term can compare are none of each other's, whatever the belief systems
        // are told to make of them. Written so that NaN is no small distance.
        if weights > 0.0 && measured < self.threshold { Some(measured) } else { None }
    }
}

/// How close a pair is: the lower, the closer. The same whichever side is called the one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Closeness {
    distance: f64,
    metres: f64,
    ids: (u64, u64),
}

impl Closeness {
    fn new(distance: f64, metres: f64, one: &Thing, other: &Thing) -> Self {
        Self { distance, metres, ids: (one.id.min(other.id), one.id.max(other.id)) }
    }

    fn order(&self, other: &Self) -> Ordering {
        self.distance
            .total_cmp(&other.distance)
            .then_with(|| self.metres.total_cmp(&other.metres))
            .then_with(|| self.ids.cmp(&other.ids))
    }
}

/// Finds pairs, the closest first: whoever is closest to each other is a pair, again and again until
/// nobody is.
///
/// That is the greedy pairing by closeness, without a list of all possible pairs.
#[derive(Clone, Debug)]
pub(super) struct Pairing {
    one: Search,
    other: Search,
}

/// Those of a side that look for a pair.
#[derive(Clone, Debug)]
struct Search {
    /// Their places in the side's list, by when they were last perceived, and then by x.
    open: Vec<usize>,
    /// For each in the side's list, the closest of the other side.
    closest: Vec<Option<usize>>,
}

impl Search {
    fn new(capacity: usize) -> Self {
        Self { open: Vec::with_capacity(capacity), closest: Vec::with_capacity(capacity) }
    }

    fn begin(&mut self, things: &[Thing], looks: impl Fn(&Thing) -> bool) {
        self.open.clear();
        self.open.extend(things.iter().enumerate().filter(|(_, thing)| looks(thing)).map(|(index, _)| index));
        self.open.sort_unstable_by(|a, b| {
            let ((perceived_a, x_a), (perceived_b, x_b)) = (key(things, *a), key(things, *b));
            perceived_a.cmp(&perceived_b).then_with(|| x_a.total_cmp(&x_b))
        });
        self.closest.clear();
        self.closest.resize(things.len(), None);
    }

    /// Those that may be paired with a thing: within reach of it along x and perceived at the same
    /// instant, or all where there is no `reach_m`.
    fn near(&self, things: &[Thing], thing: &Thing, reach_m: Option<f64>) -> &[usize] {
        let Some(reach_m) = reach_m else { return &self.open };
        let (at_ns, x) = (thing.perceived_at_ns, x_of(thing));
        let is_before = |index: &usize| {
            let (perceived, other) = key(things, *index);
            perceived < at_ns || (perceived == at_ns && other < x - reach_m)
        };
        let is_within = |index: &usize| {
            let (perceived, other) = key(things, *index);
            perceived < at_ns || (perceived == at_ns && other <= x + reach_m)
        };
        let (from, to) = (self.open.partition_point(is_before), self.open.partition_point(is_within));
        self.open.get(from..to).unwrap_or(&[])
    }
}

fn key(things: &[Thing], index: usize) -> (u64, f64) {
    things.get(index).map_or((0, f64::NEG_INFINITY), |thing| (thing.perceived_at_ns, x_of(thing)))
}

/// What has no place stands before everything, and near nothing that has one.
fn x_of(thing: &Thing) -> f64 {
    thing.place_m.map_or(f64::NEG_INFINITY, |[x, ..]| x)
}

impl Pairing {
    pub(super) fn new(capacity: usize) -> Self {
        Self { one: Search::new(capacity), other: Search::new(capacity) }
    }

    /// Pairs those that were last perceived at one instant and are closer than the threshold.
    pub(super) fn by_observation(&mut self, measure: &Measure, one: &mut [Thing], other: &mut [Thing]) {
        self.run(
            Some(measure.reach_m),
            one,
            other,
            |thing| !thing.is_sure,
            |one, other| {
                if one.perceived_at_ns != other.perceived_at_ns {
                    return None;
                }
                Some(Closeness::new(measure.distance(one, other)?, 0.0, one, other))
            },
        );
    }

    /// Pairs those without a pair that are alike and could not have been observed at once.
    pub(super) fn by_likeness(
        &mut self,
        measure: &Measure,
        began_at_ns: u64,
        one: &mut [Thing],
        other: &mut [Thing],
    ) {
        self.run(
            None,
            one,
            other,
            |thing| thing.pair.is_none(),
            |one, other| {
                let apart_in_time =
                    one.born_at_ns > other.perceived_at_ns || other.born_at_ns > one.perceived_at_ns;
                let earlier = one.born_at_ns < began_at_ns && other.born_at_ns < began_at_ns;
                if !apart_in_time && !earlier {
                    return None;
                }
                let metres =
                    one.place_m.zip(other.place_m).map_or(0.0, |(one, other)| distance(&one, &other));
                Some(Closeness::new(measure.likeness(one, other)?, metres, one, other))
            },
        );
    }

    fn run(
        &mut self,
        reach_m: Option<f64>,
        one: &mut [Thing],
        other: &mut [Thing],
        looks: impl Fn(&Thing) -> bool,
        closeness: impl Fn(&Thing, &Thing) -> Option<Closeness>,
    ) {
        self.one.begin(one, &looks);
        self.other.begin(other, &looks);
        loop {
            find(&mut self.one, one, &self.other, other, reach_m, |one, other| closeness(one, other));
            find(&mut self.other, other, &self.one, one, reach_m, |other, one| closeness(one, other));
            let mut found = false;
            for &i in &self.one.open {
                let Some(j) = self.one.closest.get(i).copied().flatten() else { continue };
                if self.other.closest.get(j).copied().flatten() == Some(i) {
                    marry(i, j, one, other);
                    found = true;
                }
            }
            if !found {
                return;
            }
            let is_open = |things: &[Thing], closest: &[Option<usize>], index: usize| {
                let waits = closest.get(index).is_some_and(Option::is_some);
                waits && things.get(index).is_some_and(&looks)
            };
            let Search { open, closest } = &mut self.one;
            open.retain(|index| is_open(one, closest, *index));
            let Search { open, closest } = &mut self.other;
            open.retain(|index| is_open(other, closest, *index));
        }
    }
}

/// Finds for each of `who` that looks the closest of `whom` that looks.
fn find(
    who: &mut Search,
    things: &[Thing],
    whom: &Search,
    others: &[Thing],
    reach_m: Option<f64>,
    closeness: impl Fn(&Thing, &Thing) -> Option<Closeness>,
) {
    let Search { open, closest } = who;
    for &index in open.iter() {
        let Some(thing) = things.get(index) else { continue };
        let near = whom.near(others, thing, reach_m).iter();
        let best = near
            .filter_map(|&candidate| Some((closeness(thing, others.get(candidate)?)?, candidate)))
            .min_by(|a, b| a.0.order(&b.0));
        if let Some(slot) = closest.get_mut(index) {
            *slot = best.map(|(_, candidate)| candidate);
        }
    }
}

/// The two are of one thing, as was just observed; whatever each was paired with is not.
fn marry(i: usize, j: usize, one: &mut [Thing], other: &mut [Thing]) {
    let left = one.get(i).and_then(|thing| thing.pair).filter(|left| *left != j);
    if let Some(thing) = left.and_then(|left| other.get_mut(left)) {
        thing.pair = None;
    }
    let left = other.get(j).and_then(|thing| thing.pair).filter(|left| *left != i);
    if let Some(thing) = left.and_then(|left| one.get_mut(left)) {
        thing.pair = None;
    }
    for (things, index, pair) in [(one, i, j), (other, j, i)] {
        if let Some(thing) = things.get_mut(index) {
            (thing.pair, thing.is_sure) = (Some(pair), true);
        }
    }
}

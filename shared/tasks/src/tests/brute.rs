//! An independent implementation of the hypothesis languages: it enumerates every hypothesis over a world of two
//! features, from the definitions alone.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

use super::{snapshot, view};
use crate::{
    Effect, FeatureWords, HypothesisLanguage, Language, Learning, Noise, Object, Relation, Rule, Selection,
    Settings, Signature, StateWords, View,
};

const VALUES: [[&str; 3]; 2] = [["red", "green", "blue"], ["square", "triangle", "long"]];

/// Value indices of the two features.
type Kind = [usize; 2];

/// An object: its kind, its position, whether it was marked before and whether it is marked after.
#[derive(Clone, Copy, Debug)]
struct Thing {
    kind: Kind,
    place: [f64; 2],
    was: bool,
    is: bool,
}

fn language() -> Language {
    let feature = |percept: u16, name: &str| FeatureWords {
        percept,
        name: name.to_owned(),
        values: VALUES[usize::from(percept) - 1].map(str::to_owned).to_vec(),
    };
    Language {
        features: vec![feature(1, "colour"), feature(2, "shape")],
        states: vec![StateWords { percept: 3, name: "marked".to_owned() }],
        position: 0,
        orientation: None,
        extents: None,
        moved_m: 0.03,
    }
}

fn marked() -> Signature {
    Signature::from([Effect::State { name: "marked".to_owned(), on: true }])
}

fn seen_as(things: &[Thing]) -> View {
    let objects = |after: bool| {
        let object = |(id, thing): (u64, &Thing)| Object {
            id,
            features: BTreeMap::from([
                ("colour".to_owned(), VALUES[0][thing.kind[0]].to_owned()),
                ("shape".to_owned(), VALUES[1][thing.kind[1]].to_owned()),
            ]),
            states: BTreeMap::from([("marked".to_owned(), if after { thing.is } else { thing.was })]),
            position_m: Some([thing.place[0], thing.place[1], 0.0]),
            ..Object::default()
        };
        (0..).zip(things).map(object).collect()
    };
    view(0, objects(false), objects(true))
}

/// A hypothesis by its extension: the kinds that it covers.
#[derive(Clone, Debug)]
struct Candidate {
    /// Among the kinds made of the values seen.
    cells: BTreeSet<Kind>,
    selection: Selection,
    log_prior: f64,
}

fn values_seen(world: &[Vec<Thing>]) -> [Vec<usize>; 2] {
    [0, 1].map(|feature| {
        let values: BTreeSet<usize> = world.iter().flatten().map(|thing| thing.kind[feature]).collect();
        values.into_iter().collect()
    })
}

fn cells(world: &[Vec<Thing>]) -> Vec<Kind> {
    let [colours, shapes] = values_seen(world);
    colours.iter().flat_map(|&colour| shapes.iter().map(move |&shape| [colour, shape])).collect()
}

fn subsets<T: Clone>(of: &[T]) -> impl Iterator<Item = Vec<T>> {
    (1..1_usize << of.len())
        .map(|bits| (0..of.len()).filter(|bit| bits >> bit & 1 == 1).map(|bit| of[bit].clone()).collect())
}

/// The values of a kind for the features of a template.
fn project(template: [bool; 2], kind: Kind) -> [Option<usize>; 2] {
    [0, 1].map(|feature| template[feature].then_some(kind[feature]))
}

const TEMPLATES: [[bool; 2]; 4] = [[false, false], [true, false], [false, true], [true, true]];

/// Every simple disjunction of the classes in `among`, with the prior by λ, μ and |E| = 1.
fn disjunctions(world: &[Vec<Thing>], settings: &Settings) -> Vec<Candidate> {
    let mut all = Vec::new();
    for template in TEMPLATES {
        let classes: BTreeSet<_> =
            world.iter().flatten().map(|thing| project(template, thing.kind)).collect();
        let features = template.iter().filter(|has| **has).count() + 1;
        for chosen in subsets(&classes.into_iter().collect::<Vec<_>>()) {
            let more = quantity::number::float_of_count(chosen.len() - 1);
            all.push(Candidate {
                cells: cells(world)
                    .into_iter()
                    .filter(|&kind| chosen.contains(&project(template, kind)))
                    .collect(),
                selection: Selection::All,
                log_prior: -settings.prior.lambda * more
                    + settings.prior.mu * quantity::number::float_of_count(features),
            });
        }
    }
    all
}

/// Under each template, the classes of the changed objects of each demonstration and of all of them.
fn expanded(world: &[Vec<Thing>], prior: impl Fn(usize, usize) -> Option<f64>) -> Vec<Candidate> {
    let mut all = Vec::new();
    for template in TEMPLATES {
        let classes = |things: &[Thing]| -> BTreeSet<[Option<usize>; 2]> {
            let changed = things.iter().filter(|thing| thing.is && !thing.was);
            changed.map(|thing| project(template, thing.kind)).collect()
        };
        let mut sets: BTreeSet<_> = world.iter().map(|things| classes(things)).collect();
        sets.insert(classes(&world.concat()));
        for chosen in sets.into_iter().filter(|set| !set.is_empty()) {
            let features = template.iter().filter(|has| **has).count();
            let Some(log_prior) = prior(chosen.len(), features) else { continue };
            let of = |kind: &Kind| chosen.contains(&project(template, *kind));
            all.push(Candidate {
                cells: cells(world).into_iter().filter(of).collect(),
                selection: Selection::All,
                log_prior,
            });
        }
    }
    all
}

/// The extended language: every description of cost 4 at most, and selections from the short ones.
fn extended(world: &[Vec<Thing>], settings: &Settings) -> Vec<Candidate> {
    type Literal = (usize, usize, bool);
    let holds = |(feature, value, negated): Literal, kind: Kind| (kind[feature] == value) != negated;
    let implies = |a: Literal, b: Literal| a == b || (a.0 == b.0 && !a.2 && b.2 && a.1 != b.1);
    let seen = values_seen(world);
    let literals: Vec<Literal> = (0..2)
        .flat_map(|feature| {
            seen[feature].iter().flat_map(move |&value| [(feature, value, false), (feature, value, true)])
        })
        .collect();
    let mut terms: Vec<Vec<Literal>> = literals.iter().map(|&one| vec![one]).collect();
    terms.extend(
        literals.iter().filter(|one| one.0 == 0).flat_map(|&one| {
            literals.iter().filter(|other| other.0 == 1).map(move |&other| vec![one, other])
        }),
    );
    let cost = |term: &[Literal]| term.iter().map(|literal| 1 + usize::from(literal.2)).sum::<usize>();
    let term_implies =
        |a: &[Literal], b: &[Literal]| b.iter().all(|&wanted| a.iter().any(|&given| implies(given, wanted)));
    let mut sets: Vec<(usize, Vec<Vec<Literal>>)> = vec![(0, vec![Vec::new()])];
    // Up to four terms, each later in the list than the one before.
    let mut begun: Vec<(usize, usize, Vec<Vec<Literal>>)> = vec![(0, 0, Vec::new())];
    while let Some((from, spent, set)) = begun.pop() {
        for (index, term) in terms.iter().enumerate().skip(from) {
            let spent = spent + cost(term);
            let is_said = set.iter().any(|other| term_implies(other, term) || term_implies(term, other));
            if spent <= 4 && !is_said {
                let grown: Vec<Vec<Literal>> = set.iter().chain([term]).cloned().collect();
                sets.push((spent, grown.clone()));
                begun.push((index + 1, spent, grown));
            }
        }
    }
    let numbers = (1..=7).map(Selection::Exactly).chain((1..=3).map(Selection::AllBut));
    let selections: Vec<Selection> = numbers.chain(Relation::ALL.map(Selection::Relation)).collect();
    let mut all = Vec::new();
    for (cost, set) in sets {
        let of = |kind: &Kind| set.iter().any(|term| term.iter().all(|&literal| holds(literal, *kind)));
        let cells: BTreeSet<Kind> = cells(world).into_iter().filter(of).collect();
        let log_prior = -quantity::number::float_of_count(cost);
        let selected = selections.iter().filter(|_| cost <= 2);
        let selected = selected.map(|&selection| (selection, log_prior - settings.selection_nats));
        all.extend(
            [(Selection::All, log_prior)]
                .into_iter()
                .chain(selected)
                .map(|(selection, log_prior)| Candidate { cells: cells.clone(), selection, log_prior }),
        );
    }
    all
}

/// The sets of objects that a hypothesis selects in a demonstration: with a number, every choice that it allows.
fn choices(candidate: &Candidate, things: &[Thing]) -> Vec<Vec<bool>> {
    let member: Vec<bool> = things.iter().map(|thing| candidate.cells.contains(&thing.kind)).collect();
    let inside: Vec<usize> = (0..things.len()).filter(|&index| member[index]).collect();
    let any_of = |count: usize| -> Vec<Vec<bool>> {
        let done = inside.iter().filter(|&&index| things[index].was).count();
        let free: Vec<usize> = inside.iter().copied().filter(|&index| !things[index].was).collect();
        let need = count.saturating_sub(done).min(free.len());
        let picked = subsets(&free).filter(|picked| picked.len() == need);
        let nothing = (need == 0).then(Vec::new);
        picked
            .chain(nothing)
            .map(|picked| (0..things.len()).map(|index| picked.contains(&index)).collect())
            .collect()
    };
    match candidate.selection {
        Selection::All => vec![member],
        Selection::Exactly(count) if count <= inside.len() => any_of(count),
        Selection::AllBut(count) if count < inside.len() => any_of(inside.len() - count),
        Selection::Exactly(_) | Selection::AllBut(_) => Vec::new(),
        Selection::Relation(relation) => {
            let left = |index: &usize| things[*index].place[1];
            let away = |index: &usize| things[*index].place[0].hypot(things[*index].place[1]);
            let min = |of: &dyn Fn(&usize) -> f64| inside.iter().map(of).fold(f64::INFINITY, f64::min);
            let max = |of: &dyn Fn(&usize) -> f64| inside.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
            let middle = f64::midpoint(min(&away), max(&away));
            let stands = |index: usize| match relation {
                Relation::Leftmost => left(&index) > max(&left) - 1e-6,
                Relation::Rightmost => left(&index) < min(&left) + 1e-6,
                Relation::Nearest => away(&index) < min(&away) + 1e-6,
                Relation::Farthest => away(&index) > max(&away) - 1e-6,
                Relation::Left => left(&index) > 1e-6,
                Relation::Right => left(&index) < -1e-6,
                Relation::Near => away(&index) < middle - 1e-6,
                Relation::Far => away(&index) > middle + 1e-6,
                Relation::Between => left(&index) < max(&left) - 1e-6 && left(&index) > min(&left) + 1e-6,
            };
            vec![(0..things.len()).map(|index| member[index] && stands(index)).collect()]
        }
    }
}

fn slips(choice: &[bool], things: &[Thing]) -> usize {
    let bore_witness = choice.iter().zip(things).filter(|(_, thing)| !thing.was);
    bore_witness.filter(|(chosen, thing)| **chosen != thing.is).count()
}

/// P(D|h).
fn likelihood(candidate: &Candidate, world: &[Vec<Thing>], settings: &Settings) -> f64 {
    let noise = settings.noise.get();
    let count = quantity::number::float_of_count;
    if noise == 0.0 {
        let is_consistent =
            |things: &&Vec<Thing>| choices(candidate, things).iter().any(|one| slips(one, things) == 0);
        return count(world.iter().filter(is_consistent).count()) / count(world.len());
    }
    let of_one = |things: &Vec<Thing>| {
        let choices = choices(candidate, things);
        let witnesses = things.iter().filter(|thing| !thing.was).count();
        let each = choices.iter().map(|choice| {
            let slips = slips(choice, things);
            noise.powi(i32::try_from(slips).unwrap())
                * (1.0 - noise).powi(i32::try_from(witnesses - slips).unwrap())
        });
        if choices.is_empty() { 0.0 } else { each.sum::<f64>() / count(choices.len()) }
    };
    world.iter().map(of_one).product()
}

fn hypotheses(world: &[Vec<Thing>], settings: &Settings) -> Vec<Candidate> {
    let count = quantity::number::float_of_count;
    match (settings.language, settings.noise > Noise::NONE) {
        (HypothesisLanguage::Paper, true) => disjunctions(world, settings),
        (HypothesisLanguage::Paper, false) => expanded(world, |classes, features| {
            Some(-settings.prior.lambda * count(classes - 1) + settings.prior.mu * count(features + 1))
        }),
        (HypothesisLanguage::Extended, slips) => {
            let long = expanded(world, |classes, features| {
                (classes * features > 4).then(|| -count(classes * features))
            });
            let short = extended(world, settings);
            if slips { short } else { short.into_iter().chain(long).collect() }
        }
    }
}

/// The posterior, summed over hypotheses with the same extension.
fn posterior(world: &[Vec<Thing>], settings: &Settings) -> BTreeMap<(Selection, BTreeSet<Kind>), f64> {
    let mut sums: BTreeMap<(Selection, BTreeSet<Kind>), f64> = BTreeMap::new();
    let mut total = 0.0;
    for candidate in hypotheses(world, settings) {
        let weight = likelihood(&candidate, world, settings) * candidate.log_prior.exp();
        total += weight;
        *sums.entry((candidate.selection, candidate.cells)).or_default() += weight;
    }
    sums.into_iter()
        .map(|(meaning, weight)| (meaning, if total > 0.0 { weight / total } else { 0.0 }))
        .collect()
}

fn things(max: usize) -> impl Strategy<Value = Vec<Thing>> {
    let place = (1..5_i32, -3..4_i32).prop_map(|(x, y)| [f64::from(x) * 0.1, f64::from(y) * 0.1]);
    let thing = (0..3_usize, 0..3_usize, place, prop::bool::weighted(0.1), any::<bool>());
    let thing = thing.prop_map(|(colour, shape, place, was, is)| Thing {
        kind: [colour, shape],
        place,
        was,
        is: was || is,
    });
    prop::collection::vec(thing, 1..max)
}

fn worlds() -> impl Strategy<Value = Vec<Vec<Thing>>> {
    prop::collection::vec(things(6), 1..4).prop_filter("something is marked", |world| {
        world.iter().flatten().any(|thing| thing.is && !thing.was)
    })
}

fn all_settings() -> Vec<Settings> {
    let slips = Noise::try_from(0.1).unwrap();
    let both = [HypothesisLanguage::Paper, HypothesisLanguage::Extended];
    both.into_iter()
        .flat_map(|language| {
            [Noise::NONE, slips].map(|noise| Settings { language, noise, ..Settings::default() })
        })
        .collect()
}

/// The kinds, made of the values seen, that a rule covers.
fn cells_of(rule: &Rule, world: &[Vec<Thing>]) -> BTreeSet<Kind> {
    let is_about = |kind: &Kind| {
        let thing = Thing { kind: *kind, place: [0.1, 0.0], was: false, is: false };
        rule.is_about(&seen_as(&[thing]).after.objects[0])
    };
    cells(world).into_iter().filter(is_about).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_posterior_of_every_rule_equals_a_full_enumeration(world in worlds()) {
        for settings in all_settings() {
            let mut learning = Learning::new(&language(), &settings);
            world.iter().for_each(|things| learning.add(&seen_as(things)));
            let rules = learning.rules(&marked());
            let expected = posterior(&world, &settings);
            let mut found: BTreeMap<(Selection, BTreeSet<Kind>), f64> = BTreeMap::new();
            for rule in &rules {
                let meaning = (rule.selection, cells_of(rule, &world));
                prop_assert!(found.insert(meaning, rule.standing.posterior).is_none(), "{} twice, {settings:?}", rule.name);
            }
            for (meaning, &probability) in expected.iter().filter(|((_, cells), _)| !cells.is_empty()) {
                let found = found.get(meaning).copied().unwrap_or(0.0);
                prop_assert!((found - probability).abs() < 1e-7, "{meaning:?}: {found} for {probability}, {settings:?}");
            }
            for (meaning, &probability) in &found {
                let expected = expected.get(meaning).copied().unwrap_or(0.0);
                prop_assert!((expected - probability).abs() < 1e-7, "{meaning:?}: {probability} for {expected}, {settings:?}");
            }
        }
    }

    #[test]
    fn predictions_are_the_posterior_of_the_hypotheses_that_are_about_the_thing(
        world in worlds(),
        asked in things(4),
    ) {
        let kinds = world.iter().flatten().map(|thing| thing.kind).collect::<BTreeSet<Kind>>();
        let asked: Vec<Thing> = asked.into_iter().filter(|thing| kinds.contains(&thing.kind)).collect();
        let asked: Vec<Thing> = asked.into_iter().map(|thing| Thing { was: false, is: false, ..thing }).collect();
        for settings in all_settings() {
            let mut expected = vec![0.0; asked.len()];
            for ((selection, cells), probability) in posterior(&world, &settings) {
                let candidate = Candidate { cells, selection, log_prior: 0.0 };
                let inside = asked.iter().filter(|thing| candidate.cells.contains(&thing.kind)).count();
                let mut choices = choices(&candidate, &asked);
                if choices.is_empty() && matches!(selection, Selection::Exactly(_)) {
                    // Too few objects for the number: all of them.
                    choices = vec![asked.iter().map(|thing| candidate.cells.contains(&thing.kind)).collect()];
                }
                prop_assert!(inside == 0 || !choices.is_empty() || matches!(selection, Selection::AllBut(_)));
                let share = probability / quantity::number::float_of_count(choices.len().max(1));
                for choice in choices {
                    for (sum, chosen) in expected.iter_mut().zip(choice) {
                        *sum += if chosen { share } else { 0.0 };
                    }
                }
            }
            let mut learning = Learning::new(&language(), &settings);
            world.iter().for_each(|things| learning.add(&seen_as(things)));
            let found = learning.probabilities(&marked(), &snapshot(seen_as(&asked).after.objects));
            for (found, expected) in found.iter().zip(&expected) {
                let found = found.unwrap();
                prop_assert!((found - expected).abs() < 1e-6, "{found} for {expected}, {settings:?}");
            }
        }
    }
}

/// A pseudo-random number in [0, 1) from the deterministic runner.
fn chance(runner: &mut TestRunner) -> f64 {
    (0.0..1.0_f64).new_tree(runner).unwrap().current()
}

/// Draws an item with a probability proportional to its weight.
fn drawn<T>(items: Vec<(f64, T)>, runner: &mut TestRunner) -> T {
    let mut rest = chance(runner) * items.iter().map(|(weight, _)| weight).sum::<f64>();
    let mut last = None;
    for (weight, item) in items {
        if rest < weight {
            return item;
        }
        rest -= weight;
        last = Some(item);
    }
    last.unwrap()
}

/// A simulated teacher draws a rule from the prior, demonstrates it, and mislabels objects at the rate of the noise.
/// Predictions of probability p must come true in a share p of the cases.
#[test]
fn the_posterior_is_calibrated_under_its_own_model() {
    for language_of in [HypothesisLanguage::Paper, HypothesisLanguage::Extended] {
        let noise = Noise::try_from(0.1).unwrap();
        let settings = Settings { language: language_of, noise, ..Settings::default() };
        let mut runner = TestRunner::deterministic();
        // For each tenth of the probability: count, sum of the probabilities, number of times it held.
        let mut tenths = [(0_usize, 0.0, 0.0); 10];
        for _ in 0..3000 {
            let strategy = prop::collection::vec(things(6), 2..4);
            let mut world = strategy.new_tree(&mut runner).unwrap().current();
            world.iter_mut().flatten().for_each(|thing| (thing.was, thing.is) = (false, false));
            let is_possible = |candidate: &Candidate| {
                let is_possible = |things: &Vec<Thing>| !choices(candidate, things).is_empty();
                !candidate.cells.is_empty() && world.iter().all(is_possible)
            };
            let candidate = hypotheses(&world, &settings).into_iter().filter(is_possible);
            let candidate = drawn(
                candidate.map(|candidate| (candidate.log_prior.exp(), candidate)).collect(),
                &mut runner,
            );
            for things in &mut world {
                let choices = choices(&candidate, things).into_iter().map(|choice| (1.0, choice)).collect();
                for (thing, chosen) in things.iter_mut().zip(drawn(choices, &mut runner)) {
                    thing.is = chosen != (chance(&mut runner) < noise.get());
                }
            }
            let mut learning = Learning::new(&language(), &settings);
            world.iter().for_each(|things| learning.add(&seen_as(things)));
            // The query is the first scene again.
            let asked: Vec<Thing> =
                world[0].iter().map(|thing| Thing { was: false, is: false, ..*thing }).collect();
            let answers = learning.probabilities(&marked(), &snapshot(seen_as(&asked).after.objects));
            // Without a change there is no goal to ask about.
            let Some(probability) = answers[0] else { continue };
            let choices = choices(&candidate, &asked).into_iter().map(|choice| (1.0, choice)).collect();
            let tenth = &mut tenths[quantity::number::floor_usize(probability * 9.999)];
            tenth.0 += 1;
            tenth.1 += probability;
            tenth.2 += if drawn(choices, &mut runner)[0] { 1.0 } else { 0.0 };
        }
        let mut looked_at = 0;
        for (count, said, held) in tenths.into_iter().filter(|(count, ..)| *count >= 30) {
            let count = quantity::number::float_of_count(count);
            let (said, held) = (said / count, held / count);
            let deviation = (said * (1.0 - said) / count).sqrt();
            assert!(
                (said - held).abs() < 4.0 * deviation + 0.005,
                "{language_of:?}: {said} said, {held} held: {tenths:?}"
            );
            looked_at += 1;
        }
        assert!(looked_at >= 4, "{tenths:?}");
    }
}

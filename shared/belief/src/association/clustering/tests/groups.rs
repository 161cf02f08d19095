//! Frames of several sources in one step.

use super::*;

/// What one source reports of each of some things if it sees it: whether the colour is recognised, and the offset from
/// the thing's position.
type Glances = Vec<Option<(bool, [i8; 3])>>;

fn can_associate_by_summary(max_mm: i8) -> impl Strategy<Value = Glances> {
    prop::sample::select(vec![0.95, 0.95, 0.9, 0.3]).prop_flat_map(move |seen| {
        let beside = prop::array::uniform3(prop_oneof![Just(0), -max_mm..=max_mm]);
        prop::collection::vec(prop::option::weighted(seen, (prop::bool::weighted(0.9), beside)), 12)
    })
}

/// Steps with frames of several sources at once, their delay, and whether the beliefs are settled.
fn several_at_once() -> impl Strategy<Value = Vec<(Vec<Glances>, u64, bool)>> {
    let late = prop::sample::select(vec![0_u64, 0, 0, 4, 30, 50, 80]);
    let how = (prop::sample::select(vec![2_i8, 2, 8, 40]), prop::sample::select(vec![2_usize, 2, 3, 10]));
    how.prop_flat_map(move |(max_mm, sources)| {
        let sources = prop::collection::vec(can_associate_by_summary(max_mm), 1..=sources);
        prop::collection::vec((sources, late.clone(), prop::bool::weighted(0.95)), 2..14)
    })
}

#[test]
fn simultaneous_detections_are_merged_by_group_as_in_the_paper() {
    let (grouped, looped) = (Cell::new(0), Cell::new(0));
    let threshold = prop::sample::select(vec![0.06, 0.11, 0.15, 0.16, 0.3]);
    let turns = prop::option::weighted(0.3, 0.01..0.5_f64);
    let colours = prop::collection::vec(0..3_u16, 12);
    let all = ((1..8_i8, several_at_once()), threshold, turns, prop::bool::weighted(0.2), colours);
    let mut runner = TestRunner::new(ProptestConfig::with_cases(3_000));
    let outcome = runner.run(&all, |((pitch, steps), threshold, turns, normalised, colours)| {
        let mut percepts = remembered();
        percepts.belief.threshold = threshold;
        percepts.belief.normalised = normalised;
        let percept = percepts.index("orientation").unwrap();
        let turns = turns.map(|weight| Distance { percept, measure: Measure::AngleRad, weight });
        percepts.belief.distance.extend(turns);
        let mut twins = Twins::new(percepts);
        for (at, (sources, late, is_clustered)) in (1..).zip(steps) {
            let of_source = |(group, can_associate_by_summary): (usize, &Glances)| -> Vec<Seen> {
                let things = (0_i8..).zip(can_associate_by_summary).zip(&colours);
                let seen = things.filter_map(|((index, beside), colour)| {
                    let (is_made_out, beside_mm) = (*beside)?;
                    Some(Seen {
                        place: Some([pitch * (index % 4), pitch * (index / 4), 0]),
                        beside_mm,
                        turn: Some(beside_mm[0] % 2),
                        colour: is_made_out.then_some(*colour),
                        confidence: 0.9,
                        group,
                        ..Seen::default()
                    })
                });
                seen.collect()
            };
            let seen: Vec<_> = sources.iter().enumerate().flat_map(of_source).collect();
            let [expected, merged] = twins.step_late(5 * at, late, &seen, is_clustered);
            prop_assert_eq!(merged, expected);
            let [expected, contents] = twins.contents();
            prop_assert_eq!(contents, expected);
            let which = if twins.grouped { &grouped } else { &looped };
            which.set(which.get() + 1);
        }
        Ok(())
    });
    outcome.unwrap();
    assert!(grouped.get() > 1_000 && looped.get() > 1_000, "grouped {grouped:?}, looped {looped:?}");
    eprintln!("grouped {grouped:?}, looped {looped:?}");
}

#[test]
fn more_sources_than_it_remembers_are_merged_as_in_the_paper() {
    let mut twins = Twins::new(remembered());
    // A belief detected by ten sources evicts the interval of the first one, which also detected another thing beside
    // it.
    let mut seen: Vec<_> = (0..10).map(|group| alike(0, group)).collect();
    seen.insert(1, alike(2, 0));
    assert_eq!(twins.step(1, &seen, true), [10, 10]);
    assert!(!twins.grouped);
}

#[test]
fn a_removed_newest_sample_is_merged_as_in_the_paper() {
    let at = |beside_mm, group| Seen { beside_mm: [beside_mm, 0, 0], ..alike(0, group) };
    let mut twins = Twins::new(remembered());
    assert_eq!(twins.step(1, &[at(40, 0)], true), [0, 0]);
    // Half way.
    assert_eq!(twins.step(2, &[Seen { confidence: 0.8, ..at(80, 0) }], true), [1, 1]);
    let other = |group| Seen { place: Some([20, 0, 0]), ..at(0, group) };
    assert_eq!(twins.step(3, &[at(-95, 0), other(0)], true), [0, 0]);
    // Two sources report, at the instant of the second step, a detection at the first belief. The belief moves to the
    // middle between that and its earlier position, which brings it into the gate of the other.
    let [expected, merged] = twins.step_late(4, 20, &[at(60, 1), other(2)], true);
    assert_eq!((merged, expected), (3, 3));
    assert!(!twins.grouped);
}

#[test]
fn a_lacking_oldest_symbol_is_merged_as_in_the_paper() {
    let mut twins = Twins::new(remembered());
    let at = |mm: i8, colour, group| Seen { beside_mm: [mm, 0, 0], colour, ..alike(0, group) };
    assert_eq!(twins.step(1, &[at(0, Some(0), 0), at(90, Some(1), 0)], true), [0, 0]);
    // The colour of neither is recognised; they are nearer to each other than to the beliefs beside them.
    assert_eq!(twins.step(2, &[at(40, None, 0), at(50, None, 1)], true), [2, 2]);
    let [expected, contents] = twins.contents();
    assert_eq!(contents, expected);
}

#[test]
fn orientations_with_a_wrong_norm_are_merged_as_in_the_paper() {
    let mut percepts = remembered();
    let percept = percepts.index("orientation").unwrap();
    percepts.belief.distance.push(Distance { percept, measure: Measure::AngleRad, weight: 0.5 });
    let mut twins = Twins::new(percepts);
    // The largest error of the norm that a sound observation may have.
    let at =
        |mm: i8, norm_off, group| Seen { beside_mm: [mm, 0, 0], turn: Some(0), norm_off, ..alike(0, group) };
    assert_eq!(twins.step(1, &[at(0, 0.0095, 0), at(100, 0.0095, 0)], true), [0, 0]);
    assert_eq!(twins.step(2, &[at(10, 0.0095, 0), at(20, -0.0094, 1)], true), [2, 2]);
    let [expected, contents] = twins.contents();
    assert_eq!(contents, expected);
}

//! Plug-in functions.

use std::sync::Arc;

use crate::CullContext;
use crate::percepts::{Cull, History, Measure};

use super::*;

/// A plug-in history that keeps the highest number.
struct Highest;

impl crate::History for Highest {
    fn samples(&self) -> usize {
        1
    }

    fn take(&self, kept: &mut crate::Samples<'_>, sample: &Sample) {
        let number = |sample: &Sample| match sample.feature {
            Feature::Number(number) => number,
            Feature::None | Feature::Symbol(_) | Feature::Vector(_) | Feature::Orientation(_) => {
                f32::NEG_INFINITY
            }
        };
        if kept.as_slice().first().is_none_or(|highest| number(highest) < number(sample)) {
            kept.clear();
            assert!(kept.push(*sample) && !kept.push(*sample), "there is room for one");
        }
    }

    fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample> {
        kept.first().copied().filter(|sample| sample.at <= instant)
    }
}

/// A history that returns invalid evaluations.
struct Nonsense;

impl crate::History for Nonsense {
    fn samples(&self) -> usize {
        2
    }

    fn take(&self, kept: &mut crate::Samples<'_>, sample: &Sample) {
        kept.push(Sample { confidence: 7.0, ..*sample });
    }

    fn at(&self, kept: &[Sample], _instant: Instant) -> Option<Sample> {
        kept.first().copied()
    }
}

/// A plug-in culling function: not held, observed once, and in view.
struct Fleeting;

impl crate::Cull for Fleeting {
    fn agrees(&self, belief: &CullContext<'_>) -> bool {
        let is_filled = belief.percept(Percepts::builtin().index("filled").unwrap());
        assert!(is_filled.is_some_and(|filled| filled.confidence <= 0.9));
        assert!(belief.place_m().is_some() && belief.born_at() <= belief.perceived_at());
        belief.held_by() == NOBODY
            && belief.observations() == 1
            && belief.now() > belief.perceived_at()
            && belief.is_in_view() == Some(true)
    }
}

fn functions() -> BeliefPlugins {
    let mut functions = BeliefPlugins::default();
    functions.culls.push(("fleeting".to_owned(), Arc::new(Fleeting)));
    functions.histories.push(("highest".to_owned(), Arc::new(Highest)));
    functions.histories.push(("nonsense".to_owned(), Arc::new(Nonsense)));
    functions
}

#[test]
fn a_plugin_culling_function_is_evaluated_among_the_others() {
    let mut percepts = Percepts::builtin();
    percepts.belief.cull = vec![Cull::Plugin("fleeting".to_owned())];
    let mut robot = Robot::new(&Percepts::builtin());
    robot.system = BeliefSystem::with_plugins(&percepts, &functions(), 16).unwrap();
    let (often, once) = ([0.5, 0.0, 0.0], [0.5, 0.5, 0.0]);
    robot.see(ms(0), &[block(ms(0), often, RED), block(ms(0), once, RED)], true);
    assert_eq!(robot.ids(), [1, 2]);
    robot.see(ms(5), &[block(ms(5), often, RED)], false);
    assert_eq!(robot.ids(), [1, 2], "out of view");
    robot.see(ms(10), &[], true);
    assert_eq!(robot.ids(), [1]);
}

#[test]
fn a_plugin_history_decides_what_is_remembered() {
    let mut percepts = Percepts::builtin();
    let (filled, marked) = (percepts.index("filled").unwrap(), percepts.index("marked").unwrap());
    percepts.percepts[usize::from(filled)].history = History::Plugin("highest".to_owned());
    percepts.percepts[usize::from(marked)].history = History::Plugin("nonsense".to_owned());
    let mut robot = Robot::new(&Percepts::builtin());
    robot.system = BeliefSystem::with_plugins(&percepts, &functions(), 16).unwrap();
    for (step, degree) in [0.25, 1.0, 0.5].into_iter().enumerate() {
        let now = ms(5 * u64::try_from(step).unwrap());
        let mut seen = block(now, [0.5, 0.0, 0.0], RED);
        seen.set_state(State::Filled, degree);
        seen.set_state(State::Marked, 1.0);
        robot.see(now, &[seen], true);
    }
    let belief = robot.system.beliefs().next().unwrap();
    let remembered = belief.percept(filled).unwrap();
    assert_eq!(remembered.feature(), Some(Feature::Number(1.0)));
    assert_eq!(remembered.sampled_at_ns, ms(5).as_nanos());
    // Its confidence has decayed since.
    assert!(remembered.confidence < 0.9 && remembered.confidence > 0.89);
    assert!(belief.percept(marked).is_none(), "nonsense is nothing");
    // Before the first sample there is no evaluation, and a reused row holds no old data.
    assert!(robot.system.write(0, ms(0)).unwrap().percept(filled).is_none());
    for step in 0..200 {
        robot.see(ms(1000 + 5 * step), &[], true);
    }
    assert!(robot.ids().is_empty());
    for now in [3000, 3005, 3010].map(ms) {
        robot.see(now, &[block(now, [0.5, 0.0, 0.0], RED)], true);
    }
    let belief = robot.system.beliefs().next().unwrap();
    assert_eq!(belief.percept(filled).unwrap().feature(), Some(Feature::Number(0.0)));
}

#[test]
fn a_function_that_the_program_lacks_is_named() {
    let name = || "mine".to_owned();
    let said = |change: fn(&mut Percepts, String)| {
        let mut percepts = Percepts::builtin();
        change(&mut percepts, name());
        BeliefSystem::with_plugins(&percepts, &functions(), 16).unwrap_err().to_string()
    };
    let errors = [
        said(|percepts, name| percepts.belief.distance[0].measure = Measure::Plugin(name)),
        said(|percepts, name| percepts.belief.cull.push(Cull::Plugin(name))),
        said(|percepts, name| percepts.percepts[0].history = History::Plugin(name)),
    ];
    for (error, kind) in errors.iter().zip(["distance", "culling function", "history"]) {
        assert!(error.contains(&format!("{kind} `mine`")), "{error}");
    }
    insta::assert_snapshot!(errors.join("\n"));
}

//! Configurations that differ from the built-in one, selected by a byte. Shared by property tests and a fuzz
//! target.

use belief::percepts::{Cull, Distance, History, Measure, Percepts, WhenFull};
use clock::Duration;

/// The built-in percepts with other belief settings: literal or not, other histories, distance terms and
/// culling functions. Zero is the built-in configuration.
pub(crate) fn varied(choice: u8) -> Percepts {
    let mut percepts = Percepts::builtin();
    if choice & 1 > 0 {
        let _is_changed = percepts.belief.make_literal();
    }
    if choice & 2 > 0 {
        percepts.belief.normalised = !percepts.belief.normalised;
    }
    let history = match choice >> 2 & 3 {
        0 => None,
        1 => Some(History::Lossless { samples: 2.try_into().unwrap(), when_full: WhenFull::ForgetOldest }),
        2 => Some(History::Lossless { samples: 3.try_into().unwrap(), when_full: WhenFull::Thin }),
        _ => Some(History::LogTimescale { samples: 4.try_into().unwrap() }),
    };
    if let Some(history) = history {
        percepts.percepts.iter_mut().for_each(|percept| percept.history = history.clone());
    }
    let index = |name| percepts.index(name).unwrap();
    let term = |name, measure, weight| Distance { percept: index(name), measure, weight };
    let turned = term("orientation", Measure::AngleRad, 0.2);
    let large = term("extents", Measure::Metres, 2.0);
    let filled = term("filled", Measure::Difference, 0.3);
    let confident = Cull::ConfidenceBelow { percept: index("position"), floor: 0.5 };
    let unseen = Cull::UnseenLongerThan(Duration::from_millis(20));
    let terms = &mut percepts.belief.distance;
    match choice >> 4 & 3 {
        0 => {}
        // Symbols before the position, and every kind of term.
        1 => {
            terms.extend([turned, large, filled]);
            terms.reverse();
        }
        // No term for the position.
        2 => {
            terms.retain(|term| term.measure == Measure::Differs);
            terms.push(filled);
        }
        // Metric terms that are no position.
        _ => {
            terms.clear();
            terms.extend([large, turned]);
        }
    }
    match choice >> 6 {
        0 => {}
        1 => percepts.belief.cull = vec![confident],
        2 => percepts.belief.cull.push(confident),
        _ => percepts.belief.cull = vec![unseen],
    }
    percepts
}

//! The differences between two snapshots of one perspective.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::counterpart::match_nearest_first;
use super::snapshot::{Object, Snapshot};

/// One difference between before and after: an expectation percept of a goal belief.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Effect {
    /// A state was switched on or off.
    State {
        /// The state's name.
        name: String,
        /// Its new value.
        on: bool,
    },
    /// The object is in another place.
    Moved,
}

/// The expectation signature of a change: the state that a rule expects of every object it applies to.
///
/// If a state changed, the signature contains the states but not the displacement. So a block that was pushed
/// while its hole was filled has the same signature as one that was not.
pub type Signature = BTreeSet<Effect>;

/// The difference of one object between before and after.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// Its expectation signature.
    pub signature: Signature,
    /// Whether it is in another place as well.
    pub displaced: bool,
}

impl Change {
    /// The state changes alone; `None` if there are none.
    #[must_use]
    pub fn states(&self) -> Option<Self> {
        let states = self.signature.iter().filter(|effect| **effect != Effect::Moved);
        let signature: Signature = states.cloned().collect();
        (!signature.is_empty()).then_some(Self { signature, displaced: self.displaced })
    }
}

/// The changes between two snapshots of one perspective, by object identity.
///
/// Only net changes count. An object that is in one snapshot only did not change: that an object comes into view
/// is not an act. But a lost object is matched to a new one with the same class features and set of states:
/// objects do not vanish, so its identity was lost.
#[must_use]
pub fn changes(before: &Snapshot, after: &Snapshot, moved_m: f64) -> BTreeMap<u64, Change> {
    let lost = rematched(before, after);
    let mut changes = BTreeMap::new();
    for now in &after.objects {
        let then = before.object(now.id).or_else(|| before.object(*lost.get(&now.id)?));
        if let Some(change) = then.and_then(|then| change(then, now, moved_m)) {
            changes.insert(now.id, change);
        }
    }
    changes
}

/// The objects of a snapshot that are missing in a later one, by identity and by class features and set of
/// states. Their loss is not a change, but the learner should report it.
#[must_use]
pub fn vanished<'a>(before: &'a Snapshot, after: &Snapshot) -> Vec<&'a Object> {
    let found = rematched(before, after);
    let is_gone =
        |then: &&Object| after.object(then.id).is_none() && !found.values().any(|again| *again == then.id);
    before.objects.iter().filter(is_gone).collect()
}

/// New objects matched to lost ones of the same class features and set of states, nearest first.
fn rematched(before: &Snapshot, after: &Snapshot) -> BTreeMap<u64, u64> {
    let gone = || before.objects.iter().filter(|then| after.object(then.id).is_none());
    let come = after.objects.iter().filter(|now| before.object(now.id).is_none());
    let pairs = come
        .flat_map(|now| {
            let same = gone()
                .filter(|then| then.features == now.features && then.states.keys().eq(now.states.keys()));
            same.filter_map(|then| Some((now.distance(then.position_m?)?, now.id, then.id)))
        })
        .collect();
    match_nearest_first(pairs)
}

fn change(then: &Object, now: &Object, moved_m: f64) -> Option<Change> {
    let displaced = match (then.position_m, now.position_m) {
        (Some(place), Some(_)) => now.distance(place).is_some_and(|distance| distance > moved_m),
        _ => false,
    };
    let mut signature = Signature::new();
    for (name, &on) in &now.states {
        if then.states.get(name).is_some_and(|&was| was != on) {
            signature.insert(Effect::State { name: name.clone(), on });
        }
    }
    if signature.is_empty() && displaced {
        signature.insert(Effect::Moved);
    }
    if signature.is_empty() { None } else { Some(Change { signature, displaced }) }
}

/// Whether an object has all percepts of a signature. A peg has no hole, so rules about holes do not apply to it.
#[must_use]
pub fn has_percepts(object: &Object, signature: &Signature) -> bool {
    signature.iter().all(|effect| match effect {
        Effect::State { name, .. } => object.states.contains_key(name),
        Effect::Moved => object.position_m.is_some(),
    })
}

/// Whether an object is in the state that a signature expects; `moved` says whether it was displaced.
#[must_use]
pub fn is_achieved(object: &Object, signature: &Signature, moved: bool) -> bool {
    signature.iter().all(|effect| match effect {
        Effect::State { name, on } => object.states.get(name) == Some(on),
        Effect::Moved => moved,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(x: f64, filled: bool) -> Snapshot {
        let states = BTreeMap::from([("filled".to_owned(), filled)]);
        let object = Object { id: 1, states, position_m: Some([x, 0.0, 0.0]), ..Object::default() };
        Snapshot { objects: vec![object], ..Snapshot::default() }
    }

    #[test]
    fn a_block_displaced_while_filled_counts_as_filled() {
        let still = &changes(&block(0.1, false), &block(0.1, true), 0.03)[&1];
        let pushed = &changes(&block(0.1, false), &block(0.2, true), 0.03)[&1];
        assert_eq!(still.signature, pushed.signature);
        assert!(pushed.displaced && !still.displaced);
    }

    #[test]
    fn a_movement_counts_from_the_stated_distance_on() {
        assert!(changes(&block(0.1, true), &block(0.129, true), 0.03).is_empty());
        assert_eq!(
            changes(&block(0.1, true), &block(0.14, true), 0.03)[&1].signature,
            Signature::from([Effect::Moved])
        );
        assert!(changes(&block(0.1, true), &block(f64::NAN, true), 0.03).is_empty());
    }

    #[test]
    fn an_object_with_a_lost_identity_is_found_by_its_features() {
        let mut after = block(0.4, true);
        after.objects[0].id = 9;
        let change = &changes(&block(0.1, false), &after, 0.03)[&9];
        assert!(change.displaced && change.signature.len() == 1);
        after.objects[0].features.insert("colour".to_owned(), "red".to_owned());
        assert!(changes(&block(0.1, false), &after, 0.03).is_empty(), "it is another thing");
        assert_eq!(vanished(&block(0.1, false), &after).len(), 1, "and the first one is gone");
        after.objects[0].features.clear();
        assert!(vanished(&block(0.1, false), &after).is_empty());
    }

    #[test]
    fn an_object_that_comes_into_view_is_not_a_change() {
        assert!(changes(&Snapshot::default(), &block(0.1, true), 0.03).is_empty());
    }
}

//! Matches the objects of two snapshots.

use std::collections::{BTreeMap, BTreeSet};

use super::snapshot::{Object, Snapshot};

/// Objects of two perspectives farther apart than this are different objects, in metres.
const SAME_PLACE_M: f64 = 0.08;

/// The objects of another perspective that match those of a view, by identity in the view. Unmatched objects are
/// missing.
///
/// Matching objects have the same class features and lie at most 8 cm apart. The matching is one to one, nearest
/// pairs first. So of two similar objects side by side one may be matched and the other not. An object without
/// a position (only mentioned in dialogue) matches only another one without a position.
#[must_use]
pub fn counterparts<'a>(view: &Snapshot, theirs: &'a Snapshot) -> BTreeMap<u64, &'a Object> {
    let mut pairs = Vec::new();
    for object in &view.objects {
        for believed in &theirs.objects {
            let apart_m = match (object.position_m, believed.position_m) {
                (None, None) => Some(0.0),
                (Some(place_m), _) => believed.distance(place_m),
                (None, Some(_)) => None,
            };
            if let Some(apart_m) = apart_m.filter(|apart_m| *apart_m <= SAME_PLACE_M)
                && object.features == believed.features
            {
                pairs.push((apart_m, object.id, believed.id));
            }
        }
    }
    let believed = |(object, believed)| Some((object, theirs.object(believed)?));
    match_nearest_first(pairs).into_iter().filter_map(believed).collect()
}

/// Greedy one-to-one matching of identities by ascending distance; ties are resolved by the lowest identities.
pub(crate) fn match_nearest_first(mut pairs: Vec<(f64, u64, u64)>) -> BTreeMap<u64, u64> {
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut found, mut taken) = (BTreeMap::new(), BTreeSet::new());
    for (_, one, other) in pairs {
        if !found.contains_key(&one) && taken.insert(other) {
            found.insert(one, other);
        }
    }
    found
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Objects by identity, colour and x coordinate in metres.
    pub(crate) fn snapshot(objects: &[(u64, &str, f64)]) -> Snapshot {
        let object = |&(id, colour, x): &(u64, &str, f64)| Object {
            id,
            features: BTreeMap::from([("colour".to_owned(), colour.to_owned())]),
            position_m: Some([x, 0.0, 0.0]),
            ..Object::default()
        };
        Snapshot { objects: objects.iter().map(object).collect(), ..Snapshot::default() }
    }

    fn pairs(view: &Snapshot, theirs: &Snapshot) -> Vec<(u64, u64)> {
        counterparts(view, theirs).into_iter().map(|(object, believed)| (object, believed.id)).collect()
    }

    #[test]
    fn matching_is_one_to_one_and_nearest_first() {
        let own = snapshot(&[(1, "blue", 0.0), (2, "blue", 0.06), (3, "red", 0.06)]);
        assert_eq!(pairs(&own, &snapshot(&[(7, "blue", 0.05)])), [(2, 7)]);
        assert_eq!(pairs(&own, &snapshot(&[(7, "blue", 0.01)])), [(1, 7)]);
        assert_eq!(pairs(&own, &snapshot(&[(7, "blue", 0.04), (8, "blue", 0.07)])), [(1, 7), (2, 8)]);
        assert_eq!(pairs(&own, &snapshot(&[(7, "blue", 0.15), (8, "green", 0.0), (9, "red", f64::NAN)])), []);
    }

    #[test]
    fn equally_near_objects_are_paired_by_lowest_identity() {
        let alike = [(1, "blue", 0.02), (2, "blue", 0.02)];
        let theirs = [(8, "blue", 0.0), (7, "blue", 0.0)];
        assert_eq!(pairs(&snapshot(&alike), &snapshot(&theirs)), [(1, 7), (2, 8)]);
        assert_eq!(pairs(&snapshot(&alike), &snapshot(&theirs[..1])), [(1, 8)]);
    }

    #[test]
    fn objects_without_positions_are_paired_once() {
        let mut own = snapshot(&[(1, "blue", 0.0), (2, "blue", 0.0)]);
        own.objects.iter_mut().for_each(|object| object.position_m = None);
        let mut theirs = snapshot(&[(7, "blue", 0.0)]);
        assert_eq!(pairs(&own, &theirs), [], "his lies somewhere");
        theirs.objects[0].position_m = None;
        assert_eq!(pairs(&own, &theirs), [(1, 7)]);
    }
}

use super::*;
use crate::demonstration::change::changes;

const MOVED_M: f64 = 0.03;

fn block(id: u64, place_m: [f64; 3]) -> Object {
    Object { id, position_m: Some(place_m), half_extents_m: Some([0.03; 3]), ..Object::default() }
}

/// A block longer than wide, with this heading.
fn long(id: u64, place_m: [f64; 3], heading_rad: f64) -> Object {
    let half_extents_m = Some([0.06, 0.02, 0.02]);
    Object { half_extents_m, heading_rad: Some(heading_rad), ..block(id, place_m) }
}

fn owned(object: Object, owner: u16) -> Object {
    Object { owner: Some(owner), ..object }
}

fn held(object: Object, holder: u16) -> Object {
    Object { held_by: Some(holder), ..object }
}

fn peg(object: Object, inserted: bool) -> Object {
    Object { states: BTreeMap::from([("inserted".to_owned(), inserted)]), ..object }
}

/// The action_effects of partner 1 between two snapshots; checks that each is achieved afterwards.
fn done(before: &[Object], after: &[Object]) -> BTreeMap<u64, BTreeSet<ActionEffect>> {
    let snapshot = |objects: &[Object]| Snapshot { objects: objects.to_vec(), ..Snapshot::default() };
    let (before, after) = (snapshot(before), snapshot(after));
    let course = ActionContext { at_start: &before, before: &before, after: &after };
    let action_effects = action_effects(1, &course, &changes(&before, &after, MOVED_M), MOVED_M);
    for (id, action_effects) in &action_effects {
        assert!(
            action_effects.iter().all(|action_effect| action_effect.is_achieved(*id, &after)),
            "{action_effects:?}"
        );
    }
    action_effects
}

/// The action_effects for object 1, which must be the only ones.
fn of_1(before: &[Object], after: &[Object]) -> Vec<ActionEffect> {
    let done = done(before, after);
    assert!(done.keys().all(|id| *id == 1), "{done:?}");
    done.into_values().flatten().collect()
}

#[test]
fn an_object_that_rests_on_another_was_placed_on_it() {
    let (on_table, below) = (block(1, [0.0, 0.5, 0.03]), block(2, [0.3, 0.5, 0.03]));
    let on_it = block(1, [0.31, 0.5, 0.09]);
    let placed = [ActionEffect::PlacedOn { support: 2 }];
    assert_eq!(of_1(&[on_table.clone(), below.clone()], &[on_it.clone(), below.clone()]), placed);
    let beside = block(1, [0.24, 0.5, 0.03]);
    assert_eq!(of_1(&[on_table.clone(), below.clone()], &[beside, below.clone()]), []);
    let above_it = block(1, [0.31, 0.5, 0.14]);
    assert_eq!(
        of_1(&[on_table.clone(), below.clone()], &[above_it, below.clone()]),
        [],
        "it hangs in the air"
    );
    let in_hand = held(on_it, 1);
    assert_eq!(of_1(&[on_table, below.clone()], &[in_hand, below]), [], "it was not let go");
}

#[test]
fn an_object_with_an_unchanged_support_was_not_placed() {
    let tower = |x: f64| [block(1, [x, 0.5, 0.09]), block(2, [x, 0.5, 0.03])];
    assert!(done(&tower(0.0), &tower(0.2)).is_empty(), "the tower was pushed");
    let other = block(3, [0.2, 0.5, 0.03]);
    let [top, bottom] = tower(0.0);
    let before = [top, bottom.clone(), other.clone()];
    let after = [block(1, [0.2, 0.5, 0.09]), bottom, other];
    assert_eq!(of_1(&before, &after), [ActionEffect::PlacedOn { support: 3 }]);
}

#[test]
fn a_bridge_is_placed_on_both_its_pillars() {
    let pillars = [block(2, [0.255, 0.5, 0.03]), block(3, [0.345, 0.5, 0.03])];
    let table = |bridge: Object| [[bridge].as_slice(), pillars.as_slice()].concat();
    let before = table(long(1, [0.0, 0.5, 0.02], 0.0));
    let both = [ActionEffect::PlacedOn { support: 2 }, ActionEffect::PlacedOn { support: 3 }];
    assert_eq!(of_1(&before, &table(long(1, [0.3, 0.5, 0.08], 0.0))), both);
    // Turned by 90 degrees it lies on neither: it would fall.
    let across = table(long(1, [0.3, 0.5, 0.08], std::f64::consts::FRAC_PI_2));
    assert_eq!(of_1(&before, &across), []);
}

#[test]
fn a_support_is_found_through_noise() {
    // Two standard deviations of the noise (10 mm) that remains in low-pass filtered positions.
    for (dx, dz) in [(0.012, 0.012), (-0.012, 0.012), (0.012, -0.012), (-0.012, -0.012)] {
        let below = block(2, [0.3 - dx, 0.5, 0.03 - dz]);
        let before = [block(1, [0.0, 0.5, 0.03]), block(2, [0.3, 0.5, 0.03])];
        let after = [block(1, [0.3 + dx, 0.5, 0.09 + dz]), below];
        assert_eq!(of_1(&before, &after), [ActionEffect::PlacedOn { support: 2 }], "{dx} {dz}");
    }
}

#[test]
fn the_uppermost_of_stacked_thin_objects_is_the_support() {
    let thin = |id, place_m| Object { half_extents_m: Some([0.03, 0.03, 0.006]), ..block(id, place_m) };
    let stack = [thin(2, [0.3, 0.5, 0.006]), thin(3, [0.3, 0.5, 0.018])];
    let table = |top: Object| [[top].as_slice(), stack.as_slice()].concat();
    let (before, after) = (table(thin(1, [0.0, 0.5, 0.006])), table(thin(1, [0.3, 0.5, 0.030])));
    assert_eq!(of_1(&before, &after), [ActionEffect::PlacedOn { support: 3 }]);
}

#[test]
fn an_inserted_or_carried_along_peg_is_not_placed() {
    let stick = |place_m, inserted| {
        peg(Object { half_extents_m: Some([0.01, 0.01, 0.025]), ..block(1, place_m) }, inserted)
    };
    let hole = |x| block(2, [x, 0.5, 0.03]);
    assert_eq!(
        of_1(&[stick([0.0, 0.5, 0.025], false), hole(0.3)], &[stick([0.3, 0.5, 0.06], true), hole(0.3)]),
        []
    );
    let carried = [stick([0.6, 0.5, 0.061], true), hole(0.6)];
    assert!(done(&[stick([0.3, 0.5, 0.06], true), hole(0.3)], &carried).is_empty());
}

#[test]
fn change_of_owner_is_a_hand_over() {
    let (here, there) = ([0.0, 1.0, 0.03], [0.0, 0.4, 0.03]);
    let leos = owned(block(2, [0.3, 0.4, 0.03]), 0);
    let of_1 = |before: Object, after: Object| of_1(&[before, leos.clone()], &[after, leos.clone()]);
    let (mine, given) = (owned(block(1, here), 1), owned(block(1, there), 0));
    assert_eq!(of_1(mine.clone(), given.clone()), [ActionEffect::Handed { to: 0 }]);
    // An object without an owner cannot be handed over, and losing its owner is no hand-over.
    assert_eq!(of_1(block(1, here), given.clone()), []);
    assert_eq!(of_1(mine.clone(), block(1, there)), []);
    // Taking an object is no hand-over.
    assert_eq!(of_1(owned(block(1, there), 0), mine.clone()), []);
    // A change of territory, while the object stays in place, is no act.
    assert_eq!(of_1(mine.clone(), owned(block(1, here), 0)), []);
    assert_eq!(of_1(peg(mine, false), peg(given, true)), [], "a peg in a hole was put to use");
}

#[test]
fn a_territory_that_appears_during_a_demonstration_receives_no_object() {
    let mine = owned(block(1, [0.0, 1.0, 0.03]), 1);
    let tower = owned(block(2, [0.0, 0.75, 0.03]), 0);
    let at_start = Snapshot { objects: vec![block(1, [0.0, 1.0, 0.03])], ..Snapshot::default() };
    let before = Snapshot { objects: vec![mine, tower.clone()], ..Snapshot::default() };
    let put = owned(block(1, [0.07, 0.75, 0.03]), 0);
    let after = Snapshot { objects: vec![put, tower], ..Snapshot::default() };
    let course = ActionContext { at_start: &at_start, before: &before, after: &after };
    assert!(action_effects(1, &course, &changes(&before, &after, MOVED_M), MOVED_M).is_empty());
}

#[test]
fn object_in_another_hand_was_handed_over() {
    let (before, place) = ([block(1, [0.0, 1.0, 0.03])], [0.0, 0.6, 0.2]);
    assert_eq!(of_1(&before, &[held(block(1, place), 2)]), [ActionEffect::Handed { to: 2 }]);
    assert_eq!(of_1(&before, &[held(block(1, place), 1)]), [], "he holds it himself");
}

#[test]
fn a_thing_can_be_handed_over_on_something() {
    let tray = owned(block(2, [0.0, 0.4, 0.03]), 0);
    let before = [owned(block(1, [0.0, 1.0, 0.03]), 1), tray.clone()];
    let after = [owned(block(1, [0.0, 0.4, 0.09]), 0), tray];
    assert_eq!(
        of_1(&before, &after),
        [ActionEffect::PlacedOn { support: 2 }, ActionEffect::Handed { to: 0 }]
    );
}

#[test]
fn an_undone_action_effect_is_no_longer_achieved() {
    let below = block(2, [0.3, 0.5, 0.03]);
    let on_table = Snapshot { objects: vec![block(1, [0.0, 0.5, 0.03]), below], ..Snapshot::default() };
    assert!(!ActionEffect::PlacedOn { support: 2 }.is_achieved(1, &on_table));
    assert!(!ActionEffect::PlacedOn { support: 9 }.is_achieved(1, &on_table));
    assert!(!ActionEffect::Handed { to: 0 }.is_achieved(1, &on_table));
}

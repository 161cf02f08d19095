//! What a hand hides, from each perspective.

use clock::Duration;
use message::{Header, Observation, ObservationKind};

use super::workspace::{AWAY, EYES, TABLE, Workspace, block, person};

const SECOND: Duration = Duration::from_secs(1);
const HERE: [f32; 3] = [0.7, -0.2, 0.05];
const THERE: [f32; 3] = [0.7, 0.3, 0.05];

fn hand(agent: u16, position_m: [f32; 3]) -> Observation {
    Observation { kind: ObservationKind::Hand.raw(), partner: agent, position_m, ..Observation::object(0, 0) }
}

/// Agent `holder` takes the block and hides it in the hand, which moves from `HERE` to `THERE`; the partner looks at
/// `towards` meanwhile.
fn taken(holder: u16, towards: [f64; 3]) -> Workspace {
    let mut world = Workspace::new();
    world.run(SECOND, &[person(EYES, TABLE), hand(holder, HERE), block(HERE)]);
    let held = Observation { held_by: holder, ..block(HERE) };
    world.run(SECOND, &[person(EYES, TABLE), hand(holder, HERE), held]);
    for step in 0..=100_u8 {
        let along = f32::from(step) / 100.0;
        let place = [HERE[0], HERE[1] + along * (THERE[1] - HERE[1]), HERE[2]];
        world.step(&[person(EYES, towards), hand(holder, place)]);
    }
    world.run(SECOND, &[person(EYES, towards), hand(holder, THERE)]);
    world
}

/// Where the robot expects its only thing, and where the partner does, both in y of the base frame.
fn expected(world: &Workspace) -> (f32, f64) {
    let (robots, his) = (world.robots(), world.his());
    assert_eq!((robots.len(), his.len()), (1, 1));
    let [x, y, z] = his[0].expected_position_m.map(f64::from);
    let his_place = world.partner.frame().unwrap() * geometry::Position::new(x, y, z);
    (robots[0].expected_position_m[1], his_place.to_array()[1])
}

fn assert_near(found: (f32, f64), wanted: (f32, f32)) {
    let off = (f64::from(found.0 - wanted.0).abs()).max((found.1 - f64::from(wanted.1)).abs());
    assert!(off < 0.02, "{found:?} {wanted:?}");
}

#[test]
fn a_partner_who_watches_knows_where_the_hand_carried_a_hidden_thing() {
    let world = taken(0, TABLE);
    assert_near(expected(&world), (THERE[1], THERE[1]));
    let head = world.partner.head(Header::at(0));
    assert_eq!((head.perceivable, head.hidden), (0, 0), "hands are no objects");
}

#[test]
fn a_partner_who_looks_away_believes_that_it_is_where_it_was() {
    let mut world = taken(0, AWAY);
    assert_near(expected(&world), (THERE[1], HERE[1]));
    // They look again, and see the hand that held it.
    world.run(SECOND, &[person(EYES, TABLE), hand(0, THERE)]);
    assert_near(expected(&world), (THERE[1], THERE[1]));
    // Without that hand, they see the empty place.
    let mut world = taken(0, AWAY);
    world.run(SECOND, &[person(EYES, TABLE), hand(1, THERE)]);
    assert_eq!(world.his().len(), 0);
}

#[test]
fn an_agent_knows_where_its_own_hand_is_without_looking() {
    let world = taken(1, AWAY);
    assert_near(expected(&world), (THERE[1], THERE[1]));
}

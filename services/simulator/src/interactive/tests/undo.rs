//! What is undone, and what is not.

use super::*;

#[test]
fn undo_of_set_up_restores_the_previous_table() {
    let mut bench = Bench::empty();
    bench.add("square", "red", [0.0, 0.6]).unwrap();
    bench.add("peg", "wood", [0.2, 0.6]).unwrap();
    bench.bring("wood peg", [0.0, 0.6]).unwrap();
    assert!(bench.holds("red square", State::Filled));
    bench.act(Kind::Undo, |_| {}).unwrap();
    assert!(!bench.holds("red square", State::Filled));
    assert!((bench.thing("wood peg").position_m[0] - 0.2).abs() < 1e-9);
    bench.act(Kind::Remove, |act| act.text = Text::new("red square")).unwrap();
    assert_eq!(bench.world.scene().filter(|thing| thing.kind == 1).count(), 1);
    for _ in 0..3 {
        bench.act(Kind::Undo, |_| {}).unwrap();
    }
    assert_eq!(bench.world.scene().filter(|thing| thing.kind == 1).count(), 0);
}

#[test]
fn undo_of_a_move_is_visible() {
    let mut bench = taught();
    bench.act(Kind::Undo, |_| {}).unwrap();
    assert_eq!(bench.thing("wood peg").held_by, 1);
    bench.wait(1_000);
    assert!(!bench.holds("red square", State::Filled));
    let lesson = bench.world.taught("x", bench.now()).unwrap();
    let moves = lesson.demonstrations[0].script.iter().filter(|step| matches!(step.act, Act::Move { .. }));
    assert_eq!(moves.count(), 2);
}

#[test]
fn undo_during_set_up_reverts_a_pushed_screen() {
    let mut bench = Bench::empty();
    bench.screen("wall", [0.0, 0.5], 1).unwrap();
    bench.add("square", "red", [0.0, 0.9]).unwrap();
    // One push, in many small steps.
    for step in 1..=20 {
        bench.screen("wall", [0.01 * f64::from(step), 0.5], 1).unwrap();
        bench.wait(50);
    }
    // Held still, and released there.
    bench.wait(1_000);
    bench.screen("wall", [0.2, 0.5], 1).unwrap();
    bench.wait(1_000);
    bench.screen("wall", [0.2, 0.6], 1).unwrap();
    bench.wait(100);
    for place in [[0.2, 0.5], [0.0, 0.5]] {
        bench.act(Kind::Undo, |_| {}).unwrap();
        assert!(bench.lies_at("wall", place) && bench.lies_at("red square", [0.0, 0.9]));
    }
    bench.act(Kind::Undo, |_| {}).unwrap();
    assert_eq!(bench.table().len(), 1, "the block is gone, and the screen is not");
}

#[test]
fn undo_of_a_pushed_screen_is_visible_and_leaves_the_peg() {
    let mut bench = taught();
    bench.screen("wall", [0.4, 0.55], 1).unwrap();
    bench.wait(100);
    bench.act(Kind::Undo, |_| {}).unwrap();
    bench.wait(200);
    assert!(!bench.lies_at("wall", [0.4, 0.55]) && !bench.lies_at("wall", [0.2, 0.55]), "it is on its way");
    bench.wait(1_000);
    assert!(bench.lies_at("wall", [0.2, 0.55]) && bench.holds("red square", State::Filled));
    let lesson = bench.world.taught("x", bench.now()).unwrap();
    let script = lesson.demonstrations[0].script.iter().map(|step| &step.act);
    let count = |is_one: fn(&&Act) -> bool| script.clone().filter(is_one).count();
    assert_eq!(count(|act| matches!(act, Act::Slide { .. })), 2);
    assert_eq!(count(|act| matches!(act, Act::Move { .. })), 1);
    bench.act(Kind::Undo, |_| {}).unwrap();
    bench.wait(1_000);
    assert!(!bench.holds("red square", State::Filled), "the act before it is taken back next");
}

#[test]
fn undo_of_a_pushed_screen_does_not_cross_tables() {
    let mut bench = Bench::new();
    bench.wait(2_000);
    let at = bench.thing("wall").position_m;
    let stood = [at[0], at[1]];
    bench.screen("wall", [0.3, 0.6], 1).unwrap();
    bench.wait(1_000);
    bench.act(Kind::Undo, |_| {}).unwrap();
    bench.wait(1_000);
    assert!(bench.lies_at("wall", stood));
    assert_eq!(bench.mode(), Some(SceneMode::Script));
    bench.screen("wall", [0.3, 0.6], 1).unwrap();
    let of = bench.world.head().table;
    while bench.world.head().table == of {
        bench.wait(100);
    }
    bench.wait(5_000);
    let before = bench.thing("wall").position_m;
    bench.act(Kind::Undo, |_| {}).unwrap_err();
    assert!(bench.lies_at("wall", [before[0], before[1]]));
}

#[test]
fn refused_and_cancelled_acts_are_not_undone() {
    let mut bench = taught();
    bench.bring("wood peg 2", [0.3, 0.8]).unwrap();
    // The hole is occupied: the peg is back in its place, and the page, which holds nothing any more, cancels.
    bench.bring("wood peg 2", [-0.2, 0.9]).unwrap_err();
    bench.act(Kind::Cancel, |_| {}).unwrap();
    bench.wait(500);
    bench.act(Kind::Undo, |_| {}).unwrap();
    bench.wait(1_000);
    assert!(bench.lies_at("wood peg 2", [0.1, 1.0]), "the move before it is taken back");
    bench.act(Kind::Undo, |_| {}).unwrap();
    bench.wait(1_000);
    assert!(!bench.holds("red square", State::Filled));
    bench.act(Kind::Undo, |_| {}).unwrap_err();
}

#[test]
fn cancel_does_not_undo_acts_of_others() {
    let mut bench = Bench::of_two();
    bench.add("peg", "wood", [0.0, 0.9]).unwrap();
    bench.add("peg", "wood", [0.2, 0.9]).unwrap();
    bench.say("Leo, I can teach you to do it").unwrap();
    bench.take("wood peg", 1).unwrap();
    bench.take("wood peg 2", 2).unwrap();
    bench.act(Kind::Cancel, |act| act.hand = 1).unwrap();
    bench.put([0.4, 0.9], 2).unwrap();
    bench.wait(500);
    assert!(bench.lies_at("wood peg", [0.0, 0.9]) && bench.lies_at("wood peg 2", [0.4, 0.9]));
    bench.act(Kind::Undo, |_| {}).unwrap();
    bench.wait(1_000);
    assert!(bench.lies_at("wood peg", [0.0, 0.9]) && bench.lies_at("wood peg 2", [0.2, 0.9]));
    bench.act(Kind::Undo, |_| {}).unwrap_err();
}

#[test]
fn each_of_two_hands_takes_back_its_own_act() {
    let mut bench = Bench::of_two();
    bench.add("peg", "wood", [0.0, 0.9]).unwrap();
    bench.add("peg", "wood", [0.2, 0.9]).unwrap();
    bench.take("wood peg", 1).unwrap();
    bench.take("wood peg 2", 2).unwrap();
    bench.put([0.0, 0.5], 1).unwrap();
    bench.put([0.2, 0.5], 2).unwrap();
    bench.wait(500);
    bench.act(Kind::Undo, |_| {}).unwrap();
    assert!(bench.lies_at("wood peg", [0.0, 0.5]) && bench.lies_at("wood peg 2", [0.2, 0.9]));
    bench.act(Kind::Undo, |_| {}).unwrap();
    assert!(bench.lies_at("wood peg", [0.0, 0.9]) && bench.lies_at("wood peg 2", [0.2, 0.9]));
}

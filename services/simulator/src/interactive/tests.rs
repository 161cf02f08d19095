use std::path::Path;

use clock::{Duration, Instant};
use config::lesson::{Act, Destination, Lesson, Teacher};
use message::{SceneMode, SceneObject, State, TeacherAct, TeacherActKind as Kind, Text};
use proptest::prelude::*;

use crate::{RefusedActError, World};

mod undo;

const ROOM: usize = 64;

/// A world under test, with its time.
struct Bench {
    world: World,
    ms: u64,
    said: Vec<String>,
}

impl Bench {
    fn new() -> Self {
        Self::of(&Lesson::builtin())
    }

    fn of(lesson: &Lesson) -> Self {
        let mut bench = Self { world: World::new(lesson, 1), ms: 0, said: Vec::new() };
        bench.wait(1);
        bench
    }

    /// An empty table that is being set up by two people.
    fn of_two() -> Self {
        let mut lesson = Lesson::builtin();
        let second = Teacher { number: 2, ..lesson.teachers[0] };
        lesson.teachers.push(second);
        let mut bench = Self::of(&lesson);
        bench.act(Kind::Clear, |_| {}).unwrap();
        bench
    }

    /// An empty table that is being set up.
    fn empty() -> Self {
        let mut bench = Self::new();
        bench.act(Kind::Clear, |_| {}).unwrap();
        bench
    }

    fn now(&self) -> Instant {
        Instant::from_nanos(7_000_000_000) + Duration::from_millis(self.ms)
    }

    fn wait(&mut self, ms: u64) {
        for _ in 0..ms.div_ceil(5) {
            self.ms += 5;
            let now = self.now();
            self.world.step(now, [None, None]);
            self.said.extend(self.world.utterances().map(|said| said.text.as_str().to_owned()));
        }
    }

    fn act(&mut self, kind: Kind, how: impl FnOnce(&mut TeacherAct)) -> Result<String, RefusedActError> {
        let mut act = TeacherAct::new(kind, 1);
        how(&mut act);
        let outcome = self.world.act(self.now(), &act, ROOM);
        self.wait(5);
        outcome
    }

    fn add(&mut self, kind: &str, colour: &str, at: [f64; 2]) -> Result<String, RefusedActError> {
        self.act(Kind::Add, |act| {
            (act.text, act.colour) = (Text::new(kind), Text::new(colour));
            act.position_m = [at[0], at[1], 0.0];
        })
    }

    /// Takes a thing, carries it to a place and puts it down.
    fn bring(&mut self, thing: &str, at: [f64; 2]) -> Result<(), RefusedActError> {
        self.act(Kind::Take, |act| act.text = Text::new(thing))?;
        for _ in 0..10 {
            self.act(Kind::Carry, |act| act.position_m = [at[0], at[1], 0.2])?;
            self.wait(50);
        }
        self.act(Kind::Put, |act| act.position_m = [at[0], at[1], 0.2])?;
        self.wait(400);
        Ok(())
    }

    /// Takes a thing, with the hand of the page and person of this number.
    fn take(&mut self, thing: &str, by: u16) -> Result<String, RefusedActError> {
        self.act(Kind::Take, |act| (act.text, act.hand, act.teacher) = (Text::new(thing), by, by))
    }

    fn put(&mut self, at: [f64; 2], by: u16) -> Result<String, RefusedActError> {
        self.act(Kind::Put, |act| {
            (act.position_m, act.hand, act.teacher) = ([at[0], at[1], 0.2], by, by);
        })
    }

    fn lies_at(&self, name: &str, [x, y]: [f64; 2]) -> bool {
        let [thing_x, thing_y, _] = self.thing(name).position_m;
        (thing_x - x).hypot(thing_y - y) < 1e-6
    }

    /// The positions of everything on the table.
    fn table(&self) -> Vec<(String, [f64; 3])> {
        let rounded = |metres: f64| (metres * 1e6).round();
        let things = self.world.scene().filter(|thing| thing.kind != 2);
        things.map(|thing| (thing.name.as_str().to_owned(), thing.position_m.map(rounded))).collect()
    }

    /// Pushes a screen to a place, or adds it, as the person of this number.
    fn screen(&mut self, name: &str, at: [f64; 2], by: u16) -> Result<String, RefusedActError> {
        self.act(Kind::Screen, |act| {
            (act.text, act.position_m, act.teacher) = (Text::new(name), [at[0], at[1], 0.0], by);
        })
    }

    fn say(&mut self, words: &str) -> Result<String, RefusedActError> {
        self.act(Kind::Say, |act| act.text = Text::new(words))
    }

    fn thing(&self, name: &str) -> SceneObject {
        self.world.scene().find(|thing| thing.name.as_str() == name).unwrap()
    }

    fn holds(&self, name: &str, state: State) -> bool {
        self.thing(name).states[usize::from(state.raw())] > 0.5
    }

    fn mode(&self) -> Option<SceneMode> {
        self.world.head().mode()
    }
}

/// Task 1 taught interactively: a red and a blue block, the blue one behind a screen, and two pegs; the red one's
/// hole is filled.
fn taught() -> Bench {
    let mut bench = Bench::empty();
    assert_eq!(bench.add("square", "red", [-0.2, 0.9]).unwrap(), "red square");
    assert_eq!(bench.add("square", "blue", [0.2, 0.45]).unwrap(), "blue square");
    assert_eq!(bench.add("peg", "wood", [0.0, 1.0]).unwrap(), "wood peg");
    assert_eq!(bench.add("peg", "wood", [0.1, 1.0]).unwrap(), "wood peg 2");
    bench
        .act(Kind::Screen, |act| {
            (act.text, act.position_m) = (Text::new("wall"), [0.2, 0.55, 0.0]);
        })
        .unwrap();
    assert_eq!(bench.mode(), Some(SceneMode::SetUp));
    bench.say("Leo, I can teach you to do task 1").unwrap();
    assert_eq!(bench.mode(), Some(SceneMode::Teaching));
    bench.wait(500);
    bench.bring("wood peg", [-0.19, 0.91]).unwrap();
    bench.wait(500);
    bench.say("task 1 is done").unwrap();
    bench
}

#[test]
fn a_peg_that_is_let_go_above_a_hole_fills_it() {
    let bench = taught();
    assert!(bench.holds("red square", State::Filled) && bench.holds("wood peg", State::Inserted));
    assert!(!bench.holds("blue square", State::Filled));
    assert_eq!(bench.said, ["Leo, I can teach you to do task 1", "task 1 is done"]);
}

#[test]
fn an_interactive_demonstration_replays_to_the_same_end() {
    let bench = taught();
    let text = bench.world.taught("By hand", bench.now()).unwrap().to_toml();
    let lesson = Lesson::parse(&text, Path::new("by_hand.toml")).unwrap();
    let table = &lesson.demonstrations[0];
    assert_eq!((table.objects.len(), table.occluders.len()), (4, 1));
    let moves: Vec<&Act> =
        table.script.iter().map(|step| &step.act).filter(|act| matches!(act, Act::Move { .. })).collect();
    assert!(matches!(moves.as_slice(), [Act::Move { object: 2, to: Destination::Hole(0), .. }]));

    let mut replay = World::new(&lesson, 1);
    let mut now = bench.now();
    while !replay.is_finished() {
        now += Duration::from_millis(5);
        replay.step(now, [None, None]);
    }
    let mut seen = 0;
    for interactive in bench.world.scene() {
        let replayed = replay.scene().find(|thing| thing.name == interactive.name).unwrap();
        let apart = interactive.position_m.iter().zip(replayed.position_m).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-5, "{:?}", interactive.name);
        let states = |thing: &SceneObject| thing.states.map(|degree| (degree * 10.0).round().to_bits());
        assert_eq!(states(&interactive), states(&replayed), "{:?}", interactive.name);
        seen += 1;
    }
    assert_eq!(seen, replay.scene().count(), "both have the same things");
    assert!(seen > 4, "only {seen} things were seen");
}

#[test]
fn an_interrupted_script_is_part_of_the_recorded_lesson() {
    let mut bench = Bench::new();
    bench.wait(2_000);
    assert_eq!(bench.mode(), Some(SceneMode::Script));
    // A sentence, or another seat: the script continues.
    bench
        .act(Kind::Seat, |act| (act.position_m, act.second_vector_m) = ([0.3, 1.4, 0.6], [0.0, 0.7, 0.0]))
        .unwrap();
    assert_eq!(bench.mode(), Some(SceneMode::Script));
    bench.bring("peg 7", [-0.35, 1.0]).unwrap();
    assert_eq!(bench.mode(), Some(SceneMode::Teaching));
    bench.say("task 1 is done").unwrap();
    let lesson = bench.world.taught("Taken over", bench.now()).unwrap();
    let said = lesson.demonstrations[0].script.iter().filter(|step| matches!(step.act, Act::Say(_))).count();
    assert_eq!(said, 2, "the script's first sentence, and the last one");
}

#[test]
fn an_impossible_act_is_refused_with_a_reason_without_effect() {
    let mut bench = taught();
    let refusals = [
        (Kind::Take, "nothing", "`nothing`"),
        (Kind::Add, "square", "taught"),
        (Kind::Remove, "wood peg", "taken away"),
        (Kind::Put, "", "hand"),
        (Kind::Say, "  ", "word"),
        (Kind::Return, "", "teacher"),
        (Kind::Seat, "", "position"),
        (Kind::Open, "task2", "lesson"),
    ];
    let mut wording = String::new();
    for (kind, text, why) in refusals {
        let before: Vec<SceneObject> = bench.world.scene().collect();
        let refusal = bench.act(kind, |act| act.text = Text::new(text)).unwrap_err();
        assert!(refusal.0.contains(why), "{refusal}");
        wording += &format!("{kind:?} {text:?}\n    {refusal}\n");
        assert_eq!(format!("{before:?}"), format!("{:?}", bench.world.scene().collect::<Vec<_>>()));
    }
    let refusal = bench.act(Kind::Lay, |act| act.table = 9).unwrap_err();
    assert!(refusal.0.contains("3 tables"), "{refusal}");
    wording += &format!("{refusal}\n");
    let refusal = bench.bring("wood peg 2", [-0.2, 0.9]).unwrap_err();
    assert!(refusal.0.contains("`red square`"), "{refusal}");
    wording += &format!("{refusal}\n");
    bench.wait(500);
    assert!((bench.thing("wood peg 2").position_m[0] - 0.1).abs() < 1e-9);
    let unknown = TeacherAct { teacher: 7, ..TeacherAct::new(Kind::Say, 7) };
    let refusal = bench.world.act(bench.now(), &unknown, ROOM).unwrap_err();
    assert!(refusal.0.contains("teacher 7"), "{refusal}");
    insta::assert_snapshot!(wording + &refusal.0);
}

#[test]
fn a_table_of_the_lesson_can_be_continued_by_hand() {
    let mut bench = Bench::new();
    bench.act(Kind::Lay, |act| act.table = 2).unwrap();
    assert_eq!(bench.world.scene().filter(|thing| thing.kind == 1).count(), 0);
    bench.wait(2_500);
    assert_eq!(bench.world.scene().filter(|thing| thing.kind == 1).count(), 12);
    assert_eq!((bench.mode(), bench.world.head().table), (Some(SceneMode::SetUp), 2));
    bench.say("Leo, do task 1").unwrap();
    let lesson = bench.world.taught("Novel", bench.now()).unwrap();
    assert_eq!((lesson.demonstrations.len(), lesson.performances()), (0, 1));
}

#[test]
fn a_saved_table_keeps_its_territory() {
    let task2 = Lesson::named("task2", Path::new("")).unwrap();
    let mut bench = Bench::of(&task2);
    bench.act(Kind::Lay, |act| act.table = 0).unwrap();
    bench.wait(2_500);
    bench.add("marker", "wood", [0.5, 0.7]).unwrap();
    bench.say("Leo, I can teach you to do task 2").unwrap();
    let saved = |bench: &Bench| {
        let text = bench.world.taught("Task 2 by hand", bench.now()).unwrap().to_toml();
        Lesson::parse(&text, Path::new("task_2_by_hand.toml")).unwrap()
    };
    assert_eq!(task2.demonstrations[0].territory.len(), 2);
    assert_eq!(saved(&bench).demonstrations[0].territory, task2.demonstrations[0].territory);
    // An empty table has no owners.
    bench.act(Kind::Clear, |_| {}).unwrap();
    bench.say("Leo, I can teach you to do nothing").unwrap();
    assert!(saved(&bench).demonstrations[1].territory.is_empty());
}

#[test]
fn an_object_laid_in_a_hole_is_seated() {
    let mut bench = Bench::empty();
    bench.add("square", "red", [0.0, 0.6]).unwrap();
    bench.add("peg", "wood", [0.0, 0.6]).unwrap();
    bench.say("Leo, I can teach you to do it").unwrap();
    let text = bench.world.taught("Filled", bench.now()).unwrap().to_toml();
    let lesson = Lesson::parse(&text, Path::new("filled.toml")).unwrap();
    let mut replay = World::new(&lesson, 1);
    let mut now = bench.now();
    for _ in 0..200 {
        now += Duration::from_millis(5);
        replay.step(now, [None, None]);
    }
    let block = replay.scene().find(|thing| thing.name.as_str() == "red square").unwrap();
    assert!(block.states[usize::from(State::Filled.raw())] > 0.5);
}

#[test]
fn no_object_is_added_to_a_table_the_script_refers_to() {
    let mut bench = Bench::new();
    bench.wait(2_000);
    assert_eq!((bench.mode(), bench.said.len()), (Some(SceneMode::Script), 1));
    let names = |bench: &Bench| bench.table().into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    let before = names(&bench);
    let refusals = [
        bench.add("square", "red", [0.6, 1.2]),
        bench.act(Kind::Remove, |act| act.text = Text::new("peg 7")),
        bench.act(Kind::Screen, |act| (act.text, act.position_m) = (Text::new("new"), [0.2, 0.5, 0.0])),
    ];
    insta::assert_snapshot!(refusals.map(|refusal| refusal.unwrap_err().0).join("\n"));
    assert_eq!((bench.mode(), names(&bench)), (Some(SceneMode::Script), before), "the lesson plays on");
    bench.bring("peg 7", [-0.35, 1.0]).unwrap();
    bench.say("task 1 is done").unwrap();
    let text = bench.world.taught("Taken over", bench.now()).unwrap().to_toml();
    let lesson = Lesson::parse(&text, Path::new("taken_over.toml")).unwrap();
    let table = &lesson.demonstrations[0];
    let moved = table.script.iter().rev().find_map(|step| {
        let Act::Move { object, .. } = step.act else { return None };
        Some(table.objects[object].name.as_str())
    });
    assert_eq!(moved, Some("peg 7"));
}

#[test]
fn a_released_object_is_saved_at_its_resting_place() {
    let mut bench = Bench::empty();
    bench.add("square", "red", [0.0, 0.6]).unwrap();
    bench.add("peg", "wood", [0.2, 0.6]).unwrap();
    bench.take("wood peg", 1).unwrap();
    bench.put([0.0, 0.6], 1).unwrap();
    bench.add("square", "blue", [-0.3, 0.9]).unwrap();
    bench.wait(500);
    bench.act(Kind::Undo, |_| {}).unwrap();
    assert!(bench.holds("red square", State::Filled), "{:?}", bench.table());
    bench.act(Kind::Undo, |_| {}).unwrap();
    assert!(bench.lies_at("wood peg", [0.2, 0.6]) && !bench.holds("red square", State::Filled));
    // The recorded lesson says the same.
    bench.take("wood peg", 1).unwrap();
    bench.put([0.0, 0.6], 1).unwrap();
    bench.say("Leo, I can teach you to do it").unwrap();
    let lesson = bench.world.taught("Filled", bench.now()).unwrap();
    let [block, peg] = &lesson.demonstrations[0].objects[..] else { panic!("two objects") };
    assert_eq!(block.place.position_m[..2], peg.place.position_m[..2]);
}

#[test]
fn a_hole_is_reserved_for_the_peg_taken_from_it() {
    let mut bench = Bench::of_two();
    bench.add("square", "red", [0.0, 0.6]).unwrap();
    bench.add("peg", "wood", [0.0, 0.6]).unwrap();
    bench.add("peg", "wood", [0.2, 0.6]).unwrap();
    bench.take("wood peg", 1).unwrap();
    bench.take("wood peg 2", 2).unwrap();
    let refusal = bench.put([0.0, 0.6], 2).unwrap_err();
    assert!(refusal.0.contains("`red square`"), "{refusal}");
    let removal = bench.act(Kind::Remove, |act| act.text = Text::new("red square")).unwrap_err();
    assert!(removal.0.contains("`wood peg`"), "{removal}");
    insta::assert_snapshot!(format!("{refusal}\n{removal}"));
    bench.act(Kind::Cancel, |act| act.hand = 1).unwrap();
    bench.wait(500);
    assert!(bench.holds("wood peg", State::Inserted) && bench.lies_at("wood peg 2", [0.2, 0.6]));
}

fn any_act() -> impl Strategy<Value = TeacherAct> {
    let names = ["", "red", "peg 1", "red square", "wood peg", "wall", "square", "peg", "\u{0}"];
    let number = prop_oneof![-1.0..1.5, Just(f64::NAN), Just(f64::INFINITY), Just(1e300)];
    (
        (0_u16..20, 0_u16..3, 0_u16..3, 0_u64..5),
        proptest::array::uniform3(number.clone()),
        proptest::array::uniform3(number.clone()),
        number,
        (0..names.len(), prop_oneof![Just("red"), Just("wood"), Just("")]),
    )
        .prop_map(
            move |(
                (kind, teacher, hand, table),
                position_m,
                second_vector_m,
                heading_rad,
                (name, colour),
            )| {
                TeacherAct {
                    position_m,
                    second_vector_m,
                    heading_rad,
                    kind,
                    hand,
                    table,
                    text: Text::new(names[name]),
                    colour: Text::new(colour),
                    ..TeacherAct::new(Kind::Say, teacher)
                }
            },
        )
}

proptest! {
    /// Undo reverts any sequence of set-up acts one by one, until the table is empty again.
    #[test]
    fn each_act_is_taken_back_and_no_other(
        acts in proptest::collection::vec((0_u8..7, 0_usize..5, [-0.5..0.5, 0.4..1.2], 0_u64..800), 0..30),
    ) {
        let mut bench = Bench::of_two();
        let mut tables = vec![bench.table()];
        // The person who pushed the screen last, if nothing was done since, and until when the next push is merged.
        let mut push: Option<(u16, u64)> = None;
        for (kind, thing, at, wait) in acts {
            let names = ["red square", "wood peg", "red square 2", "wood peg 2", "wall"];
            let by = if thing < 2 { 1 } else { 2 };
            let stands = bench.table().iter().any(|(name, _)| name == "wall");
            let ms = bench.ms;
            let done = match kind {
                0 => bench.add("square", "red", at),
                1 => bench.add("peg", "wood", at),
                2 => bench.act(Kind::Remove, |act| act.text = Text::new(names[thing])),
                3 => bench.take(names[thing], by),
                4 => bench.put(at, by),
                5 => bench.screen("wall", at, by),
                _ => bench.act(Kind::Cancel, |act| act.hand = by),
            };
            bench.wait(wait);
            // For undo by another person a held thing counts as being where it was taken.
            let is_done = done.is_ok() && (kind < 3 || kind == 4 || kind == 5);
            if is_done {
                let goes_on = kind == 5 && push.is_some_and(|(before, until)| before == by && ms <= until);
                if goes_on {
                    tables.pop();
                }
                push = (kind == 5 && stands).then_some((by, ms + 560));
                let mut rested = Bench { world: bench.world.clone(), ms: bench.ms, said: Vec::new() };
                rested.world.return_all(rested.now());
                rested.wait(1_000);
                tables.push(rested.table());
            }
        }
        bench.world.return_all(bench.now());
        bench.wait(1_000);
        while let Some(table) = tables.pop() {
            prop_assert_eq!(bench.table(), table);
            let undone = bench.act(Kind::Undo, |_| {});
            prop_assert_eq!(undone.is_ok(), !tables.is_empty());
        }
    }

    /// After any sequence of acts all positions are finite, and the recorded lesson can be parsed.
    #[test]
    fn any_sequence_of_acts_leaves_a_consistent_world(acts in proptest::collection::vec((any_act(), 0_u64..400), 0..60)) {
        let mut bench = Bench::new();
        for (act, wait) in acts {
            let _ = bench.world.act(bench.now(), &act, ROOM);
            bench.wait(wait);
            for thing in bench.world.scene() {
                prop_assert!(thing.position_m.iter().all(|coordinate| coordinate.abs() < 200.0), "{thing:?}");
            }
            if let Some(lesson) = bench.world.taught("Anything", bench.now()) {
                let text = lesson.to_toml();
                let read = Lesson::parse(&text, Path::new("anything.toml"));
                prop_assert!(read.is_ok(), "{}\n{text}", read.unwrap_err());
            }
        }
    }
}

//! A simulated table with blocks and pegs, the beliefs of the perspectives, and a body that moves pegs.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use config::Names;
use geometry::{Base, Person, Pose, Position};
use message::{
    Belief, BeliefHead, Event, EventKind, Feature, Header, JointGoal, NOBODY, Remembered, Text, Utterance,
};
use motion::Skill;
use tasks::{OnConflict, Task, key};

use crate::{Body, Input, Kept, Learner, Motion, Output, Settings, StoreChange, Vocabulary};

const STEP: Duration = Duration::from_millis(10);
/// Height to which the teacher lifts a peg, in metres.
const LIFT_M: f64 = 0.12;
const BLOCK_HALF_HEIGHT_M: f64 = 0.03;

#[derive(Clone)]
pub(super) struct Thing {
    pub(super) colour: &'static str,
    pub(super) shape: &'static str,
    pub(super) place_m: [f64; 3],
    /// Filled for a block, inserted for a peg, on for a cylinder.
    pub(super) on: bool,
    pub(super) held_by: u16,
    pub(super) hidden: bool,
}

/// The objects on the table, and the faults of the body.
#[derive(Default)]
pub(super) struct Table {
    pub(super) things: Vec<Thing>,
    /// Insertions that fail before one succeeds, by the colour of the block.
    pub(super) failures: Vec<&'static str>,
    pub(super) skills: Vec<Skill>,
}

impl Table {
    /// A row of squares with holes, and seven pegs in front of them.
    pub(super) fn lay(&mut self, colours: &[&'static str], hidden: Option<usize>) {
        self.things.clear();
        for (index, colour) in colours.iter().enumerate() {
            let y = quantity::number::float_of_count(index).mul_add(0.12, -0.24);
            self.things.push(Thing {
                colour,
                shape: "square",
                place_m: [0.4, y, 0.03],
                on: false,
                held_by: NOBODY,
                hidden: hidden == Some(index),
            });
        }
        for index in 0..7 {
            let y = quantity::number::float_of_count(index).mul_add(0.08, -0.24);
            self.things.push(Thing {
                colour: "wood",
                shape: "peg",
                place_m: [0.28, y, 0.025],
                on: false,
                held_by: NOBODY,
                hidden: false,
            });
        }
    }

    pub(super) fn filled(&self) -> Vec<&'static str> {
        self.things
            .iter()
            .filter(|thing| thing.shape == "square" && thing.on)
            .map(|thing| thing.colour)
            .collect()
    }

    fn insert(&mut self, thing: Position<Base>, hole: Position<Base>) {
        let at = |place: [f64; 3], point: Position<Base>| {
            let [x, y, _] = place;
            let [px, py, _] = point.to_array();
            (x - px).hypot(y - py) < 0.005
        };
        let block =
            self.things.iter().position(|block| block.shape == "square" && at(block.place_m, hole)).unwrap();
        let peg = self.things.iter().position(|peg| peg.shape == "peg" && at(peg.place_m, thing)).unwrap();
        let colour = self.things[block].colour;
        if let Some(failure) = self.failures.iter().position(|&failing| failing == colour) {
            self.failures.remove(failure);
            return;
        }
        let top = hole.to_array();
        self.things[peg].place_m = top;
        self.things[peg].on = true;
        self.things[block].on = true;
    }
}

/// A body whose every skill takes five steps.
pub(super) struct FakeBody {
    table: Rc<RefCell<Table>>,
    under_way: Option<(Skill, u32)>,
}

impl Body for FakeBody {
    fn begin(&mut self, _now: Instant, skill: Skill, _present_rad: &[Option<f64>]) {
        self.table.borrow_mut().skills.push(skill);
        self.under_way = Some((skill, 5));
    }

    fn step(&mut self, now: Instant, _present_rad: &[Option<f64>], goals: &mut Vec<JointGoal>) -> Motion {
        goals.push(JointGoal { joint: 0, reserved: 0, goal_position_rad: 0.0, arrive_at_ns: now.as_nanos() });
        match &mut self.under_way {
            None => Motion::Done,
            Some((skill, 0)) => {
                if let Skill::Insert { thing, hole, .. } = skill {
                    self.table.borrow_mut().insert(*thing, *hole);
                }
                self.under_way = None;
                Motion::Done
            }
            Some((_, left)) => {
                *left -= 1;
                Motion::Running
            }
        }
    }
}

/// A learner at a table, with all its output. Perspective 0 is Leo's; each partner has one more.
pub(super) struct LearnerHarness {
    pub(super) table: Rc<RefCell<Table>>,
    pub(super) learner: Learner<FakeBody>,
    pub(super) events: Vec<Event>,
    /// Each task after every stored example.
    pub(super) saved: Vec<(String, Task)>,
    /// The tasks as they are stored.
    pub(super) known: BTreeMap<String, Task>,
    pub(super) goal_frames: usize,
    pub(super) incarnation: u64,
    /// The first identity that the current belief process assigns.
    first_id: u64,
    /// Indices of objects that the restarted belief process has not perceived.
    pub(super) missing: Vec<usize>,
    partners: u16,
    /// The partner to whom hidden objects are hidden; `None` for all partners.
    pub(super) hidden_from: Option<u16>,
    now: Instant,
    percepts: Percepts,
}

impl LearnerHarness {
    /// With `partners` simulated partners, and `tasks` learned earlier.
    pub(super) fn new(partners: u16, tasks: Vec<Task>) -> Self {
        Self::with(partners, tasks, OnConflict::Human)
    }

    pub(super) fn with(partners: u16, tasks: Vec<Task>, on_conflict: OnConflict) -> Self {
        Self::learning(partners, tasks, tasks::Settings { on_conflict, ..tasks::Settings::default() })
    }

    pub(super) fn learning(partners: u16, tasks: Vec<Task>, learning: tasks::Settings) -> Self {
        let table = Rc::new(RefCell::new(Table::default()));
        let goal_period = Duration::from_millis(20);
        let settings = Settings { learning, goal_period, spoken_language: language::BuiltIn::English };
        let names = Names::try_from(vec!["the teacher".to_owned()]).unwrap();
        let vocabulary = Vocabulary::of(&Percepts::builtin()).unwrap().with_names(&names);
        let body = FakeBody { table: Rc::clone(&table), under_way: None };
        let perspectives: Vec<u16> = (0..=partners).collect();
        Self {
            known: tasks.iter().map(|task| (key(&task.name), task.clone())).collect(),
            learner: Learner::new(settings, vocabulary, &perspectives, body, tasks),
            table,
            events: Vec::new(),
            saved: Vec::new(),
            goal_frames: 0,
            incarnation: 1,
            first_id: 10,
            missing: Vec::new(),
            partners,
            hidden_from: None,
            now: Instant::EPOCH,
            percepts: Percepts::builtin(),
        }
    }

    pub(super) fn steps(&mut self, steps: usize) {
        for _ in 0..steps {
            self.step(&[]);
        }
    }

    pub(super) fn say(&mut self, text: &str) {
        self.say_as(1, text);
    }

    pub(super) fn say_as(&mut self, speaker: u32, text: &str) {
        self.step(&[Utterance { speaker, text: Text::new(text) }]);
    }

    /// A sentence that is received late.
    pub(super) fn say_late(&mut self, text: &str, late: Duration) {
        let said_at = Instant::from_nanos(self.now.as_nanos() - clock::nanos(late));
        self.step_hearing(&[(said_at, Utterance { speaker: 1, text: Text::new(text) })]);
    }

    /// Sentences that are received in one step.
    pub(super) fn say_at_once(&mut self, texts: &[&str]) {
        let said: Vec<Utterance> =
            texts.iter().map(|text| Utterance { speaker: 1, text: Text::new(text) }).collect();
        self.step(&said);
    }

    fn step(&mut self, utterances: &[Utterance]) {
        let said: Vec<(Instant, Utterance)> =
            utterances.iter().map(|utterance| (self.now, *utterance)).collect();
        self.step_hearing(&said);
    }

    fn step_hearing(&mut self, utterances: &[(Instant, Utterance)]) {
        let frames: Vec<(BeliefHead, Vec<Belief>)> = (0..=self.partners).map(|p| self.frame(p)).collect();
        let beliefs: Vec<(&BeliefHead, &[Belief])> =
            frames.iter().map(|(head, entries)| (head, entries.as_slice())).collect();
        let input = Input { beliefs: &beliefs, utterances, present_rad: &[] };
        let Output { save, events, goals } = self.learner.step(self.now, &input);
        for change in save {
            match change {
                StoreChange::Example(Kept { key, task, index, example }) => {
                    let known =
                        self.known.entry(key.clone()).or_insert(Task { name: task, examples: Vec::new() });
                    assert_eq!(u64::try_from(known.examples.len()), Ok(index), "an example is appended");
                    known.examples.push(example);
                    self.saved.push((key, known.clone()));
                }
                StoreChange::Rewrite { key: old, task } => {
                    self.known.remove(&old);
                    self.known.extend(task.map(|task| (key(&task.name), task)));
                }
            }
        }
        self.events.extend(events);
        self.goal_frames += usize::from(!goals.is_empty());
        self.now += STEP;
    }

    fn frame(&self, perspective: u16) -> (BeliefHead, Vec<Belief>) {
        let percepts = &self.percepts;
        let mut header = Header::at(self.now.as_nanos());
        header.incarnation = self.incarnation;
        let mut head = BeliefHead::of(u32::from(perspective), header);
        let x_base_person: Pose<Base, Person> = if perspective == 0 {
            Pose::identity()
        } else {
            Pose::upright(1.5, 0.0, 0.0, std::f64::consts::PI)
        };
        head.frame_position_m = x_base_person.position_m();
        head.frame_orientation_xyzw = x_base_person.orientation_xyzw();
        let table = self.table.borrow();
        let things = (self.first_id..).zip(table.things.iter().enumerate());
        let looks_past_it = perspective == 0 || self.hidden_from.is_some_and(|blind| blind != perspective);
        let beliefs = things
            .filter(|(_, (index, thing))| !(self.missing.contains(index) || !looks_past_it && thing.hidden))
            .map(|(id, (_, thing))| {
                let mut belief = Belief::new(id, 0, self.now.as_nanos(), 1, thing.held_by);
                let mut push = |name: &str, feature| {
                    let percept = percepts.index(name).unwrap();
                    belief.push(Remembered::new(percept, self.now.as_nanos(), 1.0, 0.9, feature));
                };
                let [x, y, z] = thing.place_m;
                let place = x_base_person.inverse() * Position::new(x, y, z);
                push("position", Feature::Vector(place.to_array().map(quantity::number::single)));
                push("colour", symbol(percepts, "colour", thing.colour));
                push("shape", symbol(percepts, "shape", thing.shape));
                push("size", symbol(percepts, "size", if thing.shape == "peg" { "small" } else { "medium" }));
                let state = match thing.shape {
                    "peg" => "inserted",
                    "cylinder" => "on",
                    _ => "filled",
                };
                push(state, Feature::Number(if thing.on { 1.0 } else { 0.0 }));
                belief
            })
            .collect();
        (head, beliefs)
    }

    /// Restarts the belief process with new identities: each number now denotes a neighbouring object.
    pub(super) fn restart_belief(&mut self) {
        self.incarnation += 1;
        self.first_id += 1;
    }

    /// The teacher takes peg `peg` and inserts it into block `block`.
    pub(super) fn insert(&mut self, peg: usize, block: usize) {
        let pegs = self.table.borrow().things.iter().position(|thing| thing.shape == "peg").unwrap();
        let (from, to) = {
            let table = self.table.borrow();
            let [x, y, middle_m] = table.things[block].place_m;
            (table.things[pegs + peg].place_m, [x, y, middle_m + BLOCK_HALF_HEIGHT_M])
        };
        for step in 1..=40_i32 {
            // Up in the first quarter, across, and down in the last.
            let gone = f64::from(step) / 40.0;
            let share = gone.mul_add(2.0, -0.5).clamp(0.0, 1.0);
            let lifted = (4.0 * gone.min(1.0 - gone)).clamp(0.0, 1.0);
            {
                let mut table = self.table.borrow_mut();
                let thing = &mut table.things[pegs + peg];
                thing.held_by = 1;
                for (place, (from, to)) in thing.place_m.iter_mut().zip(from.iter().zip(&to)) {
                    *place = (to - from).mul_add(share, *from);
                }
                thing.place_m[2] += LIFT_M * lifted;
            }
            self.step(&[]);
        }
        {
            let mut table = self.table.borrow_mut();
            table.things[pegs + peg].held_by = NOBODY;
            table.things[pegs + peg].on = true;
            table.things[block].on = true;
        }
        self.steps(50);
    }

    /// Lays another table and waits until it is perceived.
    pub(super) fn lay_anew(&mut self, colours: &[&'static str], hidden: Option<usize>) {
        self.table.borrow_mut().lay(colours, hidden);
        self.first_id += 100;
        self.steps(10);
    }

    /// A task as stored last.
    pub(super) fn task(&self, key: &str) -> Task {
        let saved = self.saved.iter().rfind(|(saved, _)| saved == key);
        saved.map(|(_, task)| task.clone()).unwrap()
    }

    /// A demonstration of Task 1: the teacher fills every visible hole.
    pub(super) fn demonstrate(&mut self, colours: &[&'static str], meanwhile: impl FnOnce(&mut Self)) {
        self.demonstrate_as(1, colours, meanwhile);
    }

    pub(super) fn demonstrate_as(
        &mut self,
        teacher: u32,
        colours: &[&'static str],
        meanwhile: impl FnOnce(&mut Self),
    ) {
        let hidden = colours.len() - 1;
        self.lay_anew(colours, Some(hidden));
        self.say_as(teacher, "Leo, I can teach you to do task 1.");
        self.steps(20);
        self.insert(0, 0);
        meanwhile(self);
        for block in 1..hidden {
            self.insert(block, block);
        }
        self.say_as(teacher, "Task 1 is done!");
        self.steps(10);
    }

    pub(super) fn teach(&mut self) {
        self.demonstrate(&["red", "green", "yellow", "red", "blue"], |_| {});
        self.demonstrate(&["green", "yellow", "red", "yellow", "blue"], |_| {});
    }

    /// Lays the novel set of objects and requests the performance.
    pub(super) fn perform(&mut self, failures: &[&'static str]) {
        self.perform_with(failures, |_| {});
    }

    pub(super) fn perform_with(&mut self, failures: &[&'static str], meanwhile: impl FnOnce(&mut Self)) {
        self.table.borrow_mut().failures = failures.to_vec();
        self.lay_anew(&["blue", "red", "green", "blue", "yellow"], None);
        self.say("Leo, do task 1");
        meanwhile(self);
        for _ in 0..100 {
            self.steps(50);
            if !self.learner.is_performing() {
                break;
            }
        }
        assert!(!self.learner.is_performing(), "it ended");
    }

    /// What was said, explained and named so far, one event a line: for a snapshot.
    pub(super) fn transcript(&self) -> String {
        const WORDED: [EventKind; 5] = [
            EventKind::Said,
            EventKind::ActionSeen,
            EventKind::Explained,
            EventKind::StepFailed,
            EventKind::MovementSeen,
        ];
        let wording = self.events.iter().filter_map(|event| {
            let kind = event.kind().filter(|kind| WORDED.contains(kind))?;
            Some(format!("{kind:?}: {}\n", event.text.as_str()))
        });
        wording.collect()
    }

    pub(super) fn texts(&self, kind: EventKind) -> Vec<String> {
        let of_kind = self.events.iter().filter(|event| event.kind() == Some(kind));
        of_kind.map(|event| event.text.as_str().to_owned()).collect()
    }
}

fn symbol(percepts: &Percepts, percept: &str, value: &str) -> Feature {
    let index = percepts.index(percept).unwrap();
    let symbol = percepts.get(index).unwrap().symbols().position(|symbol| symbol == value).unwrap();
    Feature::Symbol(u16::try_from(symbol).unwrap())
}

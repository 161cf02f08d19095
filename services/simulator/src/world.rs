use std::sync::Arc;

use clock::{Duration, Instant};
use config::lesson::{Act, Destination, Lesson, Object, Table};
use geometry::{Base, Pose};
use message::{SceneMode, Utterance};

use crate::gaussian::Gaussian;
use crate::hand::{self, Grasp, Hand};
use crate::path::{Glide, MotionProfile, Path};
use crate::recorder::DemonstrationRecorder;
use crate::script_event::{Event, ScriptEvent, timeline};
use crate::settle::{self, Rest, half_height_m};
use crate::teacher::Teacher;
use crate::thing::{Motion, Seat, SeatKind, Thing};

/// The workspace: the table with its objects, the teachers, and Leo's hands.
///
/// Deterministic: the same lesson, seed and steps give the same observations, bit for bit. After
/// `new` nothing is allocated.
#[derive(Clone, Debug)]
pub struct World {
    pub(crate) lesson: Lesson,
    /// The initial content of each of the lesson's tables.
    settings: Vec<Arc<Table>>,
    pub(crate) x_base_world: Pose<Base, geometry::World>,
    pub(crate) state: State,
    noise: Gaussian,
}

/// The mutable state.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) mode: SceneMode,
    /// The scheduled events: the lesson's script, or the laying of a table on request.
    pub(crate) script_events: Vec<ScriptEvent>,
    /// Duration of these events.
    pub(crate) lasts: Duration,
    /// When they began.
    pub(crate) began: Option<Instant>,
    pub(crate) now: Instant,
    pub(crate) next_cue: usize,
    /// Index of the first event of this step; the events of the step end at `next_cue`.
    pub(crate) first_cue: usize,
    /// Index of the lesson's table that is laid.
    pub(crate) table: Option<usize>,
    /// When its objects were laid.
    pub(crate) laid_at: Option<Instant>,
    /// Its content; the occluders are put up once `has_occluders`.
    pub(crate) layout: Option<Arc<Table>>,
    pub(crate) has_occluders: bool,
    /// The centres of the occluders.
    pub(crate) screens: Vec<Glide>,
    pub(crate) things: Vec<Thing>,
    pub(crate) teachers: Vec<Teacher>,
    grasps: [Grasp; 2],
    /// Interactive utterances of this step, and those of the next one.
    pub(crate) said: Vec<Utterance>,
    pub(crate) saying: Vec<Utterance>,
    pub(crate) recorder: DemonstrationRecorder,
    /// The things in people's hands.
    pub(crate) taken: Vec<HeldThing>,
    pub(crate) undo: Vec<Undo>,
    /// The result of the interactive act that is being executed.
    pub(crate) outcome: Option<String>,
    /// The noise offset of each observation of this step, in their order, in metres.
    pub(crate) offsets_m: Vec<[f64; 3]>,
}

/// A thing in a person's hand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldThing {
    pub(crate) hand: u16,
    pub(crate) by: u16,
    pub(crate) index: usize,
    pub(crate) at: Instant,
    pub(crate) from: Pose<geometry::World, geometry::Thing>,
    pub(crate) seat: Option<Seat>,
}

/// How to undo an act.
#[derive(Clone, Debug)]
pub(crate) enum Undo {
    /// During set-up: restores the table, with everything at rest.
    TableLayout { layout: Arc<Table>, things: Vec<Thing>, screens: Vec<Glide> },
    /// During teaching: moves the thing back, visible to everyone.
    Move { index: usize, to: Destination },
    /// Pushes an occluder back: at once during set-up, and visibly during teaching.
    Push { by: u16, occluder: usize, from_m: [f64; 3], until: Instant },
}

impl World {
    /// The world of a lesson before its script begins. `seed` is for the noise.
    #[must_use]
    pub fn new(lesson: &Lesson, seed: u64) -> Self {
        let (script_events, lasts) = timeline(lesson);
        let [x, y, z] = lesson.robot.position_m;
        let x_world_base = Pose::<geometry::World, Base>::upright(x, y, z, lesson.robot.heading_rad);
        let max = |count: fn(&Table) -> usize| lesson.tables().map(count).max().unwrap_or(0);
        let objects = max(|table| table.objects.len());
        let occluders = max(|table| table.occluders.len());
        let observations = objects + occluders + lesson.teachers.len();
        Self {
            settings: lesson
                .tables()
                .map(|table| Arc::new(Table { script: Vec::new(), ..table.clone() }))
                .collect(),
            x_base_world: x_world_base.inverse(),
            state: State {
                script_events,
                lasts,
                screens: Vec::with_capacity(occluders),
                things: Vec::with_capacity(objects),
                teachers: lesson.teachers.iter().map(Teacher::new).collect(),
                recorder: DemonstrationRecorder::new(lesson.teachers.len()),
                offsets_m: vec![[0.0; 3]; observations],
                ..State::default()
            },
            noise: Gaussian::new(seed),
            lesson: lesson.clone(),
        }
    }

    /// Schedules the script's beginning; without it, the script begins with the first step.
    pub fn begin(&mut self, at: Instant) {
        self.state.began = Some(at);
    }

    /// The duration of the script.
    #[must_use]
    pub fn lasts(&self) -> Duration {
        self.state.lasts
    }

    /// Whether the script is over; Leo may still be at work. Interactive teaching never finishes by itself.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        let is_over = |began| self.state.now >= began + self.state.lasts;
        self.state.mode == SceneMode::Script
            && self.state.next_cue == self.state.script_events.len()
            && self.state.began.is_some_and(is_over)
    }

    /// Advances the world to `now`; an earlier instant than that of the last step is replaced by the latter.
    ///
    /// `hands` are Leo's left and right hand at `now`, `None` if unknown. A hand that closes grasps the loose peg or
    /// marker whose centre is within 3 cm of its grasp point; the thing then moves rigidly with it.
    ///
    /// When the hand opens, a peg slides into a free hole within 2 cm of its axis. Its lower end must be 5 to 60 mm
    /// below the hole's top. Anything else falls upright onto what is below it.
    pub fn step(&mut self, now: Instant, hands: [Option<Hand>; 2]) {
        let now = now.max(self.state.now);
        let began = *self.state.began.get_or_insert(now);
        self.state.said.clear();
        std::mem::swap(&mut self.state.said, &mut self.state.saying);
        self.state.first_cue = self.state.next_cue;
        while let Some(&script_event) = self
            .state
            .script_events
            .get(self.state.next_cue)
            .filter(|script_event| began + script_event.at <= now)
        {
            self.state.next_cue += 1;
            self.advance(began + script_event.at);
            self.take(script_event, began + script_event.at);
        }
        self.advance(now);
        self.state.now = now;
        for (index, hand) in hands.into_iter().enumerate() {
            if let Some(hand) = hand.filter(|hand| is_finite(&hand.pose)) {
                self.move_hand(index, &hand);
            }
        }
        follow(&mut self.state.things);
        let observations = self.state.things.len() + self.state.screens.len() + self.state.teachers.len();
        if self.state.offsets_m.len() < observations {
            self.state.offsets_m.resize(observations, [0.0; 3]);
        }
        for offset in &mut self.state.offsets_m {
            *offset = [(); 3].map(|()| self.noise.next() * self.lesson.noise.position_sd_m);
        }
    }

    /// The objects, in the order of `state.things`.
    pub(crate) fn objects(&self) -> &[Object] {
        self.state.layout.as_ref().map_or(&[][..], |layout| &layout.objects)
    }

    /// The events of the last step.
    pub(crate) fn recent_cues(&self) -> &[ScriptEvent] {
        self.state.script_events.get(self.state.first_cue..self.state.next_cue).unwrap_or(&[])
    }

    fn advance(&mut self, now: Instant) {
        for thing in &mut self.state.things {
            thing.advance(now);
        }
        follow(&mut self.state.things);
    }

    fn take(&mut self, script_event: ScriptEvent, now: Instant) {
        let Some(table) = self.lesson.tables().nth(script_event.table) else { return };
        let state = &mut self.state;
        match script_event.event {
            Event::Clear => {
                state.empty_table();
                // Occluders pushed on the old table are gone.
                state.undo.clear();
            }
            Event::Occlude => {
                state.table = Some(script_event.table);
                state.layout = self.settings.get(script_event.table).cloned();
                state.has_occluders = true;
                state.screens.extend(table.occluders.iter().map(|screen| Glide::resting(screen.centre_m)));
            }
            Event::Lay => {
                state.things.extend(table.objects.iter().map(Thing::laid));
                settle::seat_laid_things(&mut state.things, &table.objects);
                state.laid_at = Some(now);
                state.recorder.lay(state.teachers.iter().map(|teacher| teacher.person_state(now)));
            }
            Event::Step(index) => {
                let Some(step) = table.script.get(index) else { return };
                let teacher = state.teachers.iter_mut().find(|teacher| teacher.number == step.who);
                match (&step.act, teacher) {
                    (Act::Move { object, to, takes }, _) => {
                        begin_move(&mut state.things, &table.objects, *object, *to, (step.who, now, *takes));
                    }
                    (Act::Look { at_m, takes }, Some(teacher)) => teacher.gaze.go(now, *at_m, *takes),
                    (Act::Walk { eyes_m, takes }, Some(teacher)) => teacher.eyes.go(now, *eyes_m, *takes),
                    (Act::Slide { occluder, centre_m, takes }, _) => {
                        if let Some(screen) = state.screens.get_mut(*occluder) {
                            screen.go(now, *centre_m, *takes);
                        }
                    }
                    (Act::Leave, Some(teacher)) => teacher.is_present = false,
                    (Act::Return, Some(teacher)) => teacher.is_present = true,
                    (Act::Say(_), _)
                    | (Act::Look { .. } | Act::Walk { .. } | Act::Leave | Act::Return, None) => {}
                }
            }
        }
    }

    fn move_hand(&mut self, index: usize, hand: &Hand) {
        let now = self.state.now;
        let x_world_hand = self.x_base_world.inverse() * hand.pose;
        let closes = self.state.grasps.get_mut(index).and_then(|grasp| grasp.note(hand.closure_rad));
        let Some(layout) = self.state.layout.clone() else { return };
        let things = &mut self.state.things;
        for thing in things.iter_mut() {
            if let Motion::Grasped { hand, x_hand_thing } = thing.motion
                && hand == index
            {
                thing.pose = x_world_hand * x_hand_thing;
            }
        }
        match closes {
            None => {}
            Some(true) => hand::grasp(things, index, &x_world_hand),
            Some(false) => {
                let taken = &self.state.taken;
                let is_kept = |block| taken.iter().any(|taken| settle::is_in(taken.seat, block));
                hand::release(things, &layout.objects, index, now, is_kept);
            }
        }
    }
}

/// Moves resting things that sit in or on another one along with it.
pub(crate) fn follow(things: &mut [Thing]) {
    for index in 0..things.len() {
        let seat = things.get(index).filter(|thing| matches!(thing.motion, Motion::AtRest));
        let Some(seat) = seat.and_then(|thing| thing.seat) else { continue };
        let Some(below) = things.get(seat.on).map(|thing| thing.pose) else { continue };
        if let Some(thing) = things.get_mut(index) {
            thing.pose = below * seat.x_on_thing;
        }
    }
}

/// Starts a scripted move, unless Leo holds the object or its destination is no longer free.
pub(crate) fn begin_move(
    things: &mut [Thing],
    objects: &[Object],
    index: usize,
    to: Destination,
    (by, begins, takes): (u16, Instant, Duration),
) {
    let Some(rest) = destination(things, objects, index, to) else { return };
    let Some(thing) = things.get_mut(index) else { return };
    match thing.motion {
        Motion::AtRest | Motion::Settling { .. } => {}
        Motion::Carried { .. } | Motion::Grasped { .. } | Motion::InHand { .. } => return,
    }
    let path = Path { from: thing.pose, to: rest.pose, begins, takes, manner: MotionProfile::Carry };
    thing.seat = None;
    thing.motion = Motion::Carried { by, path, to: rest.seat };
}

pub(crate) fn destination(
    things: &[Thing],
    objects: &[Object],
    index: usize,
    to: Destination,
) -> Option<Rest> {
    match to {
        Destination::UprightPose(place) => {
            let [x, y, z] = place.position_m;
            Some(Rest { pose: Pose::upright(x, y, z, place.heading_rad), seat: None })
        }
        // Half of a peg in a hole stands out of it: its centre is at the hole's top.
        Destination::Hole(block) if settle::is_free(things, block) => {
            settle::seated(things, block, SeatKind::Hole, half_height_m(objects.get(block)?))
        }
        Destination::Hole(_) => None,
        Destination::Top(below) => {
            let raised_m = half_height_m(objects.get(below)?) + half_height_m(objects.get(index)?);
            settle::seated(things, below, SeatKind::Top, raised_m)
        }
    }
}

fn is_finite(pose: &Pose<Base, geometry::Hand>) -> bool {
    pose.position_m().iter().chain(&pose.orientation_xyzw()).all(|number| number.is_finite())
}

use clock::Duration;
use message::{
    ActAnswer, Belief, Event, EventKind, Feature, Head as _, Header, Hop, JointCause, JointGoal, JointGoals,
    JointMode, JointState, Observation, Perceived, PerceptHead, PerceptValue, Percepts, SceneObject,
    Snapshot, SourceSet, TeacherAct, TeacherActKind, Text, Topic, Utterance,
};
use transport::{FramePublisher, Node, OverflowPolicy, Queues, TopicPorts};

/// As in `leo.toml`: queues and frame capacity of a domain.
pub(crate) const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
const CAPACITY: usize = 64;
const JOINTS: usize = 65;

/// Offset of the false joint goals, in radians.
pub(crate) const GOAL_OFFSET_RAD: f64 = 0.2;
/// A position where the lesson has no object.
pub(crate) const FALSE_PLACE_M: [f32; 3] = [0.2, 0.9, 0.4];
/// Number of the position percept in `percepts.toml`.
const POSITION: u16 = 0;

/// Publishes on the topic of a dead process.
pub(crate) struct Rogue<T: TopicPorts> {
    publisher: FramePublisher<T>,
}

impl<T: TopicPorts> Rogue<T> {
    pub(crate) fn open(node: &Node, number: Option<u32>) -> Option<Self> {
        let capacity = if T::NAME == JointGoals::NAME { JOINTS } else { CAPACITY };
        node.publisher(number, capacity).ok().map(|publisher| Self { publisher })
    }

    pub(crate) fn publish(&mut self, mut head: T::Head, entries: &[T::Entry]) {
        let now_ns = clock::now().as_nanos();
        head.header_mut().valid_at_ns = now_ns;
        self.publisher.send_all(head, entries, |_| {}).expect("never blocks");
    }
}

impl Rogue<JointGoals> {
    /// Sends goals that move every joint away from its position.
    pub(crate) fn publish_goals(&mut self, places: &[f64]) {
        let arrive_at_ns = (clock::now() + Duration::from_millis(300)).as_nanos();
        let goal = |(joint, place): (usize, &f64)| JointGoal {
            joint: u32::try_from(joint).expect("few"),
            reserved: 0,
            goal_position_rad: place + GOAL_OFFSET_RAD,
            arrive_at_ns,
        };
        let goals: Vec<JointGoal> = places.iter().enumerate().map(goal).collect();
        self.publish(Header::default(), &goals);
    }
}

impl Rogue<Percepts> {
    /// Reports a non-existing object.
    pub(crate) fn publish_percepts(&mut self) {
        let now = clock::now().as_nanos();
        let mut header = Header::at(now);
        header.pass(Hop::Observed, now);
        header.pass(Hop::SensorStarted, now);
        header.pass(Hop::Perceived, now);
        let head = PerceptHead::new(header, SourceSet::of(0));
        let mut snapshot = Snapshot::default();
        assert!(snapshot.push(PerceptValue::new(POSITION, 1.0, 1.0, Feature::Vector(FALSE_PLACE_M))));
        let observation = Observation { position_m: FALSE_PLACE_M, ..observation() };
        self.publish(head, &[Perceived { observation, snapshot }]);
    }
}

/// Whether a belief is in the non-existing object.
pub(crate) fn is_of_false_place(belief: &Belief) -> bool {
    let place = belief.vector(POSITION).unwrap_or([f64::NAN; 3]);
    place.iter().zip(FALSE_PLACE_M).all(|(one, other)| (one - f64::from(other)).abs() < 0.01)
}

pub(crate) fn observation() -> Observation {
    Observation::object(0, clock::now().as_nanos())
}

pub(crate) fn belief() -> Belief {
    Belief::new(1, 1, 1, 1, 0)
}

pub(crate) fn utterance() -> Utterance {
    Utterance { speaker: 1, text: Text::new("Leo, do task 1") }
}

pub(crate) fn scene_object() -> SceneObject {
    SceneObject::default()
}

pub(crate) fn answer() -> ActAnswer {
    ActAnswer { serial: 1, refused: 0, text: Text::default() }
}

pub(crate) fn joint_state() -> JointState {
    JointState::unread(0, JointMode::Following, JointCause::None)
}

pub(crate) fn act() -> TeacherAct {
    TeacherAct::new(TeacherActKind::Say, 1)
}

pub(crate) fn event() -> Event {
    Event::new(EventKind::Said, "task 1", "I know it")
}

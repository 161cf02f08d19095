//! Messages for common viewers: the frames converted into ROS 2 messages. A recording contains them, and `leo view`
//! sends them.

use belief::percepts::{Kernel, Percepts, Space};
use config::Robot;
use geometry::{Base, Pose, World};
use kinematics::{Body, BodyError};
use message::{
    Belief, BeliefHead, Beliefs, Events, Feature, JointStates, Path, Scene, SceneObject, TopicId, Utterances,
};
use nalgebra::Isometry3;
use quantity::number::single;
use reports::events::event_text;

use crate::Frame;
use crate::cdr::Cdr;
use crate::marker::{Form, Marker, markers, pose};

/// Minimum interval between pictures of a topic, in nanoseconds; the raw channels contain every frame.
const MIN_PICTURE_INTERVAL_NS: u64 = 20_000_000;
/// The frame of the room.
const WORLD: &str = "world";
/// The severity of log messages.
const INFO: u8 = 20;
/// Half extents of a belief whose extents are unknown, in metres.
const UNKNOWN_M: [f32; 3] = [0.02; 3];
/// The colour of objects without a known one.
const GREY: [f32; 3] = [0.5; 3];

/// The definition of a ROS 2 message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Schema {
    /// Its name, such as `sensor_msgs/msg/JointState`.
    pub name: &'static str,
    /// Its text, with the definitions of its parts.
    pub text: &'static str,
}

impl Schema {
    /// The encoding of its text, by the name that MCAP and the live protocol of Foxglove give it.
    pub const ENCODING: &'static str = "ros2msg";
    /// The encoding of its messages, by the name that both give it.
    pub const MESSAGE_ENCODING: &'static str = "cdr";
}

const JOINT_STATE: Schema =
    Schema { name: "sensor_msgs/msg/JointState", text: include_str!("ros2msg/JointState.msg") };
const LOG: Schema = Schema { name: "rcl_interfaces/msg/Log", text: include_str!("ros2msg/Log.msg") };
const MARKERS: Schema =
    Schema { name: "visualization_msgs/msg/MarkerArray", text: include_str!("ros2msg/MarkerArray.msg") };
const TEXT: Schema = Schema { name: "std_msgs/msg/String", text: include_str!("ros2msg/String.msg") };
const TRANSFORMS: Schema =
    Schema { name: "tf2_msgs/msg/TFMessage", text: include_str!("ros2msg/TFMessage.msg") };

/// A message for viewers.
#[derive(Clone, Debug)]
pub struct ViewerMessage {
    /// The name of its channel, such as `/tf`.
    pub topic: String,
    /// Its definition; every message of a channel has the same.
    pub schema: Schema,
    /// The encoded message.
    pub bytes: Vec<u8>,
}

/// Converts frames into messages for viewers: the one table of the channels of recordings and of live viewers.
#[derive(Clone, Debug)]
pub struct ViewerMessages {
    robot: Robot,
    body: Body,
    x_world_base: Isometry3<f64>,
    shown: Shown,
    positions_rad: Vec<f64>,
    has_described: bool,
    pictured_ns: Vec<(TopicId, u64)>,
}

/// The indices of the percepts that are drawn.
#[derive(Clone, Copy, Debug, Default)]
struct Shown {
    position: Option<u16>,
    orientation: Option<u16>,
    extents: Option<u16>,
    colour: Option<u16>,
}

impl ViewerMessages {
    /// Those of a robot whose base has this pose in the room.
    ///
    /// # Errors
    ///
    /// The body for viewers is invalid.
    pub fn new(robot: &Robot, x_world_base: &Pose<World, Base>) -> Result<Self, BodyError> {
        let names: Vec<&str> = robot.motor.joints.iter().map(|joint| joint.name.as_str()).collect();
        let body = Body::from_urdf(&robot.urdf, &names)?;
        Ok(Self {
            positions_rad: vec![0.0; names.len()],
            body,
            x_world_base: *x_world_base.isometry(),
            shown: Shown::among(&robot.percepts),
            robot: robot.clone(),
            has_described: false,
            pictured_ns: Vec::new(),
        })
    }

    /// The messages for a frame; none for a malformed frame. Those for the first frame include the robot's description.
    pub fn of(&mut self, frame: &Frame) -> Vec<ViewerMessage> {
        let mut messages = Vec::new();
        if !self.has_described {
            self.has_described = true;
            let mut cdr = Cdr::new();
            cdr.string(&self.robot.urdf);
            messages.push(message("/robot_description", TEXT, cdr.finish()));
        }
        let topic = frame.topic;
        if topic == TopicId::JointStates {
            self.joints(frame, &mut messages);
        } else if topic == TopicId::Utterances {
            self.utterances(frame, &mut messages);
        } else if topic == TopicId::Events {
            self.events(frame, &mut messages);
        } else if topic == TopicId::Scene && self.is_due(frame) {
            scene(frame, &mut messages);
        } else if matches!(topic, TopicId::Beliefs(_)) && self.is_due(frame) {
            self.beliefs(frame, &mut messages);
        }
        messages
    }

    /// Whether the next picture of a topic is due.
    fn is_due(&mut self, frame: &Frame) -> bool {
        let known = self.pictured_ns.iter_mut().find(|(topic, _)| *topic == frame.topic);
        match known {
            Some((_, last)) if frame.at_ns.abs_diff(*last) < MIN_PICTURE_INTERVAL_NS => false,
            Some((_, last)) => {
                *last = frame.at_ns;
                true
            }
            None => {
                self.pictured_ns.push((frame.topic, frame.at_ns));
                true
            }
        }
    }

    fn joints(&mut self, frame: &Frame, messages: &mut Vec<ViewerMessage>) {
        let Some((_, states)) = frame.read::<JointStates>() else { return };
        let joints: Vec<_> = states
            .iter()
            .filter_map(|state| {
                let index = usize::try_from(state.joint).ok()?;
                Some((index, self.robot.motor.joints.get(index)?, state))
            })
            .collect();
        let mut cdr = Cdr::new();
        cdr.header(frame.at_ns, "");
        cdr.length(joints.len());
        joints.iter().for_each(|(_, joint, _)| cdr.string(&joint.name));
        let numbers = |of: fn(&message::JointState) -> Option<f64>| {
            joints.iter().map(|(_, _, state)| of(state).unwrap_or(f64::NAN)).collect::<Vec<_>>()
        };
        let positions = numbers(message::JointState::present_position_rad);
        cdr.f64_sequence(&positions);
        cdr.f64_sequence(&numbers(message::JointState::present_velocity_rad_s));
        // JointState has no field for currents, and a current is not an effort.
        cdr.f64_sequence(&[]);
        for ((index, ..), position) in joints.iter().zip(&positions) {
            if let Some(slot) = self.positions_rad.get_mut(*index).filter(|_| position.is_finite()) {
                *slot = *position;
            }
        }
        messages.push(message("/joint_states", JOINT_STATE, cdr.finish()));
        if self.is_due(frame) {
            let root = (WORLD, self.body.root(), self.x_world_base);
            let links: Vec<_> = [root].into_iter().chain(self.body.links(&self.positions_rad)).collect();
            messages.push(message("/tf", TRANSFORMS, transforms(frame.at_ns, &links)));
        }
    }

    fn beliefs(&self, frame: &Frame, messages: &mut Vec<ViewerMessage>) {
        let Some((head, beliefs)) = frame.read::<Beliefs>() else { return };
        let Some(x_base_frame) = head.frame() else { return };
        let mut drawn = Vec::new();
        if let Some(eye) = head.eye().filter(|_| head.present != 0) {
            drawn.push(Marker {
                kind: "eye",
                id: 0,
                form: Form::Arrow,
                pose: *eye.isometry(),
                scale_m: [0.3, 0.02, 0.02],
                colour_rgba: [1.0, 1.0, 1.0, 0.8],
                text: "",
            });
        }
        drawn.extend(beliefs.iter().filter_map(|belief| self.belief(x_base_frame.isometry(), belief)));
        let topic = format!("/beliefs/{}", self.whose(&head));
        let bytes = markers(frame.at_ns, self.body.root(), &drawn);
        messages.push(message(&topic, MARKERS, bytes));
    }

    fn belief(&self, x_base_frame: &Isometry3<f64>, belief: &Belief) -> Option<Marker<'static>> {
        let percept = |number: Option<u16>| belief.percept(number?);
        let position = percept(self.shown.position)?;
        let Some(Feature::Vector(place_m)) = position.feature() else { return None };
        let orientation = percept(self.shown.orientation).and_then(message::Remembered::feature);
        let xyzw = match orientation {
            Some(Feature::Orientation(xyzw)) => xyzw.map(f64::from),
            _ => [0.0, 0.0, 0.0, 1.0],
        };
        let x_frame_thing = Pose::<Base, geometry::Thing>::from_parts(place_m.map(f64::from), xyzw)?;
        let half_m = match percept(self.shown.extents).and_then(message::Remembered::feature) {
            Some(Feature::Vector(half_m)) => half_m,
            _ => UNKNOWN_M,
        };
        let colour = percept(self.shown.colour).and_then(message::Remembered::feature);
        let [red, green, blue] = self.colour(colour).unwrap_or(GREY);
        Some(Marker {
            kind: "beliefs",
            id: i32::try_from(belief.id).unwrap_or(i32::MAX),
            form: Form::Cube,
            pose: x_base_frame * x_frame_thing.isometry(),
            scale_m: half_m.map(|half| 2.0 * f64::from(half)),
            // Opacity shows the confidence.
            colour_rgba: [red, green, blue, position.confidence.clamp(0.1, 1.0)],
            text: "",
        })
    }

    /// The colour of a prototype.
    fn colour(&self, feature: Option<Feature>) -> Option<[f32; 3]> {
        let Some(Feature::Symbol(index)) = feature else { return None };
        let percept = self.robot.percepts.percepts.get(usize::from(self.shown.colour?))?;
        let Kernel::Nearest(nearest) = &percept.kernel else { return None };
        let at = &nearest.prototypes.get(usize::from(index))?.at;
        let numbers: [f64; 3] = at.as_slice().try_into().ok()?;
        Some(numbers.map(single))
    }

    /// Name of the perspective: `leo`, `the_teacher`, or for nested ones `the_teacher/leo`.
    fn whose(&self, head: &BeliefHead) -> String {
        let names = &self.robot.leo.belief.names;
        let plain = |name: String| {
            let plain = |letter: char| if letter.is_alphanumeric() { letter } else { '_' };
            name.to_lowercase().chars().map(plain).collect::<String>()
        };
        match head.path.agents() {
            Some([]) | None if head.path == Path::ROBOT => plain(names.of(0)),
            Some(agents) => agents.iter().map(|agent| plain(names.of(*agent))).collect::<Vec<_>>().join("/"),
            None => head.perspective.to_string(),
        }
    }

    fn utterances(&self, frame: &Frame, messages: &mut Vec<ViewerMessage>) {
        let Some((_, utterances)) = frame.read::<Utterances>() else { return };
        for utterance in utterances {
            let speaker = u16::try_from(utterance.speaker).unwrap_or(message::NOBODY);
            let name = self.robot.leo.belief.names.of(speaker);
            messages.push(log(frame.at_ns, &name, utterance.text.as_str()));
        }
    }

    fn events(&self, frame: &Frame, messages: &mut Vec<ViewerMessage>) {
        let Some((_, events)) = frame.read::<Events>() else { return };
        let names = &self.robot.leo.belief.names;
        for event in &events {
            if let Some((kind, text)) = event_text(names, event) {
                messages.push(log(frame.at_ns, &names.of(0), &format!("{}: {text}", kind.word())));
            }
        }
    }
}

impl Shown {
    fn among(percepts: &Percepts) -> Self {
        let first = |kernel: &Kernel| percepts.with_kernel(|its| its == kernel).next();
        Self {
            position: first(&Kernel::Position),
            orientation: first(&Kernel::Orientation),
            extents: first(&Kernel::Extents),
            colour: percepts.nearest_in(Space::Colour).next(),
        }
    }
}

fn message(topic: &str, schema: Schema, bytes: Vec<u8>) -> ViewerMessage {
    ViewerMessage { topic: topic.to_owned(), schema, bytes }
}

fn transforms(at_ns: u64, links: &[(&str, &str, Isometry3<f64>)]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.length(links.len());
    for (parent, child, x_parent_child) in links {
        cdr.header(at_ns, parent);
        cdr.string(child);
        pose(&mut cdr, x_parent_child);
    }
    cdr.finish()
}

fn scene(frame: &Frame, messages: &mut Vec<ViewerMessage>) {
    let Some((_, objects)) = frame.read::<Scene>() else { return };
    let posed = |object: &SceneObject| {
        Pose::<World, geometry::Thing>::from_parts(object.position_m, object.orientation_xyzw)
            .map(|pose| *pose.isometry())
    };
    let drawn: Vec<Marker<'_>> = (0..)
        .zip(&objects)
        .filter_map(|(id, object)| {
            let [red, green, blue] = object.colour_rgb;
            Some(Marker {
                kind: "scene",
                id,
                form: Form::Cube,
                pose: posed(object)?,
                scale_m: object.half_extents_m.map(|half| 2.0 * half),
                colour_rgba: [red, green, blue, 1.0],
                text: object.name.as_str(),
            })
        })
        .collect();
    messages.push(message("/scene", MARKERS, markers(frame.at_ns, WORLD, &drawn)));
    let names: Vec<String> = objects.iter().map(|object| format!("scene/{}", object.name.as_str())).collect();
    let links: Vec<_> = names
        .iter()
        .zip(&objects)
        .filter_map(|(name, object)| Some((WORLD, name.as_str(), posed(object)?)))
        .collect();
    messages.push(message("/tf", TRANSFORMS, transforms(frame.at_ns, &links)));
}

fn log(at_ns: u64, who: &str, words: &str) -> ViewerMessage {
    let mut cdr = Cdr::new();
    cdr.time(at_ns);
    cdr.u8(INFO);
    cdr.string(who);
    cdr.string(words);
    cdr.string("");
    cdr.string("");
    cdr.u32(0);
    message("/log", LOG, cdr.finish())
}

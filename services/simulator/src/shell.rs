use config::Robot;
use config::lesson::Lesson;
use kinematics::{Body, Side};
use message::{
    Header, Hop, JointState, JointStates, Observation, Observations, Process, STATES, Scene, SceneObject,
    Text, Utterance, Utterances,
};
use process::{Failure, Launch, Member, Progress};
use transport::Inlet;

use crate::{Hand, World};

/// The number of the simulator among the sensory sources.
const SOURCE: u32 = 0;
/// Sentences that one frame holds.
const SENTENCES: usize = 8;
/// The joints whose mean says how closed a hand is.
const FINGERS: [&str; 4] = ["index", "middle", "ring", "little"];

/// Plays a lesson until the process is told to stop, or until its script is over where Leo has
/// nothing to perform in it.
///
/// # Errors
///
/// The body's description is refused, the domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<(), Failure> {
    let leo = &robot.leo;
    let capacity = leo.buffers.objects.get();
    let mut member = Member::join(launch, Process::Simulator, &leo.buffers, &leo.simulator.realtime)?;
    let mut joint_states = member.inlet::<JointStates>(None)?;
    let mut observations = member.outlet::<Observations>(Some(SOURCE), capacity)?;
    let mut scene = member.outlet::<Scene>(None, capacity)?;
    let mut utterances = member.outlet::<Utterances>(None, SENTENCES)?;
    let mut hands = Hands::new(robot)?;
    let mut world = World::new(lesson, lesson.seed);
    let ends_by_itself = lesson.performances() == 0 && launch.synthetic.is_none() && !launch.stay;
    member.begin(Some(leo.simulator.rate_hz.period()))?;
    while let Some(now) = member.next_cycle()? {
        hands.follow(&mut joint_states)?;
        world.step(now, hands.both());

        let header = Header::at(now.as_nanos());
        let nothing = Observation::object(0, 0);
        let mut observed = world.observations();
        observations.send(
            header,
            world.observations().count(),
            |_| observed.next().unwrap_or(nothing),
            |header| header.pass(Hop::Observed, member.now().as_nanos()),
        )?;
        let mut truths = world.scene();
        let nothing = unseen();
        scene.send(header, world.scene().count(), |_| truths.next().unwrap_or(nothing), |_| {})?;
        let said = world.utterances().count();
        if said > 0 {
            let mut sentences = world.utterances();
            let silence = Utterance { speaker: 0, text: Text::default() };
            utterances.send(header, said, |_| sentences.next().unwrap_or(silence), |_| {})?;
        }

        member.health().drops = joint_states.drops();
        member.health().undelivered =
            observations.undelivered() + scene.undelivered() + utterances.undelivered();
        let is_finished = world.is_finished();
        member.end_cycle(if is_finished { Progress::Finished } else { Progress::More })?;
        if is_finished && ends_by_itself && !member.is_lockstep() {
            break;
        }
    }
    Ok(())
}

/// Where Leo's hands are, by the joint states that came back over the buses.
struct Hands {
    body: Body,
    fingers: [[usize; FINGERS.len()]; 2],
    /// Positions read last, of every joint that was ever read.
    positions_rad: Vec<Option<f64>>,
    /// The same for the kinematics, which takes a joint that was never read to stand at zero.
    assumed_rad: Vec<f64>,
}

impl Hands {
    fn new(robot: &Robot) -> Result<Self, Failure> {
        let names: Vec<&str> = robot.motor.joints.iter().map(|joint| joint.name.as_str()).collect();
        let body = Body::from_urdf(&robot.urdf, &names).map_err(Failure::own)?;
        let finger = |side: &str, finger: &str| {
            let name = format!("{side}_{finger}_pitch_joint");
            body.joint(&name).ok_or_else(|| Failure::own(format!("leo.urdf has no joint `{name}`")))
        };
        let hand = |side: &str| -> Result<[usize; FINGERS.len()], Failure> {
            let [index, middle, ring, little] = FINGERS;
            Ok([finger(side, index)?, finger(side, middle)?, finger(side, ring)?, finger(side, little)?])
        };
        let fingers = [hand("left")?, hand("right")?];
        Ok(Self {
            body,
            fingers,
            positions_rad: vec![None; names.len()],
            assumed_rad: vec![0.0; names.len()],
        })
    }

    fn follow(&mut self, inlet: &mut Inlet<JointStates>) -> Result<(), Failure> {
        let Some(frame) = inlet.newest()? else { return Ok(()) };
        for state in frame.entries() {
            self.note(state);
        }
        Ok(())
    }

    fn note(&mut self, state: &JointState) {
        let joint = usize::try_from(state.joint).unwrap_or(usize::MAX);
        if let (Some(position), Some(slot)) =
            (state.present_position_rad(), self.positions_rad.get_mut(joint))
        {
            *slot = Some(position);
            if let Some(assumed) = self.assumed_rad.get_mut(joint) {
                *assumed = position;
            }
        }
    }

    /// The left and the right hand; none where a joint that matters was never read.
    fn both(&self) -> [Option<Hand>; 2] {
        [self.hand(Side::Left, 0), self.hand(Side::Right, 1)]
    }

    fn hand(&self, side: Side, index: usize) -> Option<Hand> {
        let known = |joint: usize| self.positions_rad.get(joint).copied().flatten();
        for joint in self.body.arm_joints(side) {
            known(joint)?;
        }
        let mut closure_rad = 0.0;
        for &finger in self.fingers.get(index)? {
            closure_rad += known(finger)? / quantity::number::float_of_count(FINGERS.len());
        }
        Some(Hand { pose: self.body.hand(side, &self.assumed_rad), closure_rad })
    }
}

fn unseen() -> SceneObject {
    SceneObject {
        position_m: [0.0; 3],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        half_extents_m: [0.0; 3],
        colour_rgb: [0.0; 3],
        states: [f32::NAN; STATES],
        kind: 0,
        held_by: message::NOBODY,
        name: Text::default(),
    }
}

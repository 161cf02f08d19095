use std::collections::VecDeque;

use config::Robot;
use config::lesson::Lesson;
use kinematics::Body;
use message::{
    ActAnswer, ActsAnswered, Header, Hop, JointStates, Observation, Observations, Process, Scene, SceneHead,
    SceneObject, TeacherActs, Text, Topic as _, Utterance, Utterances,
};
use process::{Launch, ProcessError, ProcessNode, Progress};

use crate::World;
use crate::hand_kinematics::HandKinematics;
use crate::io::lesson_controller::LessonController;

/// Maximum number of utterances in a frame; further ones go into the next frames.
const SENTENCES: usize = Utterances::ROW.capacity.entries(0, 0);
/// Maximum number of answers in a frame; further ones go into the next frames.
const ANSWERS: usize = ActsAnswered::ROW.capacity.entries(0, 0);

/// Plays a lesson, and executes interactive acts, until the process is stopped.
///
/// # Errors
///
/// The URDF is invalid, the domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot, lesson: &Lesson) -> Result<(), ProcessError> {
    let leo = &robot.leo;
    let capacity = leo.buffers.max_objects.get();
    let mut member = ProcessNode::join(launch, Process::Simulator, &leo.buffers, &leo.simulator.realtime)?;
    let mut joint_states = member.subscriber::<JointStates>(None)?;
    let source = leo.sensor.simulator().ok_or_else(|| {
        ProcessError::own(
            "no [[sensor.source]] of leo.toml is of the kind \"simulator\": the lesson would have no observer",
        )
    })?;
    let mut observations = member.publisher::<Observations>(Some(u32::from(source)), capacity)?;
    let mut scene = member.publisher::<Scene>(None, capacity)?;
    let mut utterances = member.publisher::<Utterances>(None, SENTENCES)?;
    let mut acts = member.subscriber::<TeacherActs>(None)?;
    let mut answered = member.publisher::<ActsAnswered>(None, ANSWERS)?;
    let (mut utterance_queue, mut answer_queue) =
        (VecDeque::with_capacity(SENTENCES), VecDeque::with_capacity(ANSWERS));
    let mut lesson_controller = LessonController::new(lesson, launch.state.clone(), capacity);
    let joints: Vec<&str> = robot.motor.joints.iter().map(|joint| joint.name.as_str()).collect();
    let body = Body::from_urdf(&robot.urdf, &joints).map_err(ProcessError::own)?;
    let mut hand_kinematics = HandKinematics::new(body).map_err(ProcessError::own)?;
    let mut world = World::new(lesson, lesson.seed);
    member.begin(Some(leo.simulator.rate_hz.period()))?;
    while let Some(now) = member.next_cycle()? {
        if let Some(frame) = joint_states.newest()? {
            hand_kinematics.note(frame.entries());
        }
        while let Some(frame) = acts.receive()? {
            lesson_controller.listen(&mut world, now, frame.head().incarnation);
            for act in frame.entries() {
                lesson_controller.take(&mut world, now, act);
            }
        }
        world.step(now, hand_kinematics.hands());

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
        let head = SceneHead { header, lesson: lesson_controller.name, ..world.head() };
        let nothing = SceneObject::default();
        scene.send(head, world.scene().count(), |_| truths.next().unwrap_or(nothing), |_| {})?;
        answer_queue.extend(lesson_controller.answers());
        let mut answers = answer_queue.drain(..answer_queue.len().min(ANSWERS));
        if answers.len() > 0 {
            let none = ActAnswer { serial: 0, refused: 0, text: Text::default() };
            answered.send(header, answers.len(), |_| answers.next().unwrap_or(none), |_| {})?;
        }
        utterance_queue.extend(world.utterances());
        let mut sentences = utterance_queue.drain(..utterance_queue.len().min(SENTENCES));
        if sentences.len() > 0 {
            let silence = Utterance { speaker: 0, text: Text::default() };
            utterances.send(header, sentences.len(), |_| sentences.next().unwrap_or(silence), |_| {})?;
        }
        drop(sentences);

        member.health().drops = joint_states.drops() + acts.drops();
        member.health().undelivered = observations.undelivered()
            + scene.undelivered()
            + utterances.undelivered()
            + answered.undelivered();
        let is_finished = world.is_finished() && utterance_queue.is_empty();
        member.end_cycle(if is_finished { Progress::Finished } else { Progress::More })?;
    }
    Ok(())
}

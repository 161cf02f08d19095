//! Plays a lesson in one process, as fast as possible: connects the cores of simulator, sensor, belief and learner
//! directly, without shared memory, servo bus or body.

use clock::{Duration, Instant};
use config::Robot;
use config::lesson::Lesson;
use learner_process::{Body, Input, Learner, Motion, Settings, Skill, Vocabulary};
use message::{Belief, Header, Hop, JointGoal, Observation, Perceived, Utterance};
use reports::lesson::LessonReport;
use simulator_process::World;

use crate::failure::CommandError;

/// The last utterance is processed and answered within this time.
const ANSWER_TIME: Duration = Duration::from_secs(1);

/// Plays the demonstrations of a lesson to a robot with `partners` partners; returns what it learned. `source` is the
/// number of the simulator among the robot's sources.
///
/// # Errors
///
/// The robot's configuration is invalid.
pub(super) fn rehearse(
    robot: &Robot,
    source: usize,
    lesson: &Lesson,
    partners: u32,
) -> Result<LessonReport, CommandError> {
    let settings = &robot.leo;
    let capacity = settings.buffers.max_objects.get();
    let mut world = World::new(lesson, lesson.seed);
    let mut sensor = sensor_process::Sensor::new(&robot.percepts, &settings.sensor.source, capacity)
        .map_err(CommandError::usage)?
        .identifying(&settings.sensor.persons);
    let mut believer =
        belief_process::Believer::new(&robot.percepts, &robot.perspective, partners, 1, capacity)
            .map_err(CommandError::usage)?;
    let vocabulary =
        Vocabulary::of(&robot.percepts).map_err(CommandError::usage)?.with_names(&settings.belief.names);
    let perspectives: Vec<u16> = (0..).take(partners as usize + 1).collect();
    let mut learner =
        Learner::new(Settings::of(&settings.learner), vocabulary, &perspectives, ImmobileBody, []);
    let mut report = LessonReport::default();
    let mut now = Instant::from_nanos(1_000_000_000);
    let mut sequence = 0;
    let mut ended = None;
    while ended.is_none_or(|ended| now < ended + ANSWER_TIME) {
        now += settings.sensor.rate_hz.period();
        sequence += 1;
        world.step(now, [None, None]);
        let observations: Vec<Observation> = world.observations().collect();
        let mut header = Header { sequence, ..Header::at(now.as_nanos()) };
        header.pass(Hop::Observed, now.as_nanos());
        sensor.begin(now);
        if sensor.record_header(source, &header) {
            sensor.take(source, &header, &observations);
        }
        let head = sensor.end();
        let perceived: Vec<Perceived> = sensor.perceived().collect();
        believer.step(now, &head, &perceived);
        let frames: Vec<_> = (0..believer.perspectives())
            .map(|perspective| {
                let believed =
                    (0..believer.len(perspective)).filter_map(|at| believer.entry(perspective, at));
                (believer.head(perspective), believed.collect::<Vec<Belief>>())
            })
            .collect();
        let beliefs: Vec<_> = frames.iter().map(|(head, beliefs)| (head, beliefs.as_slice())).collect();
        let utterances: Vec<(Instant, Utterance)> =
            world.utterances().map(|utterance| (now, utterance)).collect();
        let input = Input { beliefs: &beliefs, utterances: &utterances, present_rad: &[] };
        learner.step(now, &input).events.iter().for_each(|event| report.add(event));
        if ended.is_none() && world.is_finished() {
            ended = Some(now);
        }
    }
    Ok(report)
}

/// A body that does nothing, because the lesson's performances are not played.
#[derive(Clone, Copy, Debug)]
struct ImmobileBody;

impl Body for ImmobileBody {
    fn begin(&mut self, _now: Instant, _skill: Skill, _present_rad: &[Option<f64>]) {}

    fn step(&mut self, _now: Instant, _present_rad: &[Option<f64>], _goals: &mut Vec<JointGoal>) -> Motion {
        Motion::Done
    }
}

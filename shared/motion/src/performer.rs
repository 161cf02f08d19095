use std::mem;

use clock::{Duration, Instant};
use kinematics::Body;
use message::JointGoal;

use crate::model::Model;
use crate::parts::MissingJointError;
use crate::plan::{Leg, Plan, WaitFor};
use crate::plan_builder::PlanBuilder;
use crate::{FailureReason, Progress, Skill, SkillError};

/// A joint that has not arrived this long after the end of its leg has failed.
const ARRIVAL_TIMEOUT: Duration = Duration::from_secs(3);

/// Performs skills: plans each when it begins, streams joint goals, and monitors the arrival of the joints.
#[derive(Clone, Debug)]
pub struct Performer {
    model: Model,
    ahead: Duration,
    /// The plan being performed, and a buffer for planning the next one.
    plan: Plan,
    next_plan: Plan,
    start: Vec<f64>,
    at: Vec<f64>,
    goals: Vec<JointGoal>,
    /// Set while a skill runs.
    running: Option<Running>,
    /// The progress otherwise.
    ended: Progress,
}

/// The leg in progress.
#[derive(Clone, Copy, Debug)]
struct Running {
    leg: usize,
    since: Instant,
    /// Whether the last goals were those of the end of the leg.
    is_sent: bool,
}

impl Performer {
    /// Creates a performer for a body's joints. `rest_rad` is the rest position of each joint, zero if it is missing.
    /// Usually it is `joint_rad(0.0)` of each joint of `motor.toml`, the middle position of its servo. Goals are sent
    /// for the time `ahead` from now; two periods of the caller are enough.
    ///
    /// # Errors
    ///
    /// The body lacks a joint of a hand, an eye, the neck, the torso or the face.
    pub fn new(body: &Body, rest_rad: &[f64], ahead: Duration) -> Result<Self, MissingJointError> {
        let count = body.joints().len();
        Ok(Self {
            model: Model::new(body, rest_rad)?,
            ahead,
            plan: Plan::new(count),
            next_plan: Plan::new(count),
            start: vec![0.0; count],
            at: vec![0.0; count],
            goals: Vec::with_capacity(count),
            running: None,
            ended: Progress::Idle,
        })
    }

    /// Plans a skill from the present joint positions and begins it, replacing the current one. A joint whose
    /// position is unknown is assumed at its last goal, or at rest.
    ///
    /// # Errors
    ///
    /// The skill is not possible. The current skill continues.
    pub fn begin(
        &mut self,
        now: Instant,
        skill: &Skill,
        present_rad: &[Option<f64>],
    ) -> Result<(), SkillError> {
        for (joint, (start, rest)) in self.start.iter_mut().zip(&self.model.rest_rad).enumerate() {
            let present = present_rad.get(joint).copied().flatten().filter(|position| position.is_finite());
            let sent = self.goals.get(joint).map(|goal| goal.goal_position_rad);
            *start = self.model.limited(joint, present.or(sent).unwrap_or(*rest));
        }
        let (model, plan) = (&self.model, &mut self.next_plan);
        PlanBuilder { model, plan, start: &self.start, at: &mut self.at }.skill(skill)?;
        mem::swap(&mut self.plan, &mut self.next_plan);
        self.running = Some(Running { leg: 0, since: now, is_sent: false });
        self.ended = Progress::Done;
        Ok(())
    }

    /// Updates the joint positions (`None` if unknown) and returns the progress of the skill. Then
    /// [`goals`](Self::goals) returns the goals to send.
    pub fn step(&mut self, now: Instant, present_rad: &[Option<f64>]) -> Progress {
        // The goals are ahead of the present time, and so may the joints be.
        if let Some(Running { leg, since, is_sent: true }) = self.running
            && let Some(current) = self.plan.legs.get(leg)
        {
            match self.unready(current, present_rad) {
                Some(why) if now.since(since) > current.duration + ARRIVAL_TIMEOUT => {
                    (self.running, self.ended) = (None, Progress::Failed { phase: current.phase, why });
                }
                Some(_) => {}
                None if self.plan.legs.get(leg + 1).is_some() => {
                    self.running = Some(Running { leg: leg + 1, since: now, is_sent: false });
                }
                None => self.running = None,
            }
        }
        self.renew_goals(now);
        self.progress()
    }

    /// The goals to send, one per joint, in the order of the joints. Empty before the first skill has begun.
    #[must_use]
    pub fn goals(&self) -> &[JointGoal] {
        &self.goals
    }

    /// Progress of the skill, as returned by the last [`step`](Self::step).
    #[must_use]
    pub fn progress(&self) -> Progress {
        let leg = self.running.and_then(|running| self.plan.legs.get(running.leg));
        leg.map_or(self.ended, |leg| Progress::Running { phase: leg.phase })
    }

    /// The first joint of a leg that must arrive and has not, and why.
    fn unready(&self, leg: &Leg, present_rad: &[Option<f64>]) -> Option<FailureReason> {
        let parts = &self.model.parts;
        let (from, to) = self.plan.ends(leg);
        let gaze = parts.gaze();
        let awaited = |joint: usize| match leg.awaits {
            WaitFor::Moved => true,
            WaitFor::MovedButGaze => !gaze.contains(&joint),
            WaitFor::Nothing => false,
        };
        let ways = from.iter().zip(to).zip(&parts.tolerance_rad).enumerate();
        ways.filter(|(joint, ((from, to), _))| (*to - *from).abs() > 1e-9 && awaited(*joint)).find_map(
            |(joint, ((_, to), tolerance))| match present_rad.get(joint).copied().flatten() {
                None => Some(FailureReason::Silent { joint }),
                // Written so that NaN does not count as arrived.
                Some(present) if (present - to).abs() <= *tolerance => None,
                Some(present) => Some(FailureReason::Late { joint, away_rad: (present - to).abs() }),
            },
        )
    }

    /// Advances the goals of a running skill. Otherwise renews the arrival time of the last goals.
    fn renew_goals(&mut self, now: Instant) {
        let arrive_at_ns = (now + self.ahead).as_nanos();
        if let Some(Running { leg, since, is_sent }) = &mut self.running
            && let Some(leg) = self.plan.legs.get(*leg)
        {
            let elapsed = now.since(*since) + self.ahead;
            *is_sent = elapsed >= leg.duration;
            self.plan.sample(leg, elapsed, &mut self.at);
            self.goals.clear();
            self.goals.extend((0_u32..).zip(&self.at).map(|(joint, goal_position_rad)| JointGoal {
                joint,
                reserved: 0,
                goal_position_rad: *goal_position_rad,
                arrive_at_ns,
            }));
        } else {
            for goal in &mut self.goals {
                goal.arrive_at_ns = arrive_at_ns;
            }
        }
    }
}

use clock::{Duration, Instant};
use config::Robot;
use message::JointGoal;
use motion::{Performer, Progress, Skill};

use crate::{Body, Motion};

/// The robot's body: performs the learner's skills by motions of its joints.
#[derive(Clone, Debug)]
pub struct LeoBody {
    performer: Performer,
    /// The reason why the last skill could not start.
    refused: Option<String>,
}

/// The error for a configuration without a usable body.
#[derive(Debug, thiserror::Error)]
pub enum LeoBodyError {
    /// The description of the body is invalid.
    #[error("leo.urdf:{}:{}: {}", .0.line, .0.column, .0.kind)]
    Body(#[from] kinematics::BodyError),
    /// A joint is missing.
    #[error("leo.urdf: {0}")]
    Joint(#[from] motion::MissingJointError),
}

impl LeoBody {
    /// The body of a configuration. The rest position of a joint is the centre of its servo's range.
    ///
    /// # Errors
    /// [`LeoBodyError`] if the description of the body is invalid or lacks a joint.
    pub fn new(robot: &Robot) -> Result<Self, LeoBodyError> {
        let names: Vec<&str> = robot.motor.joints.iter().map(|joint| joint.name.as_str()).collect();
        let rest_rad: Vec<f64> = robot.motor.joints.iter().map(|joint| joint.joint_rad(0.0)).collect();
        let body = kinematics::Body::from_urdf(&robot.urdf, &names)?;
        let ahead: Duration = robot.leo.learner.goal_rate_hz.period() * 2;
        Ok(Self { performer: Performer::new(&body, &rest_rad, ahead)?, refused: None })
    }
}

impl Body for LeoBody {
    fn begin(&mut self, now: Instant, skill: Skill, present_rad: &[Option<f64>]) {
        let begun = self.performer.begin(now, &skill, present_rad);
        self.refused = begun.err().map(|refusal| refusal.to_string());
    }

    fn step(&mut self, now: Instant, present_rad: &[Option<f64>], goals: &mut Vec<JointGoal>) -> Motion {
        let progress = self.performer.step(now, present_rad);
        goals.extend_from_slice(self.performer.goals());
        if let Some(why) = &self.refused {
            return Motion::Failed { why: why.clone() };
        }
        match progress {
            Progress::Running { .. } => Motion::Running,
            Progress::Idle | Progress::Done => Motion::Done,
            Progress::Failed { phase, why } => Motion::Failed { why: format!("{why} ({phase:?})") },
        }
    }
}

#[cfg(test)]
mod tests {
    use geometry::Position;
    use motion::Face;

    use super::*;

    #[test]
    fn a_skill_gives_goals_for_every_joint_and_a_refusal_gives_words() {
        let robot = Robot::load(None).unwrap();
        let mut body = LeoBody::new(&robot).unwrap();
        let present_rad: Vec<Option<f64>> =
            robot.motor.joints.iter().map(|joint| Some(joint.joint_rad(0.0))).collect();
        let mut goals = Vec::new();
        body.begin(Instant::EPOCH, Skill::Show(Face::Attentive), &present_rad);
        assert_eq!(body.step(Instant::EPOCH, &present_rad, &mut goals), Motion::Running);
        assert_eq!(goals.len(), robot.motor.joints.len());
        let far_away = Skill::Insert {
            thing: Position::new(3.0, 0.0, 0.025),
            half_height_m: 0.025,
            hole: Position::new(0.4, 0.0, 0.06),
        };
        body.begin(Instant::EPOCH, far_away, &present_rad);
        let Motion::Failed { why } = body.step(Instant::EPOCH, &present_rad, &mut goals) else {
            panic!("nothing three metres away is in reach");
        };
        assert!(why.contains("phase"), "{why}");
        insta::assert_snapshot!(why);
    }
}

//! Checks that `leo.urdf` and `motor.toml` describe the same body, and that its servos can be driven.

use std::cmp::Ordering;
use std::path::Path;

use config::motor::Limit;
use config::{Robot, SettingsError};
use kinematics::{Body, BodyError, BodyErrorKind, Joint};
use learner_process::{LeoBody, LeoBodyError};
use motor_process::{Motor, MotorError};

/// Why a body is invalid.
#[derive(Debug, thiserror::Error)]
pub(super) enum BodyCheckError {
    /// `leo.urdf` is not a valid URDF.
    #[error(
        "{}; correct it, or remove it: without one the robot has the built-in body",
        located(urdf, source)
    )]
    InvalidUrdf { urdf: String, source: Box<BodyError> },
    /// `leo.urdf` is no usable body, or lacks joints of `motor.toml`.
    #[error("{}", located(urdf, source))]
    Urdf { urdf: String, source: Box<BodyError> },
    /// The body lacks a joint that performances need.
    #[error("{urdf}: {why}; add it there and to motor.toml")]
    MissingJoint { urdf: String, why: String },
    /// A limit differs between the two files.
    #[error(transparent)]
    Limit(SettingsError),
    /// The servos cannot be driven.
    #[error("{motor}: {source}")]
    Motor { motor: String, source: MotorError },
}

/// Checks the body of the robot whose `leo.toml` is `config`. The joints of `leo.urdf` must be those of `motor.toml`,
/// with equal limits: goals are planned within the former and commanded within the latter. The learner must be able to
/// perform with the body, and every bus must have room for its servos.
///
/// # Errors
///
/// The first check that fails.
pub(super) fn check(robot: &Robot, config: Option<&Path>) -> Result<(), BodyCheckError> {
    let urdf = || called(config, "leo.urdf");
    let names: Vec<&str> = robot.motor.joints.iter().map(|joint| joint.name.as_str()).collect();
    let body = Body::from_urdf(&robot.urdf, &names).map_err(|source| {
        let (urdf, source) = (urdf(), Box::new(source));
        if matches!(source.kind, BodyErrorKind::Urdf { .. }) {
            BodyCheckError::InvalidUrdf { urdf, source }
        } else {
            BodyCheckError::Urdf { urdf, source }
        }
    })?;
    for (servo, joint) in robot.motor.joints.iter().zip(body.joints()) {
        for limit in Limit::ALL {
            let (said, (word, limited)) = (limit.of(servo), in_urdf(limit, joint));
            if said.partial_cmp(&limited) != Some(Ordering::Equal) {
                let reason = format!(
                    "joint `{}`: `{}` is {said}, and its `{word}` is {limited} in {}: give both the same number",
                    servo.name,
                    limit.key(),
                    urdf()
                );
                return Err(BodyCheckError::Limit(Robot::limit_error(config, &servo.name, limit, reason)));
            }
        }
    }
    LeoBody::new(robot).map_err(|error| match error {
        LeoBodyError::Body(source) => BodyCheckError::Urdf { urdf: urdf(), source: Box::new(source) },
        LeoBodyError::Joint(missing) => {
            BodyCheckError::MissingJoint { urdf: urdf(), why: missing.to_string() }
        }
    })?;
    Motor::new(&robot.motor, &robot.leo.motor)
        .map_err(|source| BodyCheckError::Motor { motor: called(config, "motor.toml"), source })?;
    Ok(())
}

/// A limit's name in the URDF, and its value for a joint.
const fn in_urdf(limit: Limit, joint: &Joint) -> (&'static str, f64) {
    match limit {
        Limit::Min => ("lower", joint.lower_rad),
        Limit::Max => ("upper", joint.upper_rad),
        Limit::Velocity => ("velocity", joint.velocity_rad_s),
    }
}

/// An error of the body behind its file, line and column.
fn located(urdf: &str, source: &BodyError) -> String {
    format!("{urdf}:{}:{}: {}", source.line, source.column, source.kind)
}

/// The name in error messages of a file beside `config`; a missing one is the built-in file.
fn called(config: Option<&Path>, name: &str) -> String {
    let file = Robot::sibling_file(config, name);
    file.map_or_else(|| format!("the built-in {name}"), |file| file.display().to_string())
}

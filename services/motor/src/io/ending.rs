//! The end of the motor process: no ending leaves torque on, or it is said of which servo.

use config::Robot;
use process::{Failure, Launch};
use realtime::ParentError;

/// How long a line may stay that of an earlier motor process, which ends.
const BUSY_TIMEOUT: clock::Duration = clock::Duration::from_secs(4);

/// The process could not join its robot. Where its supervisor was dead already, nobody else switches off the torque that
/// an earlier life switched on: it is done here.
pub(crate) fn could_not_join(failure: Failure, launch: &Launch, robot: &Robot) -> Failure {
    if !matches!(failure, Failure::Parent(ParentError::Gone { .. })) {
        return failure;
    }
    tracing::error!("the supervisor died while the motor process started: every torque is switched off");
    let report = torque::switch_off(&torque::buses(&robot.motor, Some(&launch.domain)), BUSY_TIMEOUT);
    report.log(launch.config.as_deref());
    if report.is_confirmed() {
        process::tell_torque_is_off();
    }
    failure
}

/// The joints were laid down: whether every servo has said that its torque is off, for whom that has to know.
///
/// # Errors
///
/// Servos have not said so. The supervisor, or the guard where it is dead, asks them again, one by one.
pub(crate) fn laid_down(unconfirmed: usize, launch: &Launch) -> Result<(), Failure> {
    match unconfirmed {
        0 => {
            if launch.parent.is_some() {
                process::tell_torque_is_off();
            }
            Ok(())
        }
        silent => Err(Failure::own(format!("{silent} servos have not said that their torque is off"))),
    }
}

/// Leaves what a process has of its domain as it is where its supervisor is dead: a robot that was started since may have
/// files of the same names there, which would be removed with these.
pub(crate) fn leave<T>(of_the_domain: T, launch: &Launch) {
    if launch.parent.is_some_and(|parent| !realtime::is_parent(parent)) {
        std::mem::forget(of_the_domain);
    }
}

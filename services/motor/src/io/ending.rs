//! End of the motor process: either every servo has confirmed torque off, or the silent servos are reported.

use config::Robot;
use process::{Launch, ProcessError};
use realtime::ParentError;

/// How long a line may stay in use by an earlier motor process that is ending.
const BUSY_TIMEOUT: clock::Duration = clock::Duration::from_secs(4);

/// Handles a failure to join the robot. If the supervisor is already dead, no other process switches off torque left
/// on by an earlier process, so it is switched off here.
pub(crate) fn could_not_join(failure: ProcessError, launch: &Launch, robot: &Robot) -> ProcessError {
    if !matches!(failure, ProcessError::Parent(ParentError::Gone { .. })) {
        return failure;
    }
    tracing::error!(
        "the supervisor died while the motor process started: the torque of every servo is switched off"
    );
    let report = torque::switch_off(&torque::buses(&robot.motor, Some(&launch.domain)), BUSY_TIMEOUT);
    report.log(launch.config.as_deref());
    if report.is_confirmed() {
        process::report_torque_off();
    }
    failure
}

/// Reports after the orderly end whether every servo has confirmed torque off, to the processes that need to know.
///
/// # Errors
///
/// Servos have not confirmed. The supervisor, or the guard if the supervisor is dead, asks them again, one by one.
pub(crate) fn laid_down(unconfirmed: usize, launch: &Launch) -> Result<(), ProcessError> {
    match unconfirmed {
        0 => {
            if launch.parent.is_some() {
                process::report_torque_off();
            }
            Ok(())
        }
        silent => Err(ProcessError::own(format!("{silent} servos have not said that their torque is off"))),
    }
}

/// Leaks the domain's resources if the supervisor is dead. A robot started since may have files of the same names in
/// the domain, which dropping these would remove.
pub(crate) fn leave<T>(of_the_domain: T, launch: &Launch) {
    if launch.parent.is_some_and(|parent| !realtime::is_parent(parent)) {
        std::mem::forget(of_the_domain);
    }
}

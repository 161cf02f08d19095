use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use process::{StopAnswer, StopSocket, emergency};
use transport::Domain;

use crate::io::children::PROGRAM;

/// Lets every user of this machine raise the robot's emergency stop, as long as the returned socket lives. If the
/// socket cannot be created, the robot runs all the same and logs a warning.
pub(crate) fn stop_by_any_user(domain: &Domain) -> Option<StopSocket> {
    let root = domain.root().to_owned();
    let (raised, looked) = (root.clone(), root);
    let socket =
        StopSocket::listen(domain.root(), move |user| raise(&raised, user), move |user| look(&looked, user));
    if let Err(error) = &socket {
        tracing::warn!(
            "{error}: `leo emergency-stop` of other users does not reach this robot; the stop on the page does"
        );
    }
    socket.ok()
}

fn reason(user: u32) -> String {
    format!("leo emergency-stop of the user with the number {user}")
}

fn raise(domain: &Path, user: u32) {
    let reached = emergency::stop(domain, &reason(user));
    for (motor, signalled) in &reached.motors {
        if let Err(error) = signalled {
            tracing::error!("no emergency stop by signal to the motor process {}: {error}", motor.pid);
        }
    }
    if let Err(error) = &reached.file {
        tracing::error!("the emergency stop's file cannot be written: {error}");
    }
}

/// Runs `leo emergency-stop` as the robot's own user, and returns its output.
fn look(domain: &PathBuf, user: u32) -> StopAnswer {
    let looked = Command::new(PROGRAM)
        .args(["emergency-stop", "--reason", &reason(user), "--domain"])
        .arg(domain)
        .stdin(Stdio::null())
        .output();
    match looked {
        Ok(looked) => {
            let status = looked.status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
            let text = [looked.stdout, looked.stderr].concat();
            StopAnswer { status, text: String::from_utf8_lossy(&text).into_owned() }
        }
        Err(error) => {
            StopAnswer { status: 1, text: format!("raised, but NOT CONFIRMED: the check failed: {error}\n") }
        }
    }
}

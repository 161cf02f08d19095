//! The emergency stop: any client may raise it; it cannot be released here.

use std::path::PathBuf;
use std::sync::Arc;

use axum::Extension;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use process::emergency;
use tokio::sync::Mutex;

use super::connections::Connection;
use super::{Shared, notice};

/// The advice when nothing could be stopped.
const ELSE: &str =
    "use `leo emergency-stop` on the robot's machine, its emergency stop button, or cut the power";

/// The robot to be stopped.
#[derive(Debug)]
pub(crate) struct Stop {
    /// The robot's domain.
    domain: PathBuf,
    /// Whether the motor process runs on this machine.
    is_here: bool,
    /// Serialises stop requests, so that a flood costs no more than one.
    turn: Mutex<()>,
}

impl Stop {
    pub(crate) fn new(domain: PathBuf, is_here: bool) -> Self {
        Self { domain, is_here, turn: Mutex::new(()) }
    }

    /// Raises the stop, first by a signal, which needs no file. Returns the message for the operator, or the error.
    fn raise(&self, why: &str) -> Result<String, String> {
        if !self.is_here {
            return Err(format!("NOT STOPPED: the motor process runs on another machine: {ELSE}"));
        }
        if let Some(reason) = emergency::reason(&self.domain) {
            return Ok(format!("The emergency stop was raised before ({reason})."));
        }
        let reached = emergency::stop(&self.domain, why);
        let is_stopped = reached.is_stopped();
        match reached.file {
            Ok(()) => Ok("The emergency stop is raised: all joints are stopped.".to_owned()),
            Err(_) if is_stopped => {
                Ok("The emergency stop is raised by the signal to the motor process.".to_owned())
            }
            Err(error) => Err(format!("NOT STOPPED: {error}: {ELSE}")),
        }
    }
}

/// `POST /stop`.
pub(super) async fn stop(
    State(shared): State<Arc<Shared>>,
    Extension(connection): Extension<Arc<Connection>>,
    headers: HeaderMap,
) -> Response {
    let why = format!("the page's stop button, pressed at {}", connection.address);
    // Run in a task of its own: it completes even if the connection ends meanwhile.
    let raised = tokio::spawn(async move {
        let _turn = shared.stop.turn.lock().await;
        let on = Arc::clone(&shared);
        tokio::task::spawn_blocking(move || on.stop.raise(&why)).await
    });
    match raised.await {
        Ok(Ok(Ok(done))) => {
            let words = format!("{done} It is released with `leo emergency-stop --release`.");
            notice::answer(&headers, StatusCode::OK, "Stopped", &words)
        }
        Ok(Ok(Err(why))) => notice::answer(&headers, StatusCode::SERVICE_UNAVAILABLE, "Not stopped", &why),
        Ok(Err(error)) | Err(error) => {
            let why = format!("NOT STOPPED: {error}: {ELSE}");
            notice::answer(&headers, StatusCode::INTERNAL_SERVER_ERROR, "Not stopped", &why)
        }
    }
}

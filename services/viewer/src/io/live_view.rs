//! The threads of `leo view`: one reads the robot, one converts its frames, one serves the viewers.

use std::io;
use std::sync::Arc;

use recording::{RecordError, Recorder, Subject, ViewerMessages};
use transport::Domain;

use super::listener::Listener;
use super::server::Server;
use super::shared::Shared;
use crate::{Hub, Origins, Totals};

/// Why the channels of a robot cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The robot cannot be read.
    #[error(transparent)]
    Robot(#[from] RecordError),
    /// The server could not be started, or ended.
    #[error("the viewers cannot be served: {0}")]
    Server(#[from] io::Error),
}

/// Serves the channels of a running robot until stopped. Dropping it stops it.
///
/// It reads the robot as a [`Recorder`] does: the robot waits neither for it nor for the viewers.
#[derive(Debug)]
pub struct LiveView {
    recorder: Recorder,
    server: Server,
    shared: Arc<Shared>,
}

impl LiveView {
    /// Starts to serve the channels of the robot of a domain. `origins` are those of the web pages that may connect.
    ///
    /// # Errors
    ///
    /// The robot cannot be joined, its body is invalid, or a thread cannot be started.
    pub fn start(
        domain: &Domain,
        subject: &Subject,
        listener: Listener,
        origins: Origins,
    ) -> Result<Self, ViewError> {
        let mut messages =
            ViewerMessages::new(&subject.robot, &subject.x_world_base).map_err(RecordError::Body)?;
        // No other server of this machine began at the same nanosecond.
        let hub = Hub::new(clock::now().as_nanos().to_string());
        let shared = Arc::new(Shared::new(hub, origins));
        let hub = Arc::clone(&shared);
        let recorder = Recorder::feed(domain, move |frame| {
            let messages = messages.of(frame);
            hub.hub().publish(frame.topic, frame.at_ns, messages);
            hub.wake();
        })?;
        let server = Server::start(listener, Arc::clone(&shared))?;
        Ok(Self { recorder, server, shared })
    }

    /// Whether it ended by itself, because the robot ended or the server failed. [`Self::stop`] returns the cause.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.recorder.has_ended() || self.server.has_ended()
    }

    /// Ends it. Returns the counters of the viewers, and the number of the robot's frames that were dropped because this
    /// machine was too slow.
    ///
    /// # Errors
    ///
    /// The robot could not be read any more, or the server ended before.
    pub fn stop(self) -> Result<(Totals, u64), ViewError> {
        let server = self.server.stop();
        let counts = self.recorder.stop()?;
        server?;
        Ok((self.shared.hub().totals(), counts.total().dropped))
    }
}

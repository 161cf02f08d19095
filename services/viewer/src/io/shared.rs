//! What the thread that reads the robot and the sessions of the viewers share.

use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use crate::Hub;

/// The hub, and a signal that it changed.
#[derive(Debug)]
pub(super) struct Shared {
    hub: Mutex<Hub>,
    news: watch::Sender<()>,
}

impl Shared {
    pub(super) fn new(hub: Hub) -> Self {
        Self { hub: Mutex::new(hub), news: watch::Sender::new(()) }
    }

    /// The hub. Every change of it is complete before it can panic.
    pub(super) fn hub(&self) -> MutexGuard<'_, Hub> {
        self.hub.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes the sessions: messages may wait for their clients.
    pub(super) fn wake(&self) {
        self.news.send_replace(());
    }

    /// Receives the signals from now on.
    pub(super) fn news(&self) -> watch::Receiver<()> {
        self.news.subscribe()
    }
}

/// Waits until the server is to end.
pub(super) async fn stopped(stop: &mut watch::Receiver<bool>) {
    // A server that is gone ends its sessions too.
    let _gone = stop.wait_for(|stop| *stop).await.map(drop);
}

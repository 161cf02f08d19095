//! What the thread that reads the robot and the sessions of the viewers share.

use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use crate::{Hub, Origins};

/// Maximum number of refused origins that are reported; a page may try again and again.
const MAX_REPORTED_ORIGINS: usize = 8;
/// Maximum length of an origin that is reported, in bytes.
const MAX_ORIGIN_BYTES: usize = 200;

/// The hub, a signal that it changed, and the web pages that may connect.
#[derive(Debug)]
pub(super) struct Shared {
    hub: Mutex<Hub>,
    news: watch::Sender<()>,
    origins: Origins,
    /// The refused origins that were reported.
    reported: Mutex<BTreeSet<String>>,
}

impl Shared {
    pub(super) fn new(hub: Hub, origins: Origins) -> Self {
        Self { hub: Mutex::new(hub), news: watch::Sender::new(()), origins, reported: Mutex::default() }
    }

    /// Whether a client of this origin may connect. Reports each refused one once.
    pub(super) fn admits(&self, origin: Option<&str>) -> bool {
        let is_admitted = self.origins.admit(origin);
        if let Some(origin) = origin.filter(|origin| !is_admitted && origin.len() <= MAX_ORIGIN_BYTES) {
            let mut reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
            if reported.len() < MAX_REPORTED_ORIGINS && reported.insert(origin.to_owned()) {
                tracing::warn!(
                    "a web page of {origin:?} was refused: if it is your viewer, admit it with --origin"
                );
            }
        }
        is_admitted
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

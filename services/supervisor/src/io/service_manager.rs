//! What the service manager (systemd) is told, where one started the supervisor and listens.

use sd_notify::NotifyState;

use crate::policy::Standing;

/// Whoever listens at `NOTIFY_SOCKET`, as sd_notify(3) says; nobody, where it is not set.
#[derive(Debug, Default)]
pub(crate) struct ServiceManager {
    said: Option<Standing>,
    failed: bool,
}

impl ServiceManager {
    /// All processes run, for the first time: what was ordered to come after the robot may start.
    pub(crate) fn ready(&mut self) {
        self.tell(&[NotifyState::Ready]);
    }

    /// Says how the robot stands where that changed, and feeds the watchdog where it is well: a process
    /// that hangs and cannot be replaced starves it.
    pub(crate) fn stands(&mut self, standing: Standing) {
        let before = self.said.replace(standing);
        if standing.is_ending && !before.is_some_and(|before| before.is_ending) {
            self.tell(&[NotifyState::Stopping]);
        }
        if before != Some(standing) {
            self.tell(&[NotifyState::Status(&standing.to_string())]);
        }
        if standing.were_ready && standing.is_well() {
            self.tell(&[NotifyState::Watchdog]);
        }
    }

    fn tell(&mut self, words: &[NotifyState<'_>]) {
        if let Err(error) = sd_notify::notify(words)
            && !std::mem::replace(&mut self.failed, true)
        {
            tracing::warn!(%error, "the service manager does not listen");
        }
    }
}

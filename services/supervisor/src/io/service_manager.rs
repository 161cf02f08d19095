//! Notifications to the service manager (systemd), if it has started the supervisor.

use sd_notify::NotifyState;

use crate::policy::RobotState;

/// Client of the socket at `NOTIFY_SOCKET`, see sd_notify(3). Does nothing if the variable is not set.
#[derive(Debug, Default)]
pub(crate) struct ServiceManager {
    said: Option<RobotState>,
    failed: bool,
}

impl ServiceManager {
    /// Reports that all processes run for the first time, so that units ordered after the robot may start.
    pub(crate) fn ready(&mut self) {
        self.tell(&[NotifyState::Ready]);
    }

    /// Reports the robot's state if it changed, and triggers the watchdog if all processes run. If a process hangs
    /// and cannot be replaced, the watchdog expires.
    pub(crate) fn report_state(&mut self, robot_state: RobotState) {
        let before = self.said.replace(robot_state);
        if robot_state.is_ending && !before.is_some_and(|before| before.is_ending) {
            self.tell(&[NotifyState::Stopping]);
        }
        if before != Some(robot_state) {
            self.tell(&[NotifyState::Status(&robot_state.to_string())]);
        }
        if robot_state.were_ready && robot_state.is_well() {
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

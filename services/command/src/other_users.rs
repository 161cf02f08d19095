//! Robots of other users of this machine: any user may stop them, and nothing else.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clock::Instant;
use process::{StopAnswer, StoppedRobot};

/// Time-out for connecting to them, all together.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);

/// A robot of another user, and the result of raising its emergency stop.
pub(crate) struct OtherUsersRobot {
    domain: PathBuf,
    stopped: io::Result<StoppedRobot>,
}

impl OtherUsersRobot {
    /// Raises the emergency stop of all of them, or of the one in a folder. Does not wait for answers.
    pub(crate) fn stop_all(domain: Option<&Path>) -> Vec<Self> {
        let is_meant = |robot: &PathBuf| domain.is_none_or(|domain| domain == robot) && !is_own(robot);
        let all = StoppedRobot::all().into_iter().filter(is_meant);
        // One deadline for all: a robot that accepts no connection must not delay the others.
        let until = clock::now() + CONNECT_TIMEOUT;
        all.map(|domain| Self { stopped: StoppedRobot::stop(&domain, until), domain }).collect()
    }

    pub(crate) const fn is_stopped(&self) -> bool {
        self.stopped.is_ok()
    }

    /// Waits for the result until `until`; returns the exit status and the message. The advice `release` is removed
    /// from it, because this user cannot release the stop.
    pub(crate) fn answer(self, release: &str, until: Instant) -> (u8, String) {
        let owner = self.stopped.as_ref().map(|robot| robot.owner).ok();
        let of =
            owner.map(|owner| format!("; it is released by the user with the number {owner}, whose it is"));
        match self.stopped.and_then(|robot| robot.answer(until)) {
            Ok(StopAnswer { status, text }) => {
                let said = text.trim_end();
                let said = said.strip_suffix(release).unwrap_or(said).trim_end();
                let root = self.domain.display();
                let said = said.strip_prefix(&format!("{root}: ")).unwrap_or(said);
                // The text comes from another user: indent its lines, so that none looks like one about another robot.
                let said = said.replace('\n', "\n  ");
                (status, format!("{root}: {said}{}", of.unwrap_or_default()))
            }
            Err(error) => {
                let reached = if of.is_some() { "raised, but NOT CONFIRMED" } else { "NOT STOPPED" };
                (1, format!("{}: {reached}: {error}{}", self.domain.display(), of.unwrap_or_default()))
            }
        }
    }
}

fn is_own(domain: &Path) -> bool {
    let owner = |folder: io::Result<fs::Metadata>| folder.map(|folder| folder.uid()).ok();
    owner(fs::symlink_metadata(domain)) == owner(fs::metadata("/proc/self"))
}

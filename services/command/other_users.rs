//! The robots of this machine's other users: whoever sees one may stop it, and do nothing else to it.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clock::Instant;
use process::{StopAnswer, StoppedRobot};

/// How long is tried to reach them, all together.
const CONNECT_WITHIN: Duration = Duration::from_millis(500);

/// The robot of another user, and whether its emergency stop is raised.
pub(crate) struct OthersRobot {
    domain: PathBuf,
    stopped: io::Result<StoppedRobot>,
}

impl OthersRobot {
    /// Raises the emergency stop of all of them, or of that in one folder. No answer is waited for.
    pub(crate) fn stop_all(domain: Option<&Path>) -> Vec<Self> {
        let is_meant = |robot: &PathBuf| domain.is_none_or(|domain| domain == robot) && !is_own(robot);
        let all = StoppedRobot::all().into_iter().filter(is_meant);
        // All together: whoever holds many names and takes no connection keeps nobody from those that do.
        let until = clock::now() + CONNECT_WITHIN;
        all.map(|domain| Self { stopped: StoppedRobot::stop(&domain, until), domain }).collect()
    }

    pub(crate) const fn is_stopped(&self) -> bool {
        self.stopped.is_ok()
    }

    /// Waits for what came of it, until an instant at most: the exit status, and what to say. `release` is no use to
    /// this user.
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
                // Another user's words: under this robot's name, and no line of them looks like one about another robot.
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

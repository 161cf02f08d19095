//! Publishers that the roster does not list: which of them the journal has to name.

use message::Health;

/// Maximum number of publishers that the journal names for one process. Frames of further ones are only counted.
const MAX_NAMED: usize = 8;

/// The publishers whose frames a process has refused, as far as the journal names them.
#[derive(Debug, Default)]
pub(crate) struct UnlistedPublishers {
    named: Vec<u64>,
}

impl UnlistedPublishers {
    /// The process id of a publisher that the journal has to name now, by the health of the refusing process.
    pub(crate) fn next_to_name(&mut self, health: &Health) -> Option<u64> {
        let pid = health.unlisted_pid;
        if health.unlisted_frames == 0 || self.named.len() >= MAX_NAMED || self.named.contains(&pid) {
            return None;
        }
        self.named.push(pid);
        Some(pid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_unlisted_publisher_is_named_once_and_their_number_is_bounded() {
        let mut publishers = UnlistedPublishers::default();
        let mut health = Health::default();
        assert_eq!(publishers.next_to_name(&health), None);
        let mut named = |frames, pid| {
            (health.unlisted_frames, health.unlisted_pid) = (frames, pid);
            publishers.next_to_name(&health)
        };
        let cases = [(1, 7), (2, 7), (3, 8), (4, 7)].map(|(frames, pid)| named(frames, pid));
        assert_eq!(cases, [Some(7), None, Some(8), None]);
        assert_eq!((9..99).filter_map(|pid| named(pid, pid)).count(), MAX_NAMED - 2);
    }
}

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::IncompatibleProgramError;

/// Error while joining a domain.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// The robot uses other message layouts.
    #[error(transparent)]
    IncompatibleProgramError(#[from] IncompatibleProgramError),
    /// The domain's middleware configuration is missing or damaged.
    #[error("cannot read {}: {reason}; restart the robot with `leo run`", file.display())]
    Configuration {
        /// The file.
        file: PathBuf,
        /// The middleware's error.
        reason: String,
    },
    /// This process already joined another domain; a process can join only one.
    #[error("this process already joined another domain than {}", root.display())]
    AnotherDomain {
        /// The requested domain.
        root: PathBuf,
    },
    /// The middleware could not create a node.
    #[error("cannot join the domain {}: {reason}; is /dev/shm full?", root.display())]
    Node {
        /// The domain.
        root: PathBuf,
        /// The middleware's error.
        reason: String,
    },
}

/// Error while opening a port.
#[derive(Debug, thiserror::Error)]
#[error("cannot open `{topic}` for {purpose}: {reason}")]
pub struct PortError {
    pub(crate) topic: String,
    pub(crate) purpose: &'static str,
    pub(crate) reason: String,
}

impl PortError {
    pub(crate) fn new(topic: &str, purpose: &'static str, reason: impl std::fmt::Debug) -> Self {
        Self { topic: topic.to_owned(), purpose, reason: format!("{reason:?}") }
    }

    /// Other processes publish on the topic already, or were killed and not cleaned up yet.
    pub(crate) fn taken(topic: &str, pids: &[u32]) -> Self {
        let pids: BTreeSet<_> = pids.iter().collect();
        let pids: Vec<_> = pids.into_iter().map(u32::to_string).collect();
        let reason = format!("process {} publishes on it already: end it first", pids.join(", "));
        Self { topic: topic.to_owned(), purpose: "writing", reason }
    }

    /// A process of this domain opened the topic with other message types.
    pub(crate) fn other_messages(topic: &str, purpose: &'static str) -> Self {
        let reason =
            "another process created it with other message layouts: is that process of this version of Leo?";
        Self { topic: topic.to_owned(), purpose, reason: reason.to_owned() }
    }
}

/// Error while sending a frame.
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// No memory is free for another frame, or the middleware failed.
    #[error("cannot send on `{topic}`: {reason}")]
    Failed {
        /// The topic.
        topic: String,
        /// The middleware's error.
        reason: String,
    },
    /// In lockstep: a subscriber's queue is full.
    #[error("a subscriber of `{topic}` does not read its frames: its queue is full")]
    QueueFull {
        /// The topic.
        topic: String,
    },
}

/// Error while receiving a frame.
#[derive(Debug, thiserror::Error)]
#[error("cannot receive from `{topic}`: {reason}")]
pub struct ReceiveError {
    pub(crate) topic: String,
    pub(crate) reason: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_messages_match_the_snapshot() {
        let root = || PathBuf::from("/dev/shm/leo-a");
        let (topic, reason) = (|| "beliefs/1".to_owned(), || "[reason of the middleware]".to_owned());
        let errors = [
            JoinError::Configuration { file: root().join("iceoryx2.toml"), reason: reason() }.to_string(),
            JoinError::AnotherDomain { root: root() }.to_string(),
            JoinError::Node { root: root(), reason: reason() }.to_string(),
            PortError::taken("beliefs/1", &[78, 77, 77]).to_string(),
            PortError::other_messages("beliefs/1", "reading").to_string(),
            SendError::Failed { topic: topic(), reason: reason() }.to_string(),
            SendError::QueueFull { topic: topic() }.to_string(),
            ReceiveError { topic: topic(), reason: reason() }.to_string(),
        ];
        insta::assert_snapshot!(errors.join("\n"));
    }
}

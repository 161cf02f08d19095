use std::path::PathBuf;

use crate::OtherProgram;

/// Why a process could not join its domain.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// Its robot has other messages.
    #[error(transparent)]
    OtherProgram(#[from] OtherProgram),
    /// The middleware's configuration of the domain is missing or damaged.
    #[error("cannot read {}: {reason}; start the robot anew with `leo run`", file.display())]
    Configuration {
        /// The file.
        file: PathBuf,
        /// What the middleware said.
        reason: String,
    },
    /// This process already joined another domain; it can be in one only.
    #[error("this process already joined another domain than {}", root.display())]
    AnotherDomain {
        /// The domain asked for.
        root: PathBuf,
    },
    /// The middleware could not make a node.
    #[error("cannot join the domain {}: {reason}; is /dev/shm full?", root.display())]
    Node {
        /// The domain.
        root: PathBuf,
        /// What the middleware said.
        reason: String,
    },
}

/// Why a port could not be opened.
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

    /// Other processes publish already, or were killed and are not cleaned up yet.
    pub(crate) fn taken(topic: &str, pids: &[u32]) -> Self {
        let pids: Vec<_> = pids.iter().map(u32::to_string).collect();
        let reason = format!("process {} publishes on it already: end it first", pids.join(", "));
        Self { topic: topic.to_owned(), purpose: "writing", reason }
    }

    /// Somebody of this domain opened it before, and means something else by it.
    pub(crate) fn other_messages(topic: &str, purpose: &'static str) -> Self {
        let reason = "another process made it for other messages: has it the layouts of this version of Leo?";
        Self { topic: topic.to_owned(), purpose, reason: reason.to_owned() }
    }
}

/// Why a frame was not sent.
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// No memory was free for another frame, or the middleware failed.
    #[error("cannot send on `{topic}`: {reason}")]
    Failed {
        /// The topic.
        topic: String,
        /// What the middleware said.
        reason: String,
    },
    /// In lockstep, a reader's queue is full.
    #[error("a reader of `{topic}` did not take its frames: its queue is full")]
    QueueFull {
        /// The topic.
        topic: String,
    },
}

/// Why no frame could be received.
#[derive(Debug, thiserror::Error)]
#[error("cannot receive from `{topic}`: {reason}")]
pub struct ReceiveError {
    pub(crate) topic: String,
    pub(crate) reason: String,
}

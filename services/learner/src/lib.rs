//! Learner process: infers the teacher's goals and performs learned tasks.
//!
//! [`Learner`] is the core: beliefs and sentences are its input; events, joint goals and examples to store are its
//! output. It uses no clock, no files and no shared memory.

mod answers;
mod body;
mod evaluation;
mod io;
mod late_joiner_replay;
mod learner;
mod leo_body;
mod performance;
mod question;
mod report;
mod reports;
mod statement;
mod teaching;
mod views;
mod vocabulary;

pub use body::{Body, Motion};
pub use evaluation::replay_events;
pub use io::memory::Memory;
pub use io::run::{check_memory, memory_state, run};
pub use io::{MEMORY_VERSION, MemoryState, OpenError};
pub use learner::{Input, Kept, Learner, Output, Settings, StoreChange, learning};
pub use leo_body::{LeoBody, LeoBodyError};
pub use motion::Skill;
pub use question::open_question;
pub use vocabulary::{Vocabulary, VocabularyError};

#[cfg(test)]
mod tests;

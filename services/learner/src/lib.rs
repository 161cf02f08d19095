//! Learner process: what the teacher meant, and doing it.

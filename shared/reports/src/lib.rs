//! Reports of what happens in the robot, as text for people and in formats of programs.
//!
//! | module | reports | formats |
//! |---|---|---|
//! | [`events`] | an event of the learner | text |
//! | [`lesson`] | what Leo learned and did in a lesson, from the learner's events | text, JSON |
//! | [`beliefs`] | what each perspective believes over time, and where perspectives diverge | text, JSON lines |
//! | [`metrics`] | the health of processes, buses, joints and link | OpenMetrics |
//! | [`text_table`] | any rows | text |
//!
//! Every report is a function of its inputs and writes into memory. The caller reads the topics and writes the result.
//! Only `metrics` uses another module: it counts the tasks of a lesson's report.

pub mod beliefs;
pub mod events;
pub mod lesson;
pub mod metrics;
pub mod text_table;

//! What is concluded: rules with their ranks, the next question, and the perspective whose rules are followed.
//!
//! Files, the lowest first: rules and arrangements, ranking, the next inquiry, what was learned, explanations of a
//! difference between two perspectives, and the decision between them.

mod arrangement;
mod conflict;
mod explanation;
mod inquiry;
mod learned;
mod learning;
mod rank;
mod rule;
mod rule_name;

pub use arrangement::{Arrangement, ArrangementPart, ArrangementRule, part_positions};
pub use conflict::{Decision, OpenQuestion, decide, decide_with, differ};
pub use explanation::{Explanation, explain};
pub use inquiry::{Inquiry, ask_about};
pub use learned::{Learned, Means};
pub use learning::{Learning, learn_with};
pub use rule::{Rule, Standing};

use crate::bytes::message;
use crate::{Text, ZeroCopySend};

message! {
    /// A sentence of a teacher.
    #[derive(Debug, PartialEq, Eq)]
    pub struct Utterance as "leo/Utterance/1" {
        /// The speaker: partner 1, 2, …
        pub speaker: u32,
        /// The sentence.
        pub text: Text,
    }
}

/// What a person said, as far as Leo understands it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sentence {
    /// "Leo, I can teach you to do X": a demonstration of X begins.
    Teach(String),
    /// "X is done": the demonstration of X ends.
    Done(String),
    /// "Leo, do X": Leo shall perform X.
    Do(String),
    /// "Stop": Leo shall hold still.
    Stop,
    /// "Yes": it was right.
    Yes,
    /// "No": it was wrong.
    No,
    /// "No, not that one": the thing being worked on shall be left alone.
    NotThatOne,
    /// "No, like this": a demonstration of the task in question begins.
    LikeThis,
    /// "What did you learn?"
    WhatDidYouLearn,
    /// "Why?": why Leo takes the task in question for what it takes it.
    Why,
    /// "What do you think I see?"
    WhatDoISee,
    /// Anything else.
    Unknown,
}

/// What is said in the same words every time.
const FIXED: [(&[&str], Sentence); 15] = [
    (&["stop"], Sentence::Stop),
    (&["halt"], Sentence::Stop),
    (&["yes"], Sentence::Yes),
    (&["right"], Sentence::Yes),
    (&["no"], Sentence::No),
    (&["wrong"], Sentence::No),
    (&["not", "that", "one"], Sentence::NotThatOne),
    (&["no", "not", "that", "one"], Sentence::NotThatOne),
    (&["like", "this"], Sentence::LikeThis),
    (&["no", "like", "this"], Sentence::LikeThis),
    (&["what", "did", "you", "learn"], Sentence::WhatDidYouLearn),
    (&["what", "have", "you", "learned"], Sentence::WhatDidYouLearn),
    (&["why"], Sentence::Why),
    (&["what", "do", "you", "think", "i", "see"], Sentence::WhatDoISee),
    (&["what", "do", "i", "see"], Sentence::WhatDoISee),
];

impl Sentence {
    /// Understands a sentence. Case, punctuation and spaces do not matter, nor whether it begins
    /// with "Leo"; the task's name comes back in the words that were said.
    ///
    /// ```
    /// use tasks::Sentence;
    /// assert_eq!(Sentence::of("leo - I can teach you to do Task 1!"), Sentence::Teach("Task 1".to_owned()));
    /// assert_eq!(Sentence::of("Task 1 is done."), Sentence::Done("Task 1".to_owned()));
    /// assert_eq!(Sentence::of("Leo, do task 1"), Sentence::Do("task 1".to_owned()));
    /// assert_eq!(Sentence::of("No! Like this:"), Sentence::LikeThis);
    /// assert_eq!(Sentence::of("Leo, do"), Sentence::Unknown);
    /// ```
    #[must_use]
    pub fn of(text: &str) -> Self {
        let words = words(text);
        let rest = without(&words, &["leo"]).unwrap_or(&words);
        let fixed = FIXED.iter().find(|(said, _)| without(rest, said).is_some_and(<[_]>::is_empty));
        if let Some((_, sentence)) = fixed {
            sentence.clone()
        } else if let Some(name) = without(rest, &["i", "can", "teach", "you", "to", "do"]) {
            Self::about(name, Self::Teach)
        } else if let Some((name, ["is", "done"])) = split_end(rest) {
            Self::about(name, Self::Done)
        } else if let Some(name) = without(rest, &["do"]) {
            Self::about(name, Self::Do)
        } else {
            Self::Unknown
        }
    }

    /// What could be said, for an answer to a sentence that was not understood.
    #[must_use]
    pub fn help() -> String {
        "you can say: \"Leo, I can teach you to do task 1\", \"Task 1 is done\", \"Leo, do task 1\", \
         \"Stop\", \"Yes\", \"No, like this\", \"Not that one\", \"What did you learn?\", \"Why?\", \
         \"What do you think I see?\""
            .to_owned()
    }

    fn about(name: &[&str], sentence: impl Fn(String) -> Self) -> Self {
        if name.is_empty() { Self::Unknown } else { sentence(name.join(" ")) }
    }
}

/// A task's name as it is compared and stored: the same for all its spellings.
#[must_use]
pub fn key(name: &str) -> String {
    words(name).join(" ").to_lowercase()
}

fn words(text: &str) -> Vec<&str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '\'')
        .filter(|word| !word.is_empty())
        .collect()
}

fn without<'a, 'b>(words: &'a [&'b str], opening: &[&str]) -> Option<&'a [&'b str]> {
    let (head, rest) = words.split_at_checked(opening.len())?;
    head.iter().zip(opening).all(|(word, other)| word.eq_ignore_ascii_case(other)).then_some(rest)
}

fn split_end<'a>(words: &'a [&str]) -> Option<(&'a [&'a str], [&'static str; 2])> {
    let (name, end) = words.split_at_checked(words.len().checked_sub(2)?)?;
    let done = end.iter().zip(["is", "done"]).all(|(word, other)| word.eq_ignore_ascii_case(other));
    done.then_some((name, ["is", "done"]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_a_name_have_one_key() {
        assert_eq!(key("Task 1"), key("  task, 1. "));
        assert_ne!(key("task 1"), key("task 2"));
    }

    #[test]
    fn a_sentence_without_a_name_is_not_understood() {
        for text in ["", "Leo", "is done", "do", "I can teach you to do", "hello Leo", "no way", "stop it"] {
            assert_eq!(Sentence::of(text), Sentence::Unknown, "{text:?}");
        }
    }

    #[test]
    fn every_sentence_of_the_help_is_understood() {
        let help = Sentence::help();
        let examples: Vec<&str> = help.split('"').skip(1).step_by(2).collect();
        assert_eq!(examples.len(), 10);
        for example in examples {
            assert_ne!(Sentence::of(example), Sentence::Unknown, "{example}");
        }
    }
}

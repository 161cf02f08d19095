//! What a person says.

/// A sentence of a person, as parsed by Leo.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sentence {
    /// "Leo, I can teach you to do X": begins a demonstration of X.
    Teach(String),
    /// "X is done": ends the demonstration of X. A task name may begin with "please" and the like. So these are all
    /// candidates for the name, with successively fewer leading courtesy words.
    Done(Vec<String>),
    /// "Leo, do X": perform X.
    Do(String),
    /// "Stop", "Please stop it": hold still.
    Stop,
    /// "Yes": the performance was right.
    Yes,
    /// "No": the performance was wrong.
    No,
    /// "No, not that one": leave the current object alone.
    NotThatOne,
    /// "No, like this": begins another demonstration of the current task.
    LikeThis,
    /// "What did you learn?"
    WhatDidYouLearn,
    /// "Why?": asks why Leo learned this rule for the current task.
    Why,
    /// "What do you think I see?"
    WhatDoISee,
    /// Anything else.
    Unknown,
}

/// Words at the beginning of a sentence that are skipped.
const COURTESIES: [&str; 3] = ["leo", "hey", "please"];
/// Words that mean [`Sentence::Stop`].
const STOPS: [&str; 2] = ["stop", "halt"];
/// In a sentence of at most this many words, a stop word counts at any position.
const MAX_SHORT_WORDS: usize = 4;

/// Sentences with a fixed wording.
const FIXED_SENTENCES: [(&[&str], Sentence); 13] = [
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
    /// Parses a sentence. Case, punctuation and spaces are ignored, as are leading "Leo", "hey" and "please". Task
    /// names keep their spelling.
    ///
    /// Stop is recognised generously, because an unnecessary stop is less harmful than a missed one. A short sentence
    /// with "stop" or "halt" anywhere is [`Sentence::Stop`], and so is a longer one that begins or ends with it. A
    /// sentence that teaches, ends or requests a task of that name is not a stop.
    ///
    /// ```
    /// use tasks::Sentence;
    /// assert_eq!(Sentence::of("leo - I can teach you to do Task 1!"), Sentence::Teach("Task 1".to_owned()));
    /// assert_eq!(Sentence::of("Task 1 is done."), Sentence::Done(vec!["Task 1".to_owned()]));
    /// assert_eq!(Sentence::of("Leo, do task 1"), Sentence::Do("task 1".to_owned()));
    /// assert_eq!(Sentence::of("No! Like this:"), Sentence::LikeThis);
    /// assert_eq!(Sentence::of("Hey Leo, please stop it!"), Sentence::Stop);
    /// assert_eq!(Sentence::of("Leo, do"), Sentence::Unknown);
    /// ```
    #[must_use]
    pub fn of(text: &str) -> Self {
        let words = words(text);
        let begin = words.iter().take_while(|word| is_one_of(word, &COURTESIES)).count();
        let rest = words.get(begin..).unwrap_or(&[]);
        let fixed = FIXED_SENTENCES.iter().find(|(said, _)| without(rest, said).is_some_and(<[_]>::is_empty));
        if let Some((_, sentence)) = fixed {
            sentence.clone()
        } else if let Some(name) = without(rest, &["i", "can", "teach", "you", "to", "do"]) {
            Self::about(name, Self::Teach)
        } else if let Some(name) = before_is_done(&words).filter(|name| !name.is_empty()) {
            let names = (0..=begin).filter_map(|left_out| name.get(left_out..));
            Self::Done(names.filter(|name| !name.is_empty()).map(|name| name.join(" ")).collect())
        } else if let Some(name) = without(rest, &["do"]) {
            Self::about(name, Self::Do)
        } else if says_stop(rest) {
            Self::Stop
        } else {
            Self::Unknown
        }
    }

    /// The sentences that are understood, as a reply to one that was not.
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

/// The normalised name of a task, equal for all its spellings. Number words up to twenty become digits: "task one"
/// is "Task 1".
///
/// Stored tasks are keyed by it: a change here needs another version of the store.
#[must_use]
pub fn key(name: &str) -> String {
    let in_digits = |word: &str| {
        let word = word.to_lowercase();
        NUMBERS.split(' ').position(|number| number == word).map_or(word, |number| number.to_string())
    };
    words(name).into_iter().map(in_digits).collect::<Vec<_>>().join(" ")
}

/// The number words from 0 to 20.
const NUMBERS: &str = "zero one two three four five six seven eight nine ten eleven twelve thirteen \
    fourteen fifteen sixteen seventeen eighteen nineteen twenty";

fn words(text: &str) -> Vec<&str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '\'')
        .filter(|word| !word.is_empty())
        .collect()
}

fn without<'a, 'b>(words: &'a [&'b str], opening: &[&str]) -> Option<&'a [&'b str]> {
    let (head, rest) = words.split_at_checked(opening.len())?;
    head.iter().zip(opening).all(|(word, other)| word.eq_ignore_ascii_case(other)).then_some(rest)
}

fn is_one_of(word: &str, words: &[&str]) -> bool {
    words.iter().any(|other| word.trim_matches('\'').eq_ignore_ascii_case(other))
}

fn says_stop(words: &[&str]) -> bool {
    let is_stop = |word: &&str| is_one_of(word, &STOPS);
    let is_short = words.len() <= MAX_SHORT_WORDS && words.iter().any(is_stop);
    is_short || words.first().is_some_and(is_stop) || words.last().is_some_and(is_stop)
}

/// The words before a final "is done".
fn before_is_done<'a, 'b>(words: &'a [&'b str]) -> Option<&'a [&'b str]> {
    let (name, end) = words.split_at_checked(words.len().checked_sub(2)?)?;
    without(end, &["is", "done"]).map(|_| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_a_task_name_have_one_key() {
        assert_eq!(key("Task 1"), key("  task, 1. "));
        assert_ne!(key("task 1"), key("task 2"));
        assert_eq!(key("Task Twenty"), key("task 20"));
        assert_eq!(key("task one"), "task 1");
        assert_eq!((key("someone"), key("one by one")), ("someone".to_owned(), "1 by 1".to_owned()));
    }

    #[test]
    fn a_sentence_without_a_name_is_not_understood() {
        for text in ["", "Leo", "is done", "do", "I can teach you to do", "hello Leo", "no way", "hey please"]
        {
            assert_eq!(Sentence::of(text), Sentence::Unknown, "{text:?}");
        }
    }

    #[test]
    fn stop_is_understood_however_it_is_said() {
        for text in [
            "stop",
            "Halt!",
            "Stop, stop!",
            "Please stop.",
            "Leo, stop now",
            "Hey Leo, stop!",
            "no, stop",
            "stop it",
            "Leo! Would you please stop?",
            "please, Leo, halt it at once",
            "Stop what you are doing there, Leo",
            "no no no no no stop",
            "I said 'stop', Leo",
        ] {
            assert_eq!(Sentence::of(text), Sentence::Stop, "{text:?}");
        }
        let chat = "I saw the stop of the bus";
        assert_eq!(Sentence::of(chat), Sentence::Unknown, "nobody says stop like that");
    }

    #[test]
    fn a_task_may_have_the_name_the_stop() {
        let name = || "the stop".to_owned();
        assert_eq!(Sentence::of("Leo, I can teach you to do the stop"), Sentence::Teach(name()));
        assert_eq!(Sentence::of("The stop is done"), Sentence::Done(vec!["The stop".to_owned()]));
        assert_eq!(Sentence::of("Leo, do the stop"), Sentence::Do(name()));
        assert_eq!(Sentence::of("Hey Leo, please do the stop"), Sentence::Do(name()));
    }

    #[test]
    fn a_task_name_may_begin_with_a_courtesy_word() {
        let done = |names: &[&str]| Sentence::Done(names.iter().map(|&name| name.to_owned()).collect());
        assert_eq!(Sentence::of("Please me is done"), done(&["Please me", "me"]));
        assert_eq!(
            Sentence::of("Hey Leo, task 1 is done"),
            done(&["Hey Leo task 1", "Leo task 1", "task 1"])
        );
        assert_eq!(Sentence::of("Please is done"), done(&["Please"]));
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

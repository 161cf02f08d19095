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
}

use std::ops::Range;

/// A word of a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    /// The word in lower case.
    pub(crate) word: String,
    /// Where it stands in the sentence.
    pub(crate) span: Range<usize>,
    /// Whether a punctuation mark stands before it.
    pub(crate) begins_clause: bool,
}

impl Token {
    /// Another word at the same place.
    pub(crate) fn with(&self, word: &str) -> Self {
        Self { word: word.to_owned(), ..self.clone() }
    }
}

/// The words of a text: letters, digits and apostrophes.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let mut found: Vec<Token> = Vec::new();
    let mut is_inside = false;
    let mut begins_clause = false;
    for (at, letter) in text.char_indices() {
        let is_apostrophe = matches!(letter, '\'' | '’' | '‘' | '`');
        if letter.is_alphanumeric() || is_apostrophe && is_inside {
            if !is_inside {
                found.push(Token { word: String::new(), span: at..at, begins_clause });
            }
            if let Some(token) = found.last_mut() {
                token.span.end = at + letter.len_utf8();
                if is_apostrophe {
                    token.word.push('\'');
                } else {
                    token.word.extend(letter.to_lowercase());
                }
            }
            is_inside = true;
            begins_clause = false;
        } else {
            is_inside = false;
            begins_clause |= !letter.is_whitespace() && !is_apostrophe;
        }
    }
    for token in &mut found {
        // An apostrophe at the end is a quotation mark.
        let kept = token.word.trim_end_matches('\'').len();
        if kept < token.word.len() {
            token.word.truncate(kept);
            token.span.end = text.get(token.span.clone()).map_or(token.span.end, |word| {
                token.span.start + word.trim_end_matches(['\'', '’', '‘', '`']).len()
            });
        }
    }
    found
}

/// The words of a text, in lower case.
pub(crate) fn words(text: &str) -> Vec<String> {
    tokens(text).into_iter().map(|token| token.word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_with_their_places() {
        let text = "Don’t, 'Task 1'!";
        let found = tokens(text);
        let words: Vec<(&str, &str, bool)> = found
            .iter()
            .map(|token| (token.word.as_str(), &text[token.span.clone()], token.begins_clause))
            .collect();
        assert_eq!(words, [("don't", "Don’t", false), ("task", "Task", true), ("1", "1", false)]);
    }
}

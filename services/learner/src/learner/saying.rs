//! What Leo says, as events.

use message::{Event, EventKind, TEXT_CAPACITY};

use super::Output;

/// Says a text about a task.
pub(super) fn say(output: &mut Output, task: &str, text: &str) {
    output.events.extend(sayable(text).into_iter().map(|part| Event::new(EventKind::Said, task, part)));
}

/// A text in parts that fit an event, cut at a semicolon, else at a comma, else between two words.
fn sayable(text: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let mut rest = text;
    while rest.len() > TEXT_CAPACITY {
        let fitting = (0..=TEXT_CAPACITY).rev().find_map(|end| rest.get(..end)).unwrap_or(rest);
        let cut = ["; ", ", ", " "].into_iter().find_map(|mark| {
            let at = fitting.rfind(mark).filter(|at| *at > 0)?;
            Some(at + mark.trim_end().len())
        });
        let (part, after) = rest.split_at(cut.unwrap_or(fitting.len()));
        parts.push(part);
        rest = after.trim_start();
    }
    parts.push(rest);
    parts
}

/// Says why a task is not performed, and reports that it is declined.
pub(super) fn decline(output: &mut Output, task: &str, text: &str) {
    say(output, task, text);
    output.events.push(Event::new(EventKind::Declined, task, text));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_answer_is_said_in_parts_and_no_word_is_cut() {
        let text = "the red square, the grün square and so on; ".repeat(20);
        let parts = sayable(text.trim_end());
        assert!(parts.len() > 3 && parts.iter().all(|part| part.len() <= TEXT_CAPACITY));
        assert!(parts.iter().all(|part| part.ends_with(';')), "{parts:?}");
        assert_eq!(parts.join(" "), text.trim_end());
        assert_eq!(sayable("yes"), ["yes"]);
        let word = "ü".repeat(TEXT_CAPACITY);
        assert_eq!(sayable(&word).concat(), word);
    }
}

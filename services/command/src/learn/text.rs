//! The learned rules as text.

use std::fmt::Write as _;

use config::Names;
use quantity::number::{counted, saturating_u32};
use tasks::{
    Change, Inquiry, Object, OpenQuestion, Signature, ask_about, describe_change, describe_object, listed,
    with_article,
};

use super::examples::Examples;
use super::results::{Conclusion, ExampleResult};

/// The results for one example.
pub(super) fn example(examples: &Examples, names: &Names, result: &ExampleResult<'_>) -> String {
    let mut text = String::new();
    if let Some(title) = examples.title.as_ref().filter(|_| result.number == 1) {
        let _ = writeln!(text, "{title}\n");
    }
    let _ = writeln!(text, "example {} (line {})", result.number, result.shown.line);
    for (&perspective, learned) in &result.learned {
        if learned.goals.is_empty() {
            let _ = writeln!(text, "  {:<11} no rule explains what changed", names.of(perspective));
        }
        for rule in learned.goals.iter().flatten() {
            let _ = writeln!(
                text,
                "  {:<11} {:>3}. {} {:>3} of {:<3} {:.4}  {} {}",
                names.of(perspective),
                rule.standing.rank,
                if rule.standing.high_likelihood { '*' } else { ' ' },
                rule.standing.tally,
                rule.standing.examples,
                rule.standing.posterior,
                rule.name,
                expectation(&rule.expectation),
            );
        }
    }
    for (index, object) in result.shown.asked.iter().enumerate() {
        let name = describe_object(&examples.language, object, result.shown.asked.iter());
        for answer in &result.answers {
            let probability = answer.probabilities.get(index).copied().flatten();
            let probability = probability.map_or_else(|| "  --  ".to_owned(), |p| format!("{p:.4}"));
            let goal = expectation(&answer.goal);
            let _ = writeln!(
                text,
                "  {:<11} {probability} that {name} ({}) is to be {goal}",
                names.of(answer.perspective),
                object.id
            );
        }
    }
    text.push('\n');
    text
}

/// The final results.
pub(super) fn closing(examples: &Examples, names: &Names, conclusion: &Conclusion) -> String {
    let mut text = String::new();
    match (&conclusion.open_question, &conclusion.followed) {
        (Some(open), _) => {
            let _ = writeln!(text, "Leo follows no rule yet: \"{}\"", open_question(examples, open));
        }
        (None, None) => text.push_str("No perspective explains what changed.\n"),
        (None, Some((perspective, learned))) => {
            let spoken =
                learned.primary().map(|rule| format!("{} {}", rule.name, expectation(&rule.expectation)));
            let _ = writeln!(
                text,
                "Leo follows {}: {}",
                whom(names, *perspective),
                listed(&spoken.collect::<Vec<_>>())
            );
        }
    }
    for (goal, question, demonstration) in &conclusion.inquiries {
        let mut say = |what: &str, inquiry: &Inquiry| {
            let _ = writeln!(text, "{what}: \"{}\" ({:.2} bits)", inquiry.text, inquiry.bits);
        };
        match question {
            None => {
                let examples = counted(saturating_u32(examples.shown.len()), "example");
                let _ = writeln!(text, "No question about {} remains after {examples}.", expectation(goal));
            }
            Some(question) => say("To be asked next", question),
        }
        if let Some(Inquiry { text: asked, bits, .. }) = demonstration {
            let _ = writeln!(text, "To be shown next: \"{asked}\" ({bits:.2} bits)");
        }
    }
    text
}

/// The question to ask before any rules are followed.
pub(super) fn open_question(examples: &Examples, open: &OpenQuestion) -> String {
    let thing = Object { features: open.kind.clone(), ..Object::default() };
    let shown = examples.shown.iter().flat_map(|shown| &shown.views).flat_map(|view| &view.after.objects);
    ask_about(&with_article(&describe_object(&examples.language, &thing, shown)), &open.goal)
}

pub(super) fn expectation(signature: &Signature) -> String {
    describe_change(&Change { signature: signature.clone(), displaced: false })
}

fn whom(names: &Names, perspective: u16) -> String {
    if perspective == 0 { "its own view".to_owned() } else { names.of(perspective) }
}

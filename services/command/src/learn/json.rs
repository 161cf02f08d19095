//! The learned rules as one JSON document, written example by example:
//! `{"title", "language", "noise", "examples": [..], "followed", "open_question", "inquiries"}`.
//! `docs/examples-format.md` describes its parts.

use serde_json::{Value, json};
use tasks::{Inquiry, Learned, Rule, Selection, Settings};

use super::examples::Examples;
use super::results::{Conclusion, ExampleResult};
use super::text::{expectation, open_question};

/// The document up to its first example.
pub(super) fn opening(examples: &Examples, settings: &Settings) -> serde_json::Result<String> {
    let language = settings.language.word();
    let title = serde_json::to_string(&examples.title)?;
    let noise = serde_json::to_string(&settings.noise.get())?;
    Ok(format!("{{\"title\":{title},\"language\":\"{language}\",\"noise\":{noise},\"examples\":["))
}

/// One example.
pub(super) fn example(result: &ExampleResult<'_>) -> serde_json::Result<String> {
    let perspectives: Vec<Value> =
        result.learned.iter().map(|(perspective, learned)| learned_by(*perspective, learned)).collect();
    let asked = result.shown.asked.iter().enumerate().map(|(index, object)| {
        let answers = result.answers.iter().map(|answer| {
            json!({
                "perspective": answer.perspective,
                "goal": expectation(&answer.goal),
                "probability": answer.probabilities.get(index).copied().flatten(),
            })
        });
        json!({ "id": object.id, "features": object.features, "answers": answers.collect::<Vec<_>>() })
    });
    let example = json!({
        "line": result.shown.line,
        "perspectives": perspectives,
        "asked": asked.collect::<Vec<_>>(),
    });
    let comma = if result.number > 1 { ",\n" } else { "\n" };
    Ok(format!("{comma}{}", serde_json::to_string(&example)?))
}

/// The document after its last example.
pub(super) fn closing(examples: &Examples, conclusion: &Conclusion) -> serde_json::Result<String> {
    let followed = conclusion.followed.as_ref().map(|(perspective, learned)| {
        let rules: Vec<&str> = learned.primary().map(|rule| rule.name.as_str()).collect();
        json!({ "perspective": perspective, "rules": rules })
    });
    let inquiries = conclusion.inquiries.iter().map(|(goal, question, demonstration)| {
        json!({
            "goal": expectation(goal),
            "question": question.as_ref().map(inquiry),
            "demonstration": demonstration.as_ref().map(inquiry),
        })
    });
    let followed = serde_json::to_string(&followed)?;
    let inquiries = serde_json::to_string(&inquiries.collect::<Vec<_>>())?;
    let open = match &conclusion.open_question {
        Some(open) => {
            format!("\"open_question\":{},", serde_json::to_string(&open_question(examples, open))?)
        }
        None => String::new(),
    };
    Ok(format!("\n],\"followed\":{followed},{open}\"inquiries\":{inquiries}}}\n"))
}

fn learned_by(perspective: u16, learned: &Learned) -> Value {
    let goals = learned.goals.iter().map(|rules| {
        let goal = rules.first().map(|rule| expectation(&rule.expectation));
        json!({ "goal": goal, "rules": rules.iter().map(rule).collect::<Vec<_>>() })
    });
    let means = learned
        .means
        .iter()
        .map(|means| json!({ "change": expectation(&means.signature), "kinds": means.kinds }));
    json!({
        "perspective": perspective,
        "examples": learned.examples,
        "goals": goals.collect::<Vec<_>>(),
        "means": means.collect::<Vec<_>>(),
    })
}

fn rule(rule: &Rule) -> Value {
    let selection = match rule.selection {
        Selection::All => json!("all"),
        Selection::Exactly(count) => json!({ "exactly": count }),
        Selection::AllBut(count) => json!({ "all_but": count }),
        Selection::Relation(relation) => json!({ "relation": relation.words() }),
    };
    json!({
        "name": rule.name,
        "rank": rule.standing.rank,
        "tally": rule.standing.tally,
        "posterior": rule.standing.posterior,
        "high_likelihood": rule.standing.high_likelihood,
        "template": rule.template,
        "classes": rule.classes,
        "selection": selection,
    })
}

fn inquiry(inquiry: &Inquiry) -> Value {
    json!({
        "text": inquiry.text,
        "objects": inquiry.objects,
        "probabilities": inquiry.probabilities,
        "bits": inquiry.bits,
    })
}

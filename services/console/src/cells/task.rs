use std::collections::BTreeSet;

use account::Account;
use serde_json::json;

use super::rounded;
use crate::sheet::Sheet;

/// Shows what the learner makes of each task.
pub(crate) fn tasks(sheet: &mut Sheet, account: &Account) {
    let mut stay = BTreeSet::new();
    for task in &account.tasks {
        let key = format!("task/{}", task.name);
        let hypotheses: serde_json::Map<String, serde_json::Value> = task
            .hypotheses
            .iter()
            .map(|(perspective, hypotheses)| {
                let told = hypotheses.iter().map(|hypothesis| {
                    json!({
                        "name": hypothesis.name,
                        "posterior": rounded(hypothesis.posterior, 1e6),
                        "tally": hypothesis.tally,
                        "rank": hypothesis.rank,
                        "high": hypothesis.high_likelihood,
                    })
                });
                (perspective.clone(), told.collect())
            })
            .collect();
        let performances: Vec<_> = task
            .performances
            .iter()
            .map(|performance| {
                json!({ "done": performance.done, "failed": performance.failed, "result": performance.result })
            })
            .collect();
        sheet.put(
            &key,
            &json!({
                "name": task.name,
                "examples": task.examples,
                "hypotheses": hypotheses,
                "rule": task.rule,
                "why": task.explanation,
                "performances": performances,
            }),
        );
        stay.insert(key);
    }
    sheet.keep_only("task/", &stay);
}

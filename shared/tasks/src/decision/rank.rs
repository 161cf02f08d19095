//! From hypotheses to rules: merges equivalent hypotheses, ranks the results and names them.

use std::cmp::Ordering;

use rustc_hash::{FxBuildHasher, FxHashMap};

use super::rule::{Rule, Standing};
use super::rule_name::{describe_rule, listing_cost};
use crate::hypotheses::{
    Described, GoalBelief, Key, Lexicon, LogSum, Mask, Scored, Selection, Settings, TIE, reduce,
};
use crate::language::Language;

/// A group of equivalent hypotheses.
#[derive(Clone, Debug, Default)]
struct EquivalentHypotheses {
    tally: usize,
    sum: LogSum,
    description: Option<Described>,
}

/// A rule before it is named. It is kept in numeric form because only a few of many get a name.
struct CandidateRule {
    log_posterior: f64,
    tally: usize,
    mask: Mask,
    classes: Vec<Key>,
    selection: Selection,
    description: Option<Described>,
}

/// The context of a ranking: the goal, and the words for it.
#[derive(Clone, Copy)]
pub(crate) struct RankingContext<'a> {
    pub(crate) language: &'a Language,
    pub(crate) lexicon: &'a Lexicon,
    pub(crate) goal: &'a GoalBelief,
    pub(crate) examples: usize,
}

/// Makes rules from hypotheses, best first, at most `max_rules` of them.
///
/// Without label noise they are ranked by tally first, then by posterior.
pub(crate) fn rank(
    subject: &RankingContext<'_>,
    scored: Scored,
    settings: &Settings,
    max_rules: usize,
) -> Vec<Rule> {
    let by_tally = settings.noise.logs().is_none();
    let mut meanings: FxHashMap<(Selection, Mask, Vec<Key>), EquivalentHypotheses> =
        FxHashMap::with_capacity_and_hasher(scored.hypotheses.len(), FxBuildHasher);
    for hypothesis in scored.hypotheses {
        let (mask, classes) = reduce(hypothesis.mask, hypothesis.classes, &subject.goal.seen);
        let meaning = meanings.entry((hypothesis.selection, mask, classes)).or_default();
        meaning.tally = meaning.tally.max(hypothesis.tally);
        meaning.sum.add(hypothesis.log_score);
        // `None` means a listing of classes, whose cost is compared in `named`.
        meaning.description = meaning.description.into_iter().chain(hypothesis.description).min();
    }
    let mut contenders: Vec<CandidateRule> = meanings
        .into_iter()
        .map(|((selection, mask, classes), EquivalentHypotheses { tally, sum, description })| {
            let log_posterior = sum.value() - scored.log_total;
            CandidateRule { log_posterior, tally, mask, classes, selection, description }
        })
        .collect();
    let by_merit = |a: &CandidateRule, b: &CandidateRule| {
        let tally = if by_tally { b.tally.cmp(&a.tally) } else { Ordering::Equal };
        tally.then(b.log_posterior.total_cmp(&a.log_posterior))
    };
    contenders.sort_unstable_by(|a, b| {
        by_merit(a, b).then_with(|| (a.mask, &a.classes).cmp(&(b.mask, &b.classes)))
    });
    // Rules that tie with the last one that fits are kept for now.
    let last = max_rules
        .checked_sub(1)
        .and_then(|last| contenders.get(last))
        .map(|one| (one.tally, one.log_posterior));
    let ties = |one: &CandidateRule| {
        last.is_some_and(|(tally, log)| (!by_tally || tally == one.tally) && ties(log, one.log_posterior))
    };
    let kept =
        contenders.iter().enumerate().take_while(|(index, one)| *index < max_rules || ties(one)).count();
    contenders.truncate(kept);
    let mut rules: Vec<(f64, Rule)> = contenders.into_iter().map(|one| named(subject, one)).collect();
    number(&mut rules, by_tally, settings.high_likelihood);
    rules.truncate(max_rules);
    rules.into_iter().map(|(_, rule)| rule).collect()
}

fn named(subject: &RankingContext<'_>, contender: CandidateRule) -> (f64, Rule) {
    let RankingContext { language, lexicon, goal, examples } = subject;
    let CandidateRule { log_posterior, tally, mask, classes, selection, description } = contender;
    let template = lexicon.template(mask);
    let seen_classes = goal.seen.classes(mask).into_iter().map(|key| lexicon.class(mask, key)).collect();
    let classes = classes.into_iter().map(|key| lexicon.class(mask, key)).collect();
    let listing = listing_cost(&template, &classes, &seen_classes);
    let described = description.filter(|described| described.cost < listing);
    let phrase = described.map(|described| goal.phrase(described.set, language, lexicon));
    let rule = Rule {
        expectation: goal.signature.clone(),
        name: describe_rule(language, &template, &classes, &seen_classes, selection, phrase.as_deref()),
        template,
        classes,
        selection,
        standing: Standing {
            tally,
            examples: *examples,
            posterior: log_posterior.exp(),
            ..Standing::default()
        },
    };
    (log_posterior, rule)
}

/// Sorts ties deterministically and assigns the ranks; ties share a rank.
fn number(rules: &mut [(f64, Rule)], by_tally: bool, share: f64) {
    let Some((best_log, best_tally)) = rules.first().map(|(log, rule)| (*log, rule.standing.tally)) else {
        return;
    };
    let alike = |(a_log, a): &(f64, Rule), (b_log, b): &(f64, Rule)| {
        (!by_tally || a.standing.tally == b.standing.tally) && ties(*a_log, *b_log)
    };
    let mut rank = 1;
    for tied in rules.chunk_by_mut(alike) {
        let order = |rule: &Rule| (rule.selection, rule.template.clone(), rule.classes.clone());
        tied.sort_by_cached_key(|(_, rule)| order(rule));
        for (log, rule) in tied.iter_mut() {
            rule.standing.rank = rank;
            let explains = !by_tally || (rule.standing.tally == best_tally && rule.standing.tally > 0);
            rule.standing.high_likelihood = explains && *log >= best_log + share.ln() - TIE;
        }
        rank += tied.len();
    }
}

#[expect(clippy::float_cmp, reason = "two infinities tie, and their difference is no number")]
fn ties(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() < TIE
}

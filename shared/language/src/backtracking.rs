use std::collections::BTreeMap;

use pest_meta::ast::{Expr, Rule, RuleType};

/// Rewrites the rules of whole sentences so that a choice is undone if the rest of the sentence does not fit.
///
/// A parsing expression grammar commits to the first alternative that matches. So `("do" | "do it") ~ "now"` does not
/// match "do it now", and an author would have to know the order of all phrases. Here each alternative is followed by
/// the rest of its sentence up to the end, and thus matches only if the rest does. A repetition stays greedy, which
/// bounds the time.
pub(crate) fn backtracking(rules: Vec<Rule>, is_sentence: impl Fn(&str) -> bool) -> Vec<Rule> {
    let rules: Vec<Rule> =
        rules.into_iter().map(|rule| Rule { expr: rule.expr.map_bottom_up(longest_first), ..rule }).collect();
    let silent = rules.iter().filter(|rule| rule.ty == RuleType::Silent);
    let mut rewriter = Rewriter {
        inlined: silent.map(|rule| (rule.name.clone(), rule.expr.clone())).collect(),
        open: Vec::new(),
        rests: Vec::new(),
    };
    let mut rewritten: Vec<Rule> = Vec::new();
    for rule in rules {
        let expr = if is_sentence(&rule.name) {
            let sentence = rewriter.followed(rule.expr, &ident("EOI"));
            Expr::Seq(Box::new(ident("SOI")), Box::new(sentence))
        } else {
            rule.expr
        };
        rewritten.push(Rule { expr, ..rule });
    }
    rewritten.extend(rewriter.rests);
    rewritten
}

struct Rewriter {
    /// Rules that stand for their expression.
    inlined: BTreeMap<String, Expr>,
    /// The rules that are being inlined: a rule inside itself is not.
    open: Vec<String>,
    /// The rests of sentences.
    rests: Vec<Rule>,
}

impl Rewriter {
    /// An expression followed by the rest of its sentence.
    fn followed(&mut self, expression: Expr, rest: &Expr) -> Expr {
        match expression {
            Expr::Seq(first, second) => {
                let second = self.followed(*second, rest);
                let rest = self.named(second);
                self.followed(*first, &rest)
            }
            Expr::Choice(..) => {
                let alternatives = alternatives(expression);
                choice(alternatives.into_iter().map(|alternative| self.followed(alternative, rest)).collect())
            }
            Expr::Opt(inner) => {
                let with = self.followed(*inner, rest);
                Expr::Choice(Box::new(with), Box::new(rest.clone()))
            }
            Expr::Ident(name) => {
                match self.inlined.get(&name).filter(|_| !self.open.contains(&name)).cloned() {
                    Some(inner) => {
                        self.open.push(name);
                        let inner = self.followed(inner, rest);
                        self.open.pop();
                        inner
                    }
                    None => Expr::Seq(Box::new(Expr::Ident(name)), Box::new(rest.clone())),
                }
            }
            expression @ (Expr::Str(_)
            | Expr::Insens(_)
            | Expr::Range(..)
            | Expr::PeekSlice(..)
            | Expr::PosPred(_)
            | Expr::NegPred(_)
            | Expr::Rep(_)
            | Expr::RepOnce(_)
            | Expr::RepExact(..)
            | Expr::RepMin(..)
            | Expr::RepMax(..)
            | Expr::RepMinMax(..)
            | Expr::Skip(_)
            | Expr::Push(_)) => Expr::Seq(Box::new(expression), Box::new(rest.clone())),
        }
    }

    /// A rule of its own for the rest of a sentence, so that the alternatives before it share it.
    fn named(&mut self, expr: Expr) -> Expr {
        if let Expr::Ident(_) = expr {
            return expr;
        }
        let name = format!("rest_{}", self.rests.len());
        self.rests.push(Rule { name: name.clone(), ty: RuleType::Silent, expr });
        ident(&name)
    }
}

fn ident(name: &str) -> Expr {
    Expr::Ident(name.to_owned())
}

/// The alternatives of a choice.
fn alternatives(expression: Expr) -> Vec<Expr> {
    let mut found = Vec::new();
    let mut rest = expression;
    while let Expr::Choice(first, others) = rest {
        found.extend(alternatives(*first));
        rest = *others;
    }
    found.push(rest);
    found
}

/// A choice of alternatives, of which there is at least one.
fn choice(mut alternatives: Vec<Expr>) -> Expr {
    let last = alternatives.pop().unwrap_or_else(|| ident("EOI"));
    alternatives.into_iter().rev().fold(last, |after, before| Expr::Choice(Box::new(before), Box::new(after)))
}

/// A choice whose phrases are sorted by length, so that of two that begin alike the longer one is tried first.
fn longest_first(expression: Expr) -> Expr {
    let Expr::Choice(..) = expression else { return expression };
    let mut alternatives = alternatives(expression);
    let phrase =
        |alternative: &Expr| if let Expr::Str(phrase) = alternative { Some(phrase.clone()) } else { None };
    let mut phrases: Vec<String> = alternatives.iter().filter_map(phrase).collect();
    phrases.sort_by_key(|phrase| std::cmp::Reverse(phrase.len()));
    let mut phrases = phrases.into_iter();
    for alternative in &mut alternatives {
        if let Expr::Str(place) = alternative
            && let Some(phrase) = phrases.next()
        {
            *place = phrase;
        }
    }
    choice(alternatives)
}

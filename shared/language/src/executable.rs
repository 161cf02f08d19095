use pest_meta::ast::{Expr, Rule};
use pest_meta::optimizer::{OptimizedExpr, OptimizedRule};

/// A rule as the virtual machine runs it.
///
/// The optimizer of `pest_meta` is left out: it needs seconds for the rules of a language, and they run no faster.
pub(crate) fn executable(rule: Rule) -> OptimizedRule {
    OptimizedRule { name: rule.name, ty: rule.ty, expr: converted(rule.expr) }
}

fn converted(expression: Expr) -> OptimizedExpr {
    let boxed = |inner: Box<Expr>| Box::new(converted(*inner));
    match expression {
        Expr::Str(text) => OptimizedExpr::Str(text),
        Expr::Insens(text) => OptimizedExpr::Insens(text),
        Expr::Range(from, to) => OptimizedExpr::Range(from, to),
        Expr::Ident(name) => OptimizedExpr::Ident(name),
        Expr::PeekSlice(from, to) => OptimizedExpr::PeekSlice(from, to),
        Expr::PosPred(inner) => OptimizedExpr::PosPred(boxed(inner)),
        Expr::NegPred(inner) => OptimizedExpr::NegPred(boxed(inner)),
        Expr::Seq(first, second) => OptimizedExpr::Seq(boxed(first), boxed(second)),
        Expr::Choice(first, second) => OptimizedExpr::Choice(boxed(first), boxed(second)),
        Expr::Opt(inner) => OptimizedExpr::Opt(boxed(inner)),
        Expr::Rep(inner) => OptimizedExpr::Rep(boxed(inner)),
        Expr::RepOnce(inner) => repeated(&converted(*inner), 1, None),
        Expr::RepExact(inner, count) => repeated(&converted(*inner), count, Some(count)),
        Expr::RepMin(inner, least) => repeated(&converted(*inner), least, None),
        Expr::RepMax(inner, most) => repeated(&converted(*inner), 0, Some(most)),
        Expr::RepMinMax(inner, least, most) => repeated(&converted(*inner), least, Some(most)),
        Expr::Skip(texts) => OptimizedExpr::Skip(texts),
        Expr::Push(inner) => OptimizedExpr::Push(boxed(inner)),
    }
}

/// An expression `least` to `most` times.
fn repeated(inner: &OptimizedExpr, least: u32, most: Option<u32>) -> OptimizedExpr {
    let boxed = || Box::new(inner.clone());
    let then = |rest, _| OptimizedExpr::Seq(boxed(), Box::new(rest));
    let end = match most {
        None => OptimizedExpr::Rep(boxed()),
        Some(most) => {
            let optional =
                |rest, _| OptimizedExpr::Opt(Box::new(OptimizedExpr::Seq(boxed(), Box::new(rest))));
            (least..most).fold(OptimizedExpr::Str(String::new()), optional)
        }
    };
    (0..least).fold(end, then)
}

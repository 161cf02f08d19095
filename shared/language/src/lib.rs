#![doc = include_str!("../README.md")]

mod act;
mod backtracking;
mod builtin;
mod context;
mod executable;
mod file;
mod grammar;
mod lexicon;
mod nearest;
mod replies;
mod rules;
mod stop;
mod token;

pub use act::{Act, ActKind, Scope};
pub use builtin::BuiltIn;
pub use context::Context;
pub use grammar::{Grammar, Reading};
pub use replies::{Replies, fill};

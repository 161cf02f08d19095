//! What five sentences mean to a robot that does a task: `cargo run -p leo-language --example sentences`.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use language::{ActKind, BuiltIn, Context, Reading};

fn main() {
    let grammar = BuiltIn::English.grammar();
    let context = Context { tasks: vec!["filling".to_owned()], is_moving: true, ..Context::default() };
    let mut stops = 0;
    for text in ["could you do fillng?", "wait a moment", "please dont stop", "what can you see", "stpo"] {
        match grammar.understand(text, &context) {
            Reading::Understood(act) => {
                println!("{text}: {:?} {}", act.kind, act.task.as_deref().unwrap_or_default());
                stops += u32::from(act.kind == ActKind::Stop);
            }
            Reading::Guessed { sentence, .. } => println!("{text}: did you mean \"{sentence}\"?"),
        }
    }
    assert_eq!(stops, 2, "\"wait a moment\" and the misspelt \"stop\"");
}

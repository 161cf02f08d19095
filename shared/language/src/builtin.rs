use std::path::Path;

use serde::Deserialize;

use crate::grammar::Grammar;

/// The languages that are built in.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
pub enum BuiltIn {
    /// English, `config/language/en.toml` at compile time.
    #[default]
    #[serde(rename = "en")]
    English,
    /// German, `config/language/de.toml` at compile time.
    #[serde(rename = "de")]
    German,
}

impl BuiltIn {
    /// The grammar of the language.
    #[must_use]
    #[expect(clippy::expect_used, reason = "the texts are compiled in, and a test parses them")]
    pub fn grammar(self) -> Grammar {
        let (text, file) = match self {
            Self::English => (include_str!("../en.toml"), "config/language/en.toml"),
            Self::German => (include_str!("../de.toml"), "config/language/de.toml"),
        };
        Grammar::parse(text, Path::new(file)).expect("the built-in languages are sound")
    }
}

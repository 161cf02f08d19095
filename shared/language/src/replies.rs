use serde::Deserialize;

/// What the robot says about the conversation itself, in the language of the file.
///
/// `{task}`, `{text}`, `{sentence}` and `{question}` stand for what they name; see [`fill`].
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub struct Replies {
    /// To a sentence that is not understood: asks back with `{sentence}`.
    pub did_you_mean: String,
    /// To a greeting.
    pub hello: String,
    /// To a farewell.
    pub goodbye: String,
    /// To thanks.
    pub welcome: String,
    /// To praise.
    pub praised: String,
    /// Help before anything was taught.
    pub help_first: String,
    /// Help once a `{task}` is known.
    pub help_known: String,
    /// Help while a `{task}` is being shown.
    pub help_showing: String,
    /// Help while the robot does a `{task}`.
    pub help_moving: String,
    /// Help while the robot waits for the answer to its `{question}`.
    pub help_asked: String,
}

/// A reply with a value in place of `{key}`.
///
/// ```
/// assert_eq!(language::fill("Do {task}", "task", "filling"), "Do filling");
/// ```
#[must_use]
pub fn fill(reply: &str, key: &str, value: &str) -> String {
    reply.replace(&format!("{{{key}}}"), value)
}

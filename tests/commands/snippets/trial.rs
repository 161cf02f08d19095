//! How a command line is tried.

#[derive(Debug)]
pub(super) enum Trial {
    /// It ends with success, and writes nothing to standard error.
    Ends,
    /// It ends with success, and says these words.
    Says(&'static str),
    /// It is refused by one line on standard error, with these words.
    Fails(&'static str),
    /// It says these words, and runs in a terminal of its own until the document ends.
    Stays(&'static str),
    /// It says these words. Then Ctrl-C ends it.
    Interrupted(&'static str),
    /// It is only parsed, for this reason.
    NotRun(&'static str),
}

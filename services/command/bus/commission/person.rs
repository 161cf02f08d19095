//! What only a person can do, and says that it is done.

use super::super::output;
use super::Failed;

/// The person who runs the trials.
#[derive(Clone, Copy, Debug)]
pub(super) struct Person;

/// What a person says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    Done,
    Skip,
}

impl Person {
    /// Asks for something, and waits until the person says that it is done or is to be left out.
    pub(super) fn ask(self, what: &str) -> Result<Reply, Failed> {
        output::print(&format!("  {what}.\n  Enter when that is so, or `skip`: "))?;
        let said = output::answer()?.ok_or_else(|| {
            Failed::usage("no answer comes on standard input: --yes runs the trials that need no person")
        })?;
        Ok(if said.trim().eq_ignore_ascii_case("skip") { Reply::Skip } else { Reply::Done })
    }
}

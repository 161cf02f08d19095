//! Instructions that only a person can carry out.

use crate::failure::CommandError;
use crate::output;

/// The person who runs the trials.
#[derive(Clone, Copy, Debug)]
pub(super) struct Person;

/// A person's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reply {
    Done,
    Skip,
}

impl Person {
    /// Prints an instruction, and waits until the person confirms or skips it.
    pub(super) fn ask(self, what: &str) -> Result<Reply, CommandError> {
        output::print(&format!("  {what}.\n  Enter when that is so, or `skip`: "))?;
        let said = output::answer()?.ok_or_else(|| {
            CommandError::usage(
                "no answer comes on standard input: --yes runs the trials that need no person",
            )
        })?;
        Ok(if said.trim().eq_ignore_ascii_case("skip") { Reply::Skip } else { Reply::Done })
    }
}

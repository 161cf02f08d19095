//! Printing of the commands' results.

use std::fs;
use std::io::{IsTerminal as _, Write as _};
use std::path::Path;

use budget::Lines;
use clap::Args;
use config::Names;
use folder::{Existing, Output};
use reports::lesson::LessonReport;

use crate::failure::CommandError;

/// What every command that writes a file says of an existing one.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Force {
    /// Replace an existing file
    #[arg(long, visible_alias = "overwrite")]
    force: bool,
}

impl Force {
    /// An output file named by the user. An existing file that is to be kept is refused at once, before anything is
    /// computed for it; creating it checks again, without a gap.
    pub(crate) fn named(self, file: &Path) -> Result<Output, CommandError> {
        let output = self.unchecked(file);
        output
            .check()
            .map_err(|error| CommandError::usage(format!("cannot write {}: {error}", file.display())))?;
        Ok(output)
    }

    /// As [`Self::named`], and refuses a file that the command reads: it would be lost.
    pub(crate) fn named_unless_read<'a>(
        self,
        file: &Path,
        inputs: impl IntoIterator<Item = &'a Path>,
    ) -> Result<Output, CommandError> {
        if let Ok(to) = fs::canonicalize(file)
            && inputs.into_iter().any(|input| fs::canonicalize(input).is_ok_and(|input| input == to))
        {
            return Err(CommandError::usage(format!(
                "{} is read by this command, and would be written over: name another file",
                file.display()
            )));
        }
        self.named(file)
    }

    /// The same, checked only when it is created.
    pub(crate) fn unchecked(self, file: &Path) -> Output {
        Output::named(file, if self.force { Existing::Replace } else { Existing::Keep })
    }

    /// As [`Self::named`], for a file that may not be asked for.
    pub(crate) fn named_if(self, file: Option<&Path>) -> Result<Option<Output>, CommandError> {
        file.map(|file| self.named(file)).transpose()
    }
}

/// Prints a text beside output files: on standard error if one of them is standard output.
pub(crate) fn print_beside(outputs: &[Output], text: &str) -> Result<(), CommandError> {
    if outputs.iter().any(Output::is_standard_output) {
        // The file is complete; a closed standard error changes nothing.
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
        return Ok(());
    }
    print(text)
}

/// The name and version of this program, as written into recordings.
pub(crate) fn program() -> String {
    format!("leo {}", env!("CARGO_PKG_VERSION"))
}

/// Maximum length of an answer on standard input, in bytes.
const ANSWER_BYTES: usize = 4 << 10;

/// A line of standard input; `None` at its end.
pub(crate) fn answer() -> Result<Option<String>, CommandError> {
    let mut lines = Lines::new(std::io::stdin().lock(), "answer", ANSWER_BYTES);
    let line = lines
        .next_line()
        .map_err(|error| CommandError::runtime(format!("cannot read standard input: {error}")))?;
    Ok(line.map(|line| String::from_utf8_lossy(line).into_owned()))
}

/// Asks for confirmation on a terminal; without one `--yes` is required.
pub(crate) fn confirm(yes: bool, what: &str) -> Result<(), CommandError> {
    if yes {
        return Ok(());
    }
    if !std::io::stdin().is_terminal() {
        return Err(CommandError::usage(format!("{what}: confirm with --yes, or in a terminal")));
    }
    print(&format!("{what}. Continue? [y/N] "))?;
    let answer = answer()?.unwrap_or_default();
    if answer.trim().eq_ignore_ascii_case("y") {
        Ok(())
    } else {
        Err(CommandError::runtime("nothing was changed"))
    }
}

/// The end of the report of `leo teach`.
const NOT_KEPT: &str = "\nNothing of this is kept: `leo run --lesson FILE` keeps what Leo learns.\n";

/// Prints what Leo learned in each lesson: its file, its title and the report.
pub(crate) fn print_reports(
    outputs: &[Output],
    reports: &[(String, String, LessonReport)],
    names: &Names,
    json: bool,
) -> Result<(), CommandError> {
    let mut text = String::new();
    if json {
        let lessons: Vec<serde_json::Value> = reports
            .iter()
            .map(|(file, title, report)| serde_json::json!({ "lesson": file, "title": title, "report": report }))
            .collect();
        text = to_json(&lessons)?;
    } else {
        for (file, title, report) in reports {
            text += &format!("{title} ({file})\n\n{}", report.to_text(names));
        }
        text += NOT_KEPT;
    }
    print_beside(outputs, &text)
}

/// Prints one JSON document.
pub(crate) fn print_json(value: &(impl serde::Serialize + ?Sized)) -> Result<(), CommandError> {
    print(&to_json(value)?)
}

/// One JSON document as text.
pub(crate) fn to_json(value: &(impl serde::Serialize + ?Sized)) -> Result<String, CommandError> {
    let text = serde_json::to_string_pretty(value).map_err(CommandError::runtime)?;
    Ok(text + "\n")
}

/// Prints text as it is.
pub(crate) fn print(text: &str) -> Result<(), CommandError> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|error| CommandError::output(&error))
}

//! Printing of the commands' results.

use std::io::{IsTerminal as _, Write as _};
use std::path::Path;

use budget::Lines;
use config::Names;
use folder::{Existing, Output};
use reports::lesson::LessonReport;

use crate::failure::CommandError;

/// An output file named by the user; an existing one is replaced only with `overwrite`.
pub(crate) fn named(file: &Path, overwrite: bool) -> Output {
    Output::named(file, if overwrite { Existing::Replace } else { Existing::Keep })
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

/// Prints what Leo learned in each lesson: its file, its title and the report.
pub(crate) fn print_reports(
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
    }
    print(&text)
}

/// Prints one JSON document.
pub(crate) fn print_json(value: &(impl serde::Serialize + ?Sized)) -> Result<(), CommandError> {
    print(&to_json(value)?)
}

fn to_json(value: &(impl serde::Serialize + ?Sized)) -> Result<String, CommandError> {
    let text = serde_json::to_string_pretty(value).map_err(CommandError::runtime)?;
    Ok(text + "\n")
}

/// Prints text as it is.
pub(crate) fn print(text: &str) -> Result<(), CommandError> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|error| CommandError::runtime(format!("cannot write to standard output: {error}")))
}

//! Errors of the command line, in the form of all others.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Command;
use clap::error::ErrorKind;

use crate::failure::CommandError;

/// What clap says of a command line: help and version are printed, an error becomes one line.
pub(crate) fn refuse(
    error: &clap::Error,
    leo: &Command,
    words: &[OsString],
) -> Result<ExitCode, CommandError> {
    if !error.use_stderr() || error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        // A closed standard output changes nothing.
        let _ = error.print();
        return Ok(ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2)));
    }
    Err(CommandError::usage(one_line(&error.render().to_string(), &asked(leo, words))))
}

/// The command that was asked for, with its subcommands.
fn asked(leo: &Command, words: &[OsString]) -> String {
    let mut command = leo;
    let mut name = "leo".to_owned();
    for word in words.iter().skip(1).filter_map(|word| word.to_str()) {
        if let Some(next) = command.find_subcommand(word) {
            command = next;
            name = format!("{name} {}", next.get_name());
        }
    }
    name
}

/// The error on one line: what is wrong, tips, the usage, and where the help is.
fn one_line(rendered: &str, command: &str) -> String {
    let mut text = String::new();
    for line in rendered.lines().map(str::trim) {
        let (join, words) = match line {
            "" => continue,
            line if line.starts_with("For more information") => continue,
            line => {
                match (line.strip_prefix("error: "), line.strip_prefix("tip: "), line.strip_prefix("Usage: "))
                {
                    (Some(words), _, _) => ("", words.to_owned()),
                    (_, Some(words), _) => ("; ", words.to_owned()),
                    (_, _, Some(words)) => ("; usage: ", words.to_owned()),
                    (None, None, None) => (" ", line.to_owned()),
                }
            }
        };
        text = if text.is_empty() { words } else { text + join + &words };
    }
    format!("{text}; `{command} --help` says more")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(words: &[&str]) -> String {
        let words: Vec<OsString> = words.iter().map(OsString::from).collect();
        let error = crate::command().try_get_matches_from(&words).unwrap_err();
        refuse(&error, &crate::command(), &words).unwrap_err().text
    }

    #[test]
    fn an_error_of_usage_is_one_line_with_a_remedy() {
        for (words, facts) in [
            (&["leo", "teach"][..], &["<LESSON>", "usage: leo teach", "`leo teach --help`"][..]),
            (&["leo", "tech"], &["'tech'", "'teach'", "`leo --help`"]),
            (&["leo", "bus", "read", "--nonsense"], &["'--nonsense'", "`leo bus read --help`"]),
            (
                &["leo", "believe", "a", "--every", "0"],
                &["'0'", "--every", "above 0", "`leo believe --help`"],
            ),
            (&["leo", "check", "--apply", "--json"], &["--apply", "--json", "cannot be used with"]),
            (&["leo", "teach", "a", "--perspective", "dog"], &["'dog'", "human, robot"]),
        ] {
            let said = said(words);
            assert!(!said.contains('\n') && !said.contains("error:"), "{said}");
            for fact in facts {
                assert!(said.contains(fact), "{fact} is not in {said}");
            }
        }
    }

    #[test]
    fn help_is_no_error() {
        for word in ["--help", "--version"] {
            let words: Vec<OsString> = ["leo", word].iter().map(OsString::from).collect();
            let error = crate::command().try_get_matches_from(&words).unwrap_err();
            assert!(refuse(&error, &crate::command(), &words).is_ok(), "{word}");
        }
    }
}

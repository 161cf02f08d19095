//! The commands of a line, split as a shell splits them.

use std::process::Command;

/// The words of each simple command: those between pipes, separators and brackets, without redirections.
fn simple_commands(text: &str) -> Vec<Vec<String>> {
    let mut commands = vec![Vec::new()];
    let (mut word, mut quote) = (None::<String>, None::<char>);
    for letter in text.chars().chain(['\n']) {
        if let Some(open) = quote {
            if letter == open {
                quote = None;
            } else {
                word.get_or_insert_default().push(letter);
            }
            continue;
        }
        let is_redirection = matches!(letter, '<' | '>');
        let ends_command = matches!(letter, '|' | '&' | ';' | '(' | ')' | '\n');
        if !letter.is_whitespace() && !is_redirection && !ends_command {
            let text = word.get_or_insert_default();
            if matches!(letter, '"' | '\'') {
                quote = Some(letter);
            } else {
                text.push(letter);
            }
            continue;
        }
        if let (Some(word), Some(command)) = (word.take(), commands.last_mut()) {
            command.push(word);
        }
        if is_redirection && let Some(command) = commands.last_mut() {
            command.push(letter.to_string());
        }
        if ends_command {
            commands.push(Vec::new());
        }
    }
    commands.into_iter().map(without_redirections).filter(|command| !command.is_empty()).collect()
}

fn without_redirections(words: Vec<String>) -> Vec<String> {
    let mut words = words.into_iter();
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        if matches!(word.as_str(), "<" | ">") {
            let _file = words.next();
        } else {
            kept.push(word);
        }
    }
    kept
}

/// Whether a word, or a line, sets a variable.
pub(super) fn is_assignment(word: &str) -> bool {
    let is_name = |name: &str| {
        !name.is_empty() && name.chars().all(|letter| letter.is_ascii_uppercase() || letter == '_')
    };
    !word.contains(' ') && word.split_once('=').is_some_and(|(name, _)| is_name(name))
}

/// The command without what stands before its program: variables, `sudo` and its user, and the begin of a loop.
fn program(command: &[String]) -> &[String] {
    let mut words = command;
    loop {
        words = match words {
            [first, rest @ ..] if is_assignment(first) || first == "sudo" || first == "do" => rest,
            [first, _user, rest @ ..] if first == "-u" => rest,
            _ => return words,
        };
    }
}

/// The command lines of `leo` in a text of the shell.
pub(super) fn leo_commands(text: &str) -> Vec<Vec<String>> {
    let commands = simple_commands(text);
    let programs = commands.iter().map(|command| program(command).to_vec());
    programs.filter(|words| words.first().is_some_and(|word| word == "leo")).collect()
}

/// Says what a shell cannot parse in a text. Runs nothing.
pub(super) fn syntax_error(text: &str) -> Option<String> {
    let output = Command::new("sh").args(["-n", "-c", text]).output().expect("a shell");
    (!output.status.success()).then(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_command_of_leo_is_found_wherever_it_stands() {
    for (text, expected) in [
        ("sudo -u leo leo emergency-stop --release", &["leo|emergency-stop|--release"][..]),
        ("python3 a.py < b.csv | leo believe -", &["leo|believe|-"]),
        ("A=$(mktemp -d) leo tasks export > learned.json", &["leo|tasks|export"]),
        ("for a in b; do\nleo teach $a\ndone", &["leo|teach|$a"]),
        ("leo run --set 'belief.names=[\"Ann\"]'", &["leo|run|--set|belief.names=[\"Ann\"]"]),
        ("leo check && leo top", &["leo|check", "leo|top"]),
        ("journalctl -u leo -f", &[]),
        ("sudo systemctl stop leo", &[]),
    ] {
        let found: Vec<String> = leo_commands(text).iter().map(|words| words.join("|")).collect();
        assert_eq!(found, expected, "{text}");
    }
    assert!(syntax_error("for a in b; do").is_some());
    assert!(is_assignment("NECK=/tmp/bus") && !is_assignment("sed s/a=b/"));
}

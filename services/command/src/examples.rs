//! The examples in the help of subcommands. A command without subcommands has its own beside its options.

use clap::Command;

/// The path of a subcommand, and command lines.
const EXAMPLES: [(&str, &str, &[&str]); 14] = [
    ("tasks", "list", &["leo tasks list --json"]),
    ("tasks", "show", &["leo tasks show \"task 1\""]),
    ("tasks", "forget", &["leo tasks forget \"task 1\""]),
    ("tasks", "export", &["leo tasks export > learned.json", "leo tasks export \"task 1\" > task1.json"]),
    ("tasks", "import", &["leo tasks import task1.json --replace"]),
    ("bus", "scan", &["leo bus scan", "leo bus scan --device /dev/ttyUSB0 --baud 1000000"]),
    (
        "bus",
        "read",
        &[
            "leo bus read neck_yaw_joint present_position",
            "leo bus read --id 7 --bus torso present_temperature",
        ],
    ),
    (
        "bus",
        "write",
        &[
            "leo bus write neck_yaw_joint goal_position 10deg",
            "leo bus write neck_yaw_joint led 1 --raw --yes",
        ],
    ),
    ("bus", "torque", &["leo bus torque on neck_yaw_joint", "leo bus torque off"]),
    ("bus", "reboot", &["leo bus reboot neck_yaw_joint"]),
    ("bus", "monitor", &["leo bus monitor neck_yaw_joint", "leo bus monitor --once"]),
    ("bus", "set-id", &["leo bus set-id --device /dev/ttyUSB0 --id 1 --to 7"]),
    ("bus", "commission", &["leo bus commission --bus torso --report reports"]),
    ("bus", "set-baud", &["leo bus set-baud neck_yaw_joint --to 1000000"]),
];

/// The commands with the examples of their subcommands.
pub(crate) fn add(leo: Command) -> Command {
    EXAMPLES.iter().fold(leo, |leo, (command, subcommand, lines)| {
        let text = lines.iter().fold("Examples:".to_owned(), |text, line| format!("{text}\n  {line}"));
        leo.mut_subcommand(command, |command| {
            command.mut_subcommand(subcommand, |subcommand| subcommand.after_help(text))
        })
    })
}

#[cfg(test)]
mod tests {
    /// All public commands with their help, by path.
    fn helps(command: &mut clap::Command, path: &str, all: &mut Vec<(String, String)>) {
        all.push((path.to_owned(), command.render_long_help().to_string()));
        let public = command.get_subcommands_mut().filter(|command| !command.is_hide_set());
        for subcommand in public.filter(|command| command.get_name() != "help") {
            let path = format!("{path} {}", subcommand.get_name());
            helps(subcommand, &path, all);
        }
    }

    /// The words of a command line up to a redirection, as a shell splits them.
    fn words(line: &str) -> Vec<String> {
        let mut words = vec![String::new()];
        let mut is_quoted = false;
        for letter in line.chars() {
            match letter {
                '"' => is_quoted = !is_quoted,
                ' ' if !is_quoted => words.push(String::new()),
                letter => words.iter_mut().last().unwrap().push(letter),
            }
        }
        words.retain(|word| !word.is_empty());
        words.into_iter().take_while(|word| !matches!(word.as_str(), ">" | "|")).collect()
    }

    #[test]
    fn every_command_has_examples_that_parse() {
        let mut all = Vec::new();
        let mut leo = crate::command();
        leo.build();
        helps(&mut leo, "leo", &mut all);
        assert!(all.len() >= 27, "{}", all.len());
        let mut parsed = 0;
        for (path, help) in &all {
            let (_, examples) = help.split_once("Examples:\n").unwrap_or_else(|| panic!("{path}: {help}"));
            let lines: Vec<&str> = examples.lines().take_while(|line| line.starts_with("  leo ")).collect();
            assert!(!lines.is_empty(), "{path}: {help}");
            let mut is_shown = false;
            for line in lines {
                let words = words(line.trim());
                is_shown |= words.join(" ").starts_with(path);
                if let Err(error) = crate::command().try_get_matches_from(&words) {
                    panic!("{line}: {error}");
                }
                parsed += 1;
            }
            assert!(is_shown, "{path}: {help}");
        }
        assert!(parsed >= all.len(), "{parsed}");
    }

    #[test]
    fn every_command_that_reads_a_configuration_sets_values() {
        let mut leo = crate::command();
        leo.build();
        let mut all = Vec::new();
        helps(&mut leo, "leo", &mut all);
        let mut seen = 0;
        for (path, help) in all.iter().filter(|(_, help)| help.contains("--config <FILE>")) {
            assert!(help.contains("--set <KEY=VALUE>"), "{path}: {help}");
            seen += 1;
        }
        assert!(seen >= 14, "{seen}");
    }
}

//! `leo tasks`: lists, shows, exports, imports and forgets learned tasks.

use std::fs::File;
use std::io::stdin;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use ::tasks::{Settings, Task, key, listed};
use clap::{Args, Subcommand};
use config::Robot;
use learner_process::{Memory, OpenError, Vocabulary, learning, open_question, replay_events};
use quantity::number::{counted, saturating_u32};
use reports::lesson::LessonReport;
use reports::text_table::{Align, TextTable};
use serde::{Deserialize, Serialize};

use crate::configuration::GlobalSetValues;
use crate::failure::CommandError;
use crate::{domain, output};

/// The version of the exported format that this program writes and reads.
const FORMAT: u32 = 1;
/// Maximum size of a file of exported tasks, in bytes.
const EXPORTED_BYTES: u64 = 256 << 20;

/// What to do with what was learned.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo tasks list\n  leo tasks show \"task 1\"\n  leo tasks export > learned.json"
)]
pub(crate) struct Tasks {
    #[command(subcommand)]
    what: What,
    /// The robot's leo.toml, for the names of its percepts [default: built in]
    #[arg(long, value_name = "FILE", global = true)]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: GlobalSetValues,
    /// The state directory [default: $XDG_STATE_HOME/leo or ~/.local/state/leo]
    #[arg(long, value_name = "DIRECTORY", global = true)]
    state: Option<PathBuf>,
}

#[derive(Clone, Debug, Subcommand)]
enum What {
    /// List the tasks: name, examples, rule
    List {
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Show a task: the hypotheses of each perspective, the rule, and the explanation
    Show {
        /// The task
        name: String,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Forget a task and all its examples
    Forget {
        /// The task
        name: String,
    },
    /// Print tasks with all their examples as one JSON document, to be imported elsewhere
    Export {
        /// The tasks [default: all]
        names: Vec<String>,
    },
    /// Import exported tasks: all of them or, if a task is known already, none
    Import {
        /// The file; `-` is standard input
        file: PathBuf,
        /// Replace known tasks of the same names
        #[arg(long)]
        replace: bool,
    },
}

/// The exported document.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Exported {
    leo_tasks: u32,
    tasks: Vec<Task>,
}

/// A task with its results.
#[derive(Debug, Serialize)]
struct TaskReport {
    report: LessonReport,
    /// Leo's question, if the examples are ambiguous.
    question: Option<String>,
}

/// A row of the list.
#[derive(Debug, Serialize)]
struct TaskSummary {
    name: String,
    examples: usize,
    rule: Option<String>,
}

impl What {
    /// Whether it modifies the memory.
    fn writes(&self) -> bool {
        match self {
            Self::Forget { .. } | Self::Import { .. } => true,
            Self::List { .. } | Self::Show { .. } | Self::Export { .. } => false,
        }
    }
}

impl Tasks {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        // An invalid configuration is refused before anything is done.
        let robot = self.robot()?;
        let state = self.state_directory()?;
        if self.what.writes() {
            process::state::prepare(&state).map_err(CommandError::usage)?;
        }
        let mut memory = OpenMemory::open(&state)?;
        match &self.what {
            What::List { json } => self.list(&memory, &robot, *json)?,
            What::Show { name, json } => {
                let task = memory.task(name)?;
                let (report, question) = (report(task, &robot)?, question(task, &robot)?);
                if *json {
                    output::print_json(&TaskReport { report, question })?;
                } else {
                    let asks = question.map(|text| format!("  Leo would ask: {text}\n")).unwrap_or_default();
                    output::print(&(report.to_text(&robot.leo.belief.names) + &asks))?;
                }
            }
            What::Forget { name } => {
                let task = memory.task(name)?.clone();
                if !memory.memory.forget(name).map_err(CommandError::usage)? {
                    return Err(CommandError::runtime(format!(
                        "another command has just forgotten \"{}\"",
                        task.name
                    )));
                }
                output::print(&format!("forgot {} and its {}\n", task.name, examples(task.examples.len())))?;
            }
            What::Export { names } => {
                let tasks = if names.is_empty() {
                    memory.tasks
                } else {
                    names.iter().map(|name| memory.task(name).cloned()).collect::<Result<_, _>>()?
                };
                output::print_json(&Exported { leo_tasks: FORMAT, tasks })?;
            }
            What::Import { file, replace } => {
                let names = memory.import(file, *replace)?;
                output::print(&format!("learned {}\n", listed(&names)))?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }

    /// The state directory. One that is named and does not exist is probably misspelt; only an import may begin one.
    fn state_directory(&self) -> Result<PathBuf, CommandError> {
        let Some(state) = &self.state else { return domain::state_directory() };
        if state.exists() || matches!(self.what, What::Import { .. }) {
            return Ok(state.clone());
        }
        Err(CommandError::usage(format!(
            "--state {}: there is no such directory; name that of the robot: $XDG_STATE_HOME/leo, or ~/.local/state/leo",
            state.display()
        )))
    }

    fn robot(&self) -> Result<Robot, CommandError> {
        self.set.robot(self.config.as_deref())
    }

    fn list(&self, memory: &OpenMemory, robot: &Robot, json: bool) -> Result<(), CommandError> {
        let known = memory.tasks.iter().map(|task| {
            let report = report(task, robot)?;
            let rule = report.tasks.first().and_then(|task| task.rule.as_ref()).map(|rule| rule.name.clone());
            Ok(TaskSummary { name: task.name.clone(), examples: task.examples.len(), rule })
        });
        let known: Vec<TaskSummary> = known.collect::<Result<_, CommandError>>()?;
        if json {
            return output::print_json(&known);
        }
        if known.is_empty() {
            return output::print("Leo has learned nothing yet\n");
        }
        let columns = [("task", Align::Left), ("examples", Align::Right), ("rule", Align::Left)];
        let mut table = TextTable::new(&columns);
        for TaskSummary { name, examples, rule } in &known {
            table.add([name, &examples.to_string(), rule.as_deref().unwrap_or("no rule")]);
        }
        output::print(&table.to_text())
    }
}

fn examples(count: usize) -> String {
    counted(saturating_u32(count), "example")
}

fn report(task: &Task, robot: &Robot) -> Result<LessonReport, CommandError> {
    let (vocabulary, settings) = learned_with(robot)?;
    let mut report = LessonReport::default();
    replay_events(&vocabulary.language, task, &settings).iter().for_each(|event| report.add(event));
    Ok(report)
}

fn question(task: &Task, robot: &Robot) -> Result<Option<String>, CommandError> {
    let (vocabulary, settings) = learned_with(robot)?;
    Ok(open_question(&vocabulary.language, task, &settings))
}

/// What the robot's learner works with.
fn learned_with(robot: &Robot) -> Result<(Vocabulary, Settings), CommandError> {
    let vocabulary = Vocabulary::of(&robot.percepts).map_err(CommandError::usage)?;
    Ok((vocabulary, learning(&robot.leo.learner)))
}

/// The opened memory.
struct OpenMemory {
    memory: Memory,
    tasks: Vec<Task>,
}

impl OpenMemory {
    fn open(state: &Path) -> Result<Self, CommandError> {
        let mut memory = Memory::open(&process::state::learned(state)).map_err(|error| {
            let is_in_use = matches!(error, OpenError::InUse { .. });
            if is_in_use { CommandError::runtime(error) } else { CommandError::usage(error) }
        })?;
        let tasks = memory.tasks().map_err(CommandError::runtime)?;
        Ok(Self { memory, tasks })
    }

    fn task(&self, name: &str) -> Result<&Task, CommandError> {
        self.tasks.iter().find(|task| key(&task.name) == key(name)).ok_or_else(|| {
            let known: Vec<String> = self.tasks.iter().map(|task| task.name.clone()).collect();
            let known = if known.is_empty() { "nothing yet".to_owned() } else { listed(&known) };
            CommandError::usage(format!("Leo has not learned \"{name}\"; it knows {known}"))
        })
    }

    /// Imports all tasks of a file or none; returns their names.
    fn import(&mut self, file: &Path, replace: bool) -> Result<Vec<String>, CommandError> {
        let at = file.display();
        let text = if file == Path::new("-") {
            budget::read_text(stdin().lock(), "exported tasks", EXPORTED_BYTES)
        } else {
            File::open(file).and_then(|file| budget::read_text(file, "exported tasks", EXPORTED_BYTES))
        };
        let text = text.map_err(|error| CommandError::usage(format!("cannot read {at}: {error}")))?;
        let exported: Exported =
            serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|error| {
                let said = error.to_string();
                let said = said.rsplit_once(" at line ").map_or(said.as_str(), |(said, _)| said);
                let (line, column) = (error.line(), error.column().max(1));
                CommandError::usage(format!("{at}:{line}:{column}: {}", config::suggest(said)))
            })?;
        if exported.leo_tasks != FORMAT {
            let found = exported.leo_tasks;
            return Err(CommandError::usage(format!(
                "{at} is of version {found} of the format, and this program knows {FORMAT}: use a newer one"
            )));
        }
        if exported.tasks.is_empty() {
            return Err(CommandError::usage(format!("{at}: there are no tasks in it")));
        }
        let known = exported.tasks.iter().find(|task| self.task(&task.name).is_ok());
        if let Some(known) = known.filter(|_| !replace) {
            return Err(CommandError::usage(format!(
                "Leo knows \"{}\" already, and imported nothing: forget it first, or use --replace",
                known.name
            )));
        }
        let keys: Vec<String> = exported.tasks.iter().map(|task| key(&task.name)).collect();
        if let Some(nameless) = keys.iter().position(String::is_empty) {
            return Err(CommandError::usage(format!("{at}: task {} has no name", nameless + 1)));
        }
        let twice =
            keys.iter().enumerate().find(|(index, key)| keys.iter().take(*index).any(|other| other == *key));
        if let Some((index, _)) = twice {
            return Err(CommandError::usage(format!(
                "{at}: task {} has the name of an earlier task; nothing was imported",
                index + 1
            )));
        }
        self.memory.replace(&exported.tasks).map_err(CommandError::usage)?;
        Ok(exported.tasks.iter().map(|task| task.name.clone()).collect())
    }
}

//! `leo study`: the paper's study over the real processes.

mod sweep;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use config::lesson::{Lesson, STUDY};
use config::{Files, Robot};
use quantity::number::saturating_u64;
use reports::lesson::LessonReport;
use study::{Cell, Comparison, robot::CELLS};
use supervisor_process::LessonOptions;

use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::preflight::{check_can_teach, simulator_source};
use crate::progress::Progress;
use crate::{configuration, domain, output};
use sweep::Sweep;

/// What is played, and how it is told.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo study --json\n  leo study --sweep 20\n\nThe exit status is 1 when a cell of Table 2 differs."
)]
pub(crate) struct Study {
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Instead, teach this number of random designs of each task in one process, with more noise, other
    /// cones and other thresholds, and print which settings fail
    #[arg(long, value_name = "DESIGNS", num_args = 0..=1, default_missing_value = "200",
        value_parser = clap::value_parser!(u64).range(1..))]
    sweep: Option<u64>,
    /// The robot's leo.toml [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
}

impl Study {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let files = self.set.files(self.config.as_deref())?;
        let robot = configuration::robot(&files)?;
        check_can_teach(&robot, self.config.as_deref())?;
        if let Some(designs) = self.sweep {
            let sweep = Sweep::of(&robot, simulator_source(&robot)?, designs)?;
            if self.json {
                output::print_json(&sweep)?;
            } else {
                output::print(&sweep.to_string())?;
            }
            return Ok(ExitCode::from(u8::from(!sweep.holds())));
        }
        // The processes read their lesson from a file.
        let folder =
            tempfile::Builder::new().prefix("leo-study-").tempdir().map_err(CommandError::runtime)?;
        let mut cells = Vec::new();
        let progress = Progress::of_steps(saturating_u64(CELLS.len()));
        for expected in CELLS {
            let (task, taking) = (expected.task, expected.perspective_taking);
            let text = usize::try_from(task).ok().and_then(|task| STUDY.get(task.checked_sub(1)?));
            let text =
                text.ok_or_else(|| CommandError::runtime(format!("there is no lesson of task {task}")))?;
            let file = folder.path().join(format!("task{task}.toml"));
            std::fs::write(&file, text).map_err(|error| {
                CommandError::runtime(format!("cannot write {}: {error}", file.display()))
            })?;
            let how = if taking { "with" } else { "without" };
            progress.say(format!("task {task} {how} perspective taking"));
            cells.push(Cell::of(expected, &self.play((&robot, &files), &file, taking)?));
            progress.step();
        }
        drop(progress);
        let comparison = Comparison::of(cells);
        if self.json {
            output::print_json(&comparison)?;
        } else {
            output::print(&comparison.to_string())?;
        }
        Ok(ExitCode::from(u8::from(!comparison.holds())))
    }

    fn play(
        &self,
        (robot, files): (&Robot, &Files),
        file: &Path,
        perspective_taking: bool,
    ) -> Result<LessonReport, CommandError> {
        let lesson = Lesson::load(file).map_err(CommandError::runtime)?;
        let teaching = LessonOptions {
            domain: domain::own()?,
            settings: robot.leo.clone(),
            files: files.clone(),
            lesson: file.to_owned(),
            performances: lesson.performances(),
            partners: Some(u32::from(perspective_taking)),
            record: None,
        };
        supervisor_process::teach(&teaching).map_err(CommandError::runtime)
    }
}

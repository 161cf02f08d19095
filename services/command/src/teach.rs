//! `leo teach`: plays lessons in lockstep time.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use config::Files;
use config::lesson::Lesson;
use folder::Output;
use recording::{Subject, Time, robot_pose};
use supervisor_process::{LessonOptions, Record};

use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::output::Force;
use crate::preflight::{check_can_teach, warn_missing_needs};
use crate::{configuration, domain, output};

#[derive(Args, Clone, Debug)]
#[command(after_help = "Examples:\n  leo teach config/lessons/task1.toml --perspective robot --json\n  \
                  leo teach config/lessons/task1.toml --record task1.mcap\n\nEach lesson begins without knowledge, and \
                  nothing that Leo learns is kept: `leo run --lesson FILE` keeps it, and `leo tasks` shows it.")]
pub(crate) struct Teach {
    /// The lessons, one after the other
    #[arg(required = true, value_name = "LESSON")]
    lessons: Vec<PathBuf>,
    /// Whose perspectives to take: `human,robot` or `robot` [default: as configured]
    #[arg(long, value_name = "WHOSE", value_delimiter = ',')]
    perspective: Vec<Whose>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Record the lesson for `leo replay` and for viewers; takes one lesson only
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
    /// The robot's leo.toml [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Whose {
    Human,
    Robot,
}

impl Teach {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let files = self.set.files(self.config.as_deref())?;
        let robot = configuration::robot(&files)?;
        check_can_teach(&robot, self.config.as_deref())?;
        let partners = match self.perspective.as_slice() {
            [] => None,
            whose if !whose.contains(&Whose::Robot) => {
                return Err(CommandError::usage(
                    "--perspective human: the robot's own perspective cannot be left out, because all others are \
                     derived from it; use `--perspective human,robot`",
                ));
            }
            whose => Some(u32::from(whose.contains(&Whose::Human))),
        };
        if self.record.is_some() && self.lessons.len() > 1 {
            return Err(CommandError::usage(
                "--record takes one lesson: teach the lessons one by one, each with its own file",
            ));
        }
        let mut lessons = Vec::new();
        for file in &self.lessons {
            let lesson = Lesson::load(file).map_err(CommandError::usage)?;
            warn_missing_needs(file, &lesson, &robot.leo);
            lessons.push((file, lesson));
        }
        let mut reports = Vec::new();
        let outputs = Vec::from_iter(self.output()?);
        for (file, lesson) in lessons {
            let teaching = LessonOptions {
                domain: domain::own()?,
                settings: robot.leo.clone(),
                files: files.clone(),
                lesson: file.clone(),
                performances: lesson.performances(),
                partners,
                record: self.recorded(&files, &lesson, partners)?,
            };
            let report = supervisor_process::teach(&teaching).map_err(CommandError::runtime)?;
            reports.push((file.display().to_string(), lesson.title, report));
        }
        output::print_reports(&outputs, &reports, &robot.leo.belief.names, self.json)?;
        Ok(ExitCode::SUCCESS)
    }

    /// The file of the recording, if requested.
    fn output(&self) -> Result<Option<Output>, CommandError> {
        let configuration = config::read_files(self.config.as_deref());
        let inputs = || self.lessons.iter().chain(&configuration).map(PathBuf::as_path);
        self.record.as_deref().map(|to| self.force.named_unless_read(to, inputs())).transpose()
    }

    /// The recording to make of a lesson, if requested.
    fn recorded(
        &self,
        files: &Files,
        lesson: &Lesson,
        partners: Option<u32>,
    ) -> Result<Option<Record>, CommandError> {
        let Some(output) = self.output()? else { return Ok(None) };
        let x_world_base = robot_pose(lesson);
        let subject = Subject::of(files, Time::Lockstep, partners, x_world_base, &output::program());
        Ok(Some(Record { output, subject: subject.map_err(CommandError::usage)? }))
    }
}

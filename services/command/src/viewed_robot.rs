//! What viewers show of a running robot that its buffers do not contain.

use std::path::PathBuf;

use clap::Args;
use config::lesson::Lesson;
use recording::{Subject, Time, robot_pose};

use crate::configuration::SetValues;
use crate::failure::CommandError;
use crate::output;

/// The configuration and the lesson of a running robot: joint names, colours, the body, and its pose in the room.
#[derive(Args, Clone, Debug)]
pub(crate) struct ViewedRobot {
    /// The leo.toml that the robot runs with, for what viewers show [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// The lesson that it plays, for its pose in the room [default: built in, Task 1 of the study]
    #[arg(long, value_name = "FILE")]
    lesson: Option<PathBuf>,
}

impl ViewedRobot {
    /// The robot that they describe.
    pub(crate) fn subject(&self) -> Result<Subject, CommandError> {
        let lesson = match &self.lesson {
            Some(file) => Lesson::load(file).map_err(CommandError::usage)?,
            None => Lesson::builtin(),
        };
        let files = self.set.files(self.config.as_deref())?;
        Subject::of(&files, Time::Wall, None, robot_pose(&lesson), &output::program())
            .map_err(CommandError::usage)
    }

    /// The files that are read.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let configuration = config::read_files(self.config.as_deref());
        self.lesson.iter().cloned().chain(configuration).collect()
    }
}

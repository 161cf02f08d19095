//! Opens lessons, and answers interactive acts.

use std::path::PathBuf;

use clock::Instant;
use config::lesson::Lesson;
use message::{ActAnswer, TeacherAct, TeacherActKind, Text};

use crate::World;
use crate::interactive::RefusedActError;
use crate::io::saving::{self, LessonSaver};

/// The open lesson, and the saving of recorded lessons.
pub(crate) struct LessonController {
    /// Folder of the saved lessons, if there is a state directory.
    folder: Option<PathBuf>,
    /// The lesson given at launch.
    launched: Lesson,
    lesson: Lesson,
    /// The name of the open lesson; empty for the one given at launch.
    pub(crate) name: Text,
    saving: LessonSaver,
    /// Incarnation of the console that the acts come from.
    incarnation: u64,
    answers: Vec<ActAnswer>,
    /// Maximum number of things, people and occluders in an observation frame.
    room: usize,
}

impl LessonController {
    pub(crate) fn new(lesson: &Lesson, state: Option<PathBuf>, room: usize) -> Self {
        let folder = state.map(|state| process::state::lessons(&state));
        if let Some(folder) = &folder {
            saving::remove_partial_files(folder);
        }
        Self {
            folder,
            launched: lesson.clone(),
            lesson: lesson.clone(),
            name: Text::default(),
            saving: LessonSaver::default(),
            incarnation: 0,
            answers: Vec::new(),
            room,
        }
    }

    /// Sets the console's incarnation of the next acts. If it changed, everything held by the old one is put back.
    pub(crate) fn listen(&mut self, world: &mut World, now: Instant, incarnation: u64) {
        if std::mem::replace(&mut self.incarnation, incarnation) != incarnation {
            world.return_all(now);
        }
    }

    /// Executes an act.
    pub(crate) fn take(&mut self, world: &mut World, now: Instant, act: &TeacherAct) {
        let done = match act.kind() {
            Some(TeacherActKind::Open) => self.open(world, now, act.text),
            Some(TeacherActKind::Play) => {
                self.play(world, now);
                Ok(Some(String::new()))
            }
            Some(TeacherActKind::Save) => self.save(world, now, act),
            _ => world.act(now, act, self.room).map(Some),
        };
        if let Some(done) = done.transpose() {
            self.answer(act.serial, done);
        }
    }

    /// The answers since the last call, including those of acts that took a while.
    pub(crate) fn answers(&mut self) -> Vec<ActAnswer> {
        for (serial, done) in self.saving.done() {
            self.answer(serial, done.map(|file| file.display().to_string()));
        }
        std::mem::take(&mut self.answers)
    }

    fn answer(&mut self, serial: u64, done: Result<String, RefusedActError>) {
        let refused = done.is_err().into();
        let text = Text::new(&done.unwrap_or_else(|refusal| refusal.0));
        self.answers.push(ActAnswer { serial, refused, text });
    }

    fn open(
        &mut self,
        world: &mut World,
        now: Instant,
        name: Text,
    ) -> Result<Option<String>, RefusedActError> {
        let lesson = if name.as_str().is_empty() {
            self.launched.clone()
        } else {
            let folder = self.folder.clone().unwrap_or_default();
            Lesson::named(name.as_str(), &folder).map_err(|error| RefusedActError(error.to_string()))?
        };
        if max_objects(&lesson) > self.room {
            return Err(RefusedActError(format!(
                "the lesson has {} things and people, but `buffers.max_objects` in leo.toml has room for {}",
                max_objects(&lesson),
                self.room
            )));
        }
        (self.lesson, self.name) = (lesson, name);
        self.play(world, now);
        Ok(Some(String::new()))
    }

    fn play(&self, world: &mut World, now: Instant) {
        *world = World::new(&self.lesson, self.lesson.seed);
        // The table stays empty until then, so that everyone sees that the old objects are gone.
        world.begin(now + self.lesson.table_timing.empty);
    }

    fn save(
        &mut self,
        world: &World,
        now: Instant,
        act: &TeacherAct,
    ) -> Result<Option<String>, RefusedActError> {
        let Some(folder) = self.folder.clone() else {
            return Err(RefusedActError("this robot saves nothing: it has no state directory".to_owned()));
        };
        let lesson = world.taught(act.text.as_str(), now).ok_or_else(|| {
            RefusedActError(
                "nothing was taught by hand yet: set a table, say what you teach, and show it".to_owned(),
            )
        })?;
        self.saving.begin(act.serial, &lesson, folder)?;
        Ok(None)
    }
}

/// The maximum number of things, people and occluders of a table.
fn max_objects(lesson: &Lesson) -> usize {
    let max = lesson.tables().map(|table| table.objects.len() + table.occluders.len()).max().unwrap_or(0);
    max + lesson.teachers.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lesson_that_the_robot_was_started_with_can_be_opened_again() {
        let own = Lesson { title: "My own".to_owned(), ..Lesson::builtin() };
        let mut lesson_controller = LessonController::new(&own, None, 64);
        let mut world = World::new(&own, own.seed);
        for (name, title) in [("task2", None), ("", Some("My own"))] {
            let act = TeacherAct { text: Text::new(name), ..TeacherAct::new(TeacherActKind::Open, 1) };
            lesson_controller.take(&mut world, Instant::EPOCH, &act);
            assert_eq!(lesson_controller.answers().pop().map(|answer| answer.refused), Some(0), "{name}");
            assert_eq!(lesson_controller.name, Text::new(name));
            assert_eq!(world.lesson.title == own.title, title.is_some());
        }
    }
}

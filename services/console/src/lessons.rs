//! The lessons that a page can open, and what is said of the one that is open.

use std::fs;
use std::path::{Path, PathBuf};

use config::lesson::{LIBRARY, Lesson};
use message::{NO_TABLE, SceneHead, SceneMode};
use serde_json::{Value, json};

use crate::cells::numbers;

/// Lessons written down that are listed.
const MOST: usize = 200;

/// The shelf of lessons: those that the program carries, and those that were taught by hand.
pub(crate) struct Shelf {
    folder: Option<PathBuf>,
    launched: Lesson,
    /// The lesson that is open, by its name; empty for the one that the robot was started with.
    open: (String, Lesson),
}

impl Shelf {
    pub(crate) fn new(state: Option<&Path>, launched: &Lesson) -> Self {
        let folder = state.map(process::state::lessons);
        Self { folder, launched: launched.clone(), open: (String::new(), launched.clone()) }
    }

    /// What can be opened. Files that are no lessons are left out.
    pub(crate) fn list(&self) -> Value {
        let entry =
            |id: &str, lesson: &Lesson| json!({ "id": id, "title": lesson.title, "watch": lesson.watch });
        let mut listed: Vec<Value> = LIBRARY
            .iter()
            .filter_map(|(name, text)| Some(entry(name, &Lesson::parse(text, Path::new(name)).ok()?)))
            .collect();
        let written = self.folder.as_deref().and_then(|folder| fs::read_dir(folder).ok());
        let mut files: Vec<PathBuf> =
            written.into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.sort();
        let files = files.iter().filter(|file| file.extension().is_some_and(|extension| extension == "toml"));
        listed.extend(
            files
                .take(MOST)
                .filter_map(|file| Some(entry(file.file_stem()?.to_str()?, &Lesson::load(file).ok()?))),
        );
        listed.into()
    }

    /// What is to be said of the workspace.
    pub(crate) fn workspace(&mut self, head: Option<&SceneHead>, saved: Option<&str>) -> Value {
        if let Some(head) = head
            && head.lesson.as_str() != self.open.0
        {
            let name = head.lesson.as_str();
            let folder = self.folder.clone().unwrap_or_default();
            let lesson = if name.is_empty() {
                self.launched.clone()
            } else {
                Lesson::named(name, &folder).unwrap_or_else(|_| self.launched.clone())
            };
            self.open = (name.to_owned(), lesson);
        }
        let (name, lesson) = &self.open;
        let kinds: Vec<Value> = lesson
            .kinds
            .iter()
            .map(|(name, kind)| {
                json!({
                    "name": name, "role": kind.role.word(), "half": numbers(kind.half_extents_m),
                    "shape": numbers(kind.shape), "hole": kind.hole, "markable": kind.markable,
                })
            })
            .collect();
        let colours: Vec<Value> =
            lesson.colours.iter().map(|(name, rgb)| json!({ "name": name, "rgb": numbers(*rgb) })).collect();
        let people: Vec<u16> = lesson.teachers.iter().map(|teacher| teacher.number).collect();
        let mode = head.map(|head| match head.mode() {
            Some(SceneMode::Script | SceneMode::Over) | None => "script",
            Some(SceneMode::SetUp) => "set-up",
            Some(SceneMode::Teaching) => "teaching",
        });
        json!({
            "simulated": head.is_some(),
            "lesson": name,
            "title": lesson.title,
            "watch": lesson.watch,
            "mode": mode,
            "table": head.map(|head| head.table).filter(|table| *table != NO_TABLE),
            "tables": head.map_or(0, |head| head.tables),
            "steps": head.map_or(0, |head| head.steps),
            "kinds": kinds,
            "colours": colours,
            "people": people,
            "saved": saved,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_whom_a_lesson_has_are_told_whoever_is_there() {
        let lesson = |name: &str| Lesson::named(name, Path::new("")).unwrap();
        let mut shelf = Shelf::new(None, &lesson("task1"));
        assert_eq!(shelf.workspace(None, None)["people"], json!([1]));
        let head = SceneHead { lesson: message::Text::new("two_teachers"), ..SceneHead::default() };
        assert_eq!(shelf.workspace(Some(&head), None)["people"], json!([1, 2]));
    }
}

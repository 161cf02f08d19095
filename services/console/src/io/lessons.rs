//! The list of lessons that a page can open, and the description of the open lesson.

use std::fs;
use std::path::{Path, PathBuf};

use config::leo::Leo;
use config::lesson::{LIBRARY, Lesson};
use invariant::require;
use message::{NO_TABLE, SceneHead, SceneMode};
use serde_json::{Value, json};

use crate::cells::numbers;

/// Maximum number of saved lessons listed.
const MAX_LISTED_LESSONS: usize = 200;

/// The lesson library: the built-in lessons and those saved in the state directory.
pub(crate) struct LessonLibrary {
    settings: Leo,
    folder: Option<PathBuf>,
    launched: Lesson,
    /// The name of the open lesson, and the lesson; the name is empty for the one given at launch.
    open: (String, Lesson),
}

impl LessonLibrary {
    pub(crate) fn new(settings: &Leo, state: Option<&Path>, launched: &Lesson) -> Self {
        let folder = state.map(process::state::lessons);
        Self {
            settings: settings.clone(),
            folder,
            launched: launched.clone(),
            open: (String::new(), launched.clone()),
        }
    }

    /// All lessons that can be opened. The launched lesson is included, under an empty name if it is not in the
    /// library. A file that cannot be loaded is listed with its error.
    pub(crate) fn list(&self) -> Value {
        let entry = |id: &str, lesson: &Lesson| {
            json!({
                "id": id, "title": lesson.title, "watch": lesson.watch,
                "lacks": lesson.needs.lacking(&self.settings),
            })
        };
        let carried = LIBRARY.iter().filter_map(|(name, text)| {
            let lesson = Lesson::parse(text, Path::new(name)).ok();
            Some(((*name).to_owned(), require!(lesson, "the lesson {name} of this program is valid")?))
        });
        let mut lessons: Vec<(String, Lesson)> = carried.collect();
        let mut broken = Vec::new();
        for file in self.files() {
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let loaded = if LIBRARY.iter().any(|(known, _)| *known == name) {
                Err(format!(
                    "the program carries a lesson of the name {name}: give {} another",
                    file.display()
                ))
            } else {
                Lesson::load(&file).map_err(|error| error.to_string())
            };
            match loaded {
                Ok(lesson) => lessons.push((name, lesson)),
                Err(error) => {
                    broken.push(json!({ "id": name, "title": name, "watch": "", "error": error }));
                }
            }
        }
        if lessons.iter().all(|(_, lesson)| *lesson != self.launched) {
            lessons.insert(0, (String::new(), self.launched.clone()));
        }
        lessons.iter().map(|(id, lesson)| entry(id, lesson)).chain(broken).collect()
    }

    /// The lesson files of the folder, sorted by name.
    fn files(&self) -> Vec<PathBuf> {
        let written = self.folder.as_deref().and_then(|folder| fs::read_dir(folder).ok());
        let files = written.into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path()));
        let mut files: Vec<PathBuf> =
            files.filter(|file| file.extension().is_some_and(|extension| extension == "toml")).collect();
        files.sort();
        files.truncate(MAX_LISTED_LESSONS);
        files
    }

    /// Describes the workspace: the open lesson, its mode, kinds, colours and people.
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
            Some(SceneMode::Script) | None => "script",
            Some(SceneMode::Over) => "over",
            Some(SceneMode::SetUp) => "set-up",
            Some(SceneMode::Teaching) => "teaching",
        });
        json!({
            "simulated": head.is_some(),
            "lesson": name,
            "title": lesson.title,
            "watch": lesson.watch,
            "lacks": lesson.needs.lacking(&self.settings),
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

    fn library(state: Option<&Path>, launched: &Lesson) -> LessonLibrary {
        LessonLibrary::new(&config::Robot::load(None).unwrap().leo, state, launched)
    }

    #[test]
    fn missing_settings_of_a_lesson_are_listed() {
        let mut library = library(None, &Lesson::builtin());
        let listed = library.list();
        let lacks = |title: &str| {
            let of = |entry: &&Value| entry["title"].as_str().is_some_and(|whole| whole.starts_with(title));
            listed.as_array().unwrap().iter().find(of).unwrap()["lacks"].clone()
        };
        assert_eq!((lacks("Two teachers"), lacks("Task 1")), (json!("`partners = 2`"), Value::Null));
        let head = SceneHead { lesson: message::Text::new("three_of_them"), ..SceneHead::default() };
        assert_eq!(library.workspace(Some(&head), None)["lacks"], json!("`language = \"extended\"`"));
        library.settings.learner.language = tasks::HypothesisLanguage::Extended;
        assert_eq!(library.workspace(Some(&head), None)["lacks"], Value::Null);
    }

    #[test]
    fn a_lesson_that_has_ended_is_over() {
        let mut library = library(None, &Lesson::builtin());
        let mut mode = |mode: SceneMode| {
            let head = SceneHead { mode: mode.raw(), ..SceneHead::default() };
            library.workspace(Some(&head), None)["mode"].clone()
        };
        assert_eq!((mode(SceneMode::Script), mode(SceneMode::Over)), (json!("script"), json!("over")));
    }

    #[test]
    fn all_people_of_a_lesson_are_listed_whether_present_or_not() {
        let lesson = |name: &str| Lesson::named(name, Path::new("")).unwrap();
        let mut library = library(None, &lesson("task1"));
        assert_eq!(library.workspace(None, None)["people"], json!([1]));
        let head = SceneHead { lesson: message::Text::new("two_teachers"), ..SceneHead::default() };
        assert_eq!(library.workspace(Some(&head), None)["people"], json!([1, 2]));
    }

    #[test]
    fn a_file_that_cannot_be_opened_is_listed_with_the_reason() {
        let state = tempfile::tempdir().unwrap();
        let folder = process::state::lessons(state.path());
        fs::create_dir(&folder).unwrap();
        let whole = Lesson { title: "By hand".to_owned(), ..Lesson::builtin() }.to_toml();
        for (name, text) in [
            ("by_hand.toml", whole.as_str()),
            ("cut_short.toml", &whole[..whole.len() / 2]),
            ("three_of_them.toml", &whole),
            ("begun.half", "x"),
        ] {
            fs::write(folder.join(name), text).unwrap();
        }
        let listed = library(Some(state.path()), &Lesson::builtin()).list();
        let listed = listed.as_array().unwrap();
        let of = |title: &str| listed.iter().find(|entry| entry["title"] == title).unwrap();
        assert_eq!(listed.len(), LIBRARY.len() + 3);
        assert_eq!((&of("By hand")["id"], &of("By hand")["error"]), (&json!("by_hand"), &Value::Null));
        let why = |title: &str| of(title)["error"].as_str().unwrap();
        assert!(why("cut_short").contains("cut_short.toml"), "{}", why("cut_short"));
        assert!(why("three_of_them").contains("three_of_them"));
        let state = state.path().display().to_string();
        insta::assert_snapshot!(why("three_of_them").replace(&state, "[state]"));
    }

    #[test]
    fn the_lesson_that_the_robot_was_started_with_is_listed_once() {
        let own = Lesson { title: "My own".to_owned(), ..Lesson::builtin() };
        let listed = library(None, &own).list();
        assert_eq!((&listed[0]["id"], &listed[0]["title"]), (&json!(""), &json!("My own")));
        let listed = library(None, &Lesson::builtin()).list();
        assert_eq!(listed.as_array().unwrap().len(), LIBRARY.len());
        assert_ne!(listed[0]["id"], "");
    }
}

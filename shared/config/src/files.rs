use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use settings::SettingsError;

use crate::overrides::{self, Override};
use crate::robot::builtin;
use crate::unread::{UnreadFile, unread};
use crate::{Robot, text};

/// The texts of a robot's configuration files: `leo.toml` and its sibling files.
///
/// The texts are read once. So a robot built from them stays the same when the files on disk change, and errors still
/// name the user's own files.
#[derive(Clone, Debug)]
pub struct Files {
    leo: Option<PathBuf>,
    texts: Vec<(&'static str, String)>,
}

/// Where the text of a file comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileSource {
    /// Its name.
    pub name: &'static str,
    /// The file that was read; `None` for the text built into the executable.
    pub path: Option<PathBuf>,
}

/// The paths of the files that are read for `leo` (a `leo.toml`); none without it.
#[must_use]
pub fn read_files(leo: Option<&Path>) -> Vec<PathBuf> {
    let files = Files { leo: leo.map(Path::to_owned), texts: Vec::new() };
    ALL.into_iter().filter_map(|(name, _)| files.place(name)).collect()
}

/// The file names, each with the text built into the executable.
const ALL: [(&str, &str); 5] = [
    ("leo.toml", builtin::LEO),
    ("percepts.toml", builtin::PERCEPTS),
    ("perspective.toml", builtin::PERSPECTIVE),
    ("motor.toml", builtin::MOTOR),
    ("leo.urdf", builtin::URDF),
];

impl Files {
    /// Reads `leo` (a `leo.toml`) and its sibling files. A missing sibling is replaced by the built-in one; without
    /// `leo`, every file is built in.
    ///
    /// # Errors
    ///
    /// A file exists and cannot be read.
    pub fn read(leo: Option<&Path>) -> Result<Self, SettingsError> {
        let mut files = Self { leo: leo.map(Path::to_owned), texts: Vec::new() };
        for (name, builtin) in ALL {
            let text = match files.place(name) {
                Some(file) => text(&file)?,
                None => builtin.to_owned(),
            };
            files.texts.push((name, text));
        }
        Ok(files)
    }

    /// Reads the snapshot that [`keep`](Self::keep) wrote into `folder`; `leo` is the original file, for error
    /// messages.
    ///
    /// # Errors
    ///
    /// A file of the snapshot cannot be read.
    pub fn kept(leo: Option<&Path>, folder: &Path) -> Result<Self, SettingsError> {
        let read = |(name, _)| Ok((name, text(&folder.join(name))?));
        let texts = ALL.into_iter().map(read).collect::<Result<_, SettingsError>>()?;
        Ok(Self { leo: leo.map(Path::to_owned), texts })
    }

    /// Writes a snapshot of all files into `folder`, which must exist.
    ///
    /// # Errors
    ///
    /// A file cannot be written.
    pub fn keep(&self, folder: &Path) -> io::Result<()> {
        self.texts.iter().try_for_each(|(name, text)| fs::write(folder.join(name), text))
    }

    /// These files with values set on the command line, each `section.key=value`. A value is for the first file that has
    /// its key; `percepts:`, `perspective:`, `motor:` or `leo:` before the key names the file.
    ///
    /// # Errors
    ///
    /// A value cannot be set, or is invalid; or a file is invalid without them.
    pub fn with_values(&self, sets: &[String]) -> Result<Self, SettingsError> {
        let mut files = self.clone();
        for set in sets {
            files.set(set)?;
        }
        let Err(whole) = Robot::of(&files) else { return Ok(files) };
        Robot::of(self)?;
        // The first value with which the configuration is invalid. Values that need each other were set together.
        let mut so_far = self.clone();
        for set in sets {
            so_far.set(set)?;
            if let Err(SettingsError::Invalid { reason, .. }) = Robot::of(&so_far) {
                return Err(overrides::error(set, reason));
            }
        }
        Err(whole)
    }

    fn set(&mut self, set: &str) -> Result<(), SettingsError> {
        let value = Override::parse(set)?;
        let is_for = |name: &str| value.file.map_or(name.ends_with(".toml"), |file| file == name);
        let mut best: Option<(usize, &mut String)> = None;
        for (_, text) in self.texts.iter_mut().filter(|(name, _)| is_for(name)) {
            let depth = value.depth_in(text);
            if best.as_ref().is_none_or(|(known, _)| depth > *known) {
                best = Some((depth, text));
            }
        }
        if let Some((_, text)) = best {
            *text = value.apply(text);
        }
        Ok(())
    }

    /// Where each file comes from.
    #[must_use]
    pub fn sources(&self) -> Vec<FileSource> {
        self.texts.iter().map(|(name, _)| FileSource { name, path: self.place(name) }).collect()
    }

    /// The files of the folder of `leo.toml` that nothing reads.
    #[must_use]
    pub fn unread(&self) -> Vec<UnreadFile> {
        self.leo.as_deref().map_or_else(Vec::new, unread)
    }

    /// The file names with their texts. Written into an empty folder, they describe the same robot.
    #[must_use]
    pub fn texts(&self) -> &[(&'static str, String)] {
        &self.texts
    }

    /// The path of `leo.toml`; `None` if every file is built in.
    #[must_use]
    pub fn leo(&self) -> Option<&Path> {
        self.leo.as_deref()
    }

    /// The text of a file, and the path by which errors name it.
    pub(crate) fn file(&self, name: &str) -> (&str, PathBuf) {
        let text = self.texts.iter().find(|(known, _)| *known == name).map_or("", |(_, text)| text.as_str());
        (text, self.place(name).unwrap_or_else(|| name.into()))
    }

    fn place(&self, name: &str) -> Option<PathBuf> {
        let leo = self.leo.as_deref()?;
        if name == "leo.toml" { Some(leo.to_owned()) } else { Robot::sibling_file(Some(leo), name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(sets: &[&str]) -> Result<Robot, String> {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let files = Files::read(None).unwrap().with_values(&sets);
        files.and_then(|files| Robot::of(&files)).map_err(|error| error.to_string())
    }

    #[test]
    fn a_value_is_set_in_the_file_that_has_its_key() {
        let robot = with(&[
            "console.address=127.0.0.1:7799",
            "belief.partners=0",
            "belief.names=[\"Ann\"]",
            "threshold=0.25",
            "motor:joint.0.max_velocity_rad_s=2",
            "sensor.rate_hz=100",
        ])
        .unwrap();
        assert_eq!(robot.leo.console.address.get().unwrap().port(), 7799);
        assert_eq!(robot.leo.belief.partners, 0);
        assert!((robot.percepts.threshold - 0.25).abs() < 1e-9);
        assert!((robot.motor.joints[0].max_velocity_rad_s - 2.0).abs() < 1e-9);
        assert!((robot.leo.sensor.rate_hz.get() - 100.0).abs() < 1e-9);
    }

    #[test]
    fn an_invalid_value_is_named_and_not_the_file() {
        for (sets, set, word) in [
            (&["belief.depth=9"][..], "belief.depth=9", "from 1 to 6"),
            (&["console.rate_hz=50", "console.adress=none"], "console.adress=none", "`address`?"),
            (&["consol.rate_hz=50"], "consol.rate_hz=50", "`console`?"),
            (&["sensor.rate_hz=often"], "sensor.rate_hz=often", "a number"),
            (&["perspective:belief.depth=2"], "perspective:belief.depth=2", "unknown field `belief`"),
            (&["learner.goal_rate_hz=5"], "learner.goal_rate_hz=5", "between two goals"),
        ] {
            let error = with(sets).unwrap_err();
            assert!(error.starts_with(&format!("--set {set}: ")) && error.contains(word), "{error}");
        }
        // The order of values that need each other does not matter.
        for sets in [
            ["learner.goal_rate_hz=5", "motor.command_timeout_ms=1000"],
            ["motor.command_timeout_ms=1000", "learner.goal_rate_hz=5"],
        ] {
            with(&sets).unwrap();
        }
    }

    #[test]
    fn an_invalid_file_is_named_and_not_the_value() {
        let folder = tempfile::tempdir().unwrap();
        let leo = folder.path().join("leo.toml");
        fs::write(&leo, builtin::LEO).unwrap();
        fs::write(folder.path().join("percepts.toml"), "threshhold = 0.5\n").unwrap();
        let files = Files::read(Some(&leo)).unwrap();
        let error = files.with_values(&["belief.depth=2".to_owned()]).unwrap_err().to_string();
        assert!(error.contains("percepts.toml:1:1"), "{error}");
        let sources = files.sources();
        let of = |name: &str| sources.iter().find(|source| source.name == name).unwrap().path.is_some();
        assert!(of("leo.toml") && of("percepts.toml") && !of("motor.toml") && !of("leo.urdf"));
    }

    #[test]
    fn a_kept_configuration_is_independent_of_later_changes() {
        let [own, folder] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let leo = own.path().join("robot.toml");
        fs::write(&leo, builtin::LEO.replace("queue_depth = 4 ", "queue_depth = 3 ")).unwrap();
        fs::write(own.path().join("percepts.toml"), builtin::PERCEPTS).unwrap();
        let files = Files::read(Some(&leo)).unwrap();
        files.keep(folder.path()).unwrap();
        for name in ["robot.toml", "percepts.toml", "motor.toml"] {
            fs::write(own.path().join(name), "[sens").unwrap();
        }
        let kept = Files::kept(Some(&leo), folder.path()).unwrap();
        assert_eq!(kept.texts(), files.texts());
        assert_eq!(Robot::of(&kept).unwrap().leo.buffers.queue_depth.get(), 3);
        assert!(Robot::load(Some(&leo)).is_err());

        fs::write(folder.path().join("percepts.toml"), "threshhold = 0.5\n").unwrap();
        let error = Robot::of(&Files::kept(Some(&leo), folder.path()).unwrap()).unwrap_err().to_string();
        let named = own.path().join("percepts.toml");
        assert!(error.starts_with(&format!("{}:1:1", named.display())), "{error}");
    }
}

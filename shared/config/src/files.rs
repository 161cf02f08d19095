use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use settings::SettingsError;

use crate::robot::builtin;
use crate::text;

/// The texts of a robot's configuration files: `leo.toml` and its sibling files.
///
/// The texts are read once. So a robot built from them stays the same when the files on disk change, and errors still
/// name the user's own files.
#[derive(Clone, Debug)]
pub struct Files {
    leo: Option<PathBuf>,
    texts: Vec<(&'static str, String)>,
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
        if name == "leo.toml" { Some(leo.to_owned()) } else { crate::Robot::sibling_file(Some(leo), name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Robot;

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

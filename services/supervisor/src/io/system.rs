//! The one reader of `/proc` and `/sys`.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What a machine says of itself in files, below a folder that stands for its root.
///
/// Whatever cannot be read is `None` or empty: what a kernel does not have, it does not show.
#[derive(Clone, Debug)]
pub struct System {
    root: PathBuf,
}

impl System {
    /// The machine whose files lie below `root`: `/` for this one.
    #[must_use]
    pub fn below(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    /// The text of a file, without white space around it.
    #[must_use]
    pub fn read(&self, file: &str) -> Option<String> {
        fs::read_to_string(self.place(file)).ok().map(|text| text.trim().to_owned())
    }

    /// The number that a file holds.
    #[must_use]
    pub fn number<T: FromStr>(&self, file: &str) -> Option<T> {
        self.read(file)?.parse().ok()
    }

    /// The names in a folder, sorted.
    #[must_use]
    pub fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.place(folder)).into_iter().flatten().flatten();
        let mut names: Vec<String> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// A folder and those above it, from the inside out, where links have led to.
    #[must_use]
    pub fn ancestors(&self, folder: &str) -> Vec<String> {
        let Ok(root) = self.root.canonicalize() else { return Vec::new() };
        let Ok(place) = self.place(folder).canonicalize() else { return Vec::new() };
        let within = place.strip_prefix(root).unwrap_or(Path::new(""));
        within.ancestors().map(|folder| format!("/{}", folder.display())).collect()
    }

    /// Writes a file, as `echo text > file` does. A file of `/proc` or `/sys` may refuse.
    ///
    /// # Errors
    ///
    /// The file is not there, may not be written, or refuses the text.
    pub fn write(&self, file: &str, text: &str) -> io::Result<()> {
        let mut file = fs::OpenOptions::new().write(true).truncate(true).open(self.place(file))?;
        file.write_all(text.as_bytes())
    }

    /// Makes a file, or replaces the whole of one, so that nobody ever sees half of it.
    ///
    /// # Errors
    ///
    /// Its folder cannot be written.
    pub fn replace(&self, file: &str, text: &str) -> io::Result<()> {
        let place = self.place(file);
        let new = place.with_extension("new");
        fs::write(&new, text)?;
        fs::rename(new, place)
    }

    /// Removes a file.
    ///
    /// # Errors
    ///
    /// It is not there, or its folder cannot be written.
    pub fn remove(&self, file: &str) -> io::Result<()> {
        fs::remove_file(self.place(file))
    }

    fn place(&self, file: &str) -> PathBuf {
        self.root.join(file.trim_start_matches('/'))
    }
}

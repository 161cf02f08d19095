//! Access to `/proc` and `/sys`.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Files of a machine, below a folder used as its root.
///
/// An unreadable file is `None` or empty, because a kernel without a feature does not have its file.
#[derive(Clone, Debug)]
pub struct System {
    root: PathBuf,
}

impl System {
    /// The machine with its files below `root`; `/` for this machine.
    #[must_use]
    pub fn below(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    /// The text of a file, trimmed.
    #[must_use]
    pub fn read(&self, file: &str) -> Option<String> {
        fs::read_to_string(self.place(file)).ok().map(|text| text.trim().to_owned())
    }

    /// The content of a file as a number.
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

    /// The real path of a folder and its ancestors, innermost first, with symbolic links resolved.
    #[must_use]
    pub fn ancestors(&self, folder: &str) -> Vec<String> {
        let Ok(root) = self.root.canonicalize() else { return Vec::new() };
        let Ok(place) = self.place(folder).canonicalize() else { return Vec::new() };
        let within = place.strip_prefix(root).unwrap_or(Path::new(""));
        within.ancestors().map(|folder| format!("/{}", folder.display())).collect()
    }

    /// Writes a file, like `echo text > file`. A file of `/proc` or `/sys` may reject the text.
    ///
    /// # Errors
    ///
    /// The file does not exist, is not writable, or rejects the text.
    pub fn write(&self, file: &str, text: &str) -> io::Result<()> {
        let mut file = fs::OpenOptions::new().write(true).truncate(true).open(self.place(file))?;
        file.write_all(text.as_bytes())
    }

    /// Creates or replaces a file atomically.
    ///
    /// # Errors
    ///
    /// Its folder is not writable.
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
    /// It does not exist, or its folder is not writable.
    pub fn remove(&self, file: &str) -> io::Result<()> {
        fs::remove_file(self.place(file))
    }

    fn place(&self, file: &str) -> PathBuf {
        self.root.join(file.trim_start_matches('/'))
    }
}

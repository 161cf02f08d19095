use std::path::{Path, PathBuf};

/// The file names of a store, in one directory: for `learned.store` the second copy is `learned.copy.store`.
#[derive(Clone, Debug)]
pub(crate) struct Names {
    folder: PathBuf,
    stem: String,
}

impl Names {
    /// The names for the store whose first copy has this path.
    pub(crate) fn of(path: &Path) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Self {
            folder: folder.unwrap_or_else(|| Path::new(".")).to_owned(),
            stem: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// The copies, in the order of writing.
    pub(crate) fn copies(&self) -> [String; 2] {
        [format!("{}.store", self.stem), format!("{}.copy.store", self.stem)]
    }

    /// The temporary file for rewriting a copy.
    pub(crate) fn unfinished(&self) -> String {
        format!("{}.new.store", self.stem)
    }

    /// The lock file: a process holds its lock while it uses the store.
    pub(crate) fn lock(&self) -> String {
        format!("{}.lock", self.stem)
    }

    /// The database of Leo before 0.1.
    pub(crate) fn database(&self) -> String {
        format!("{}.redb", self.stem)
    }

    /// The n-th name for setting a damaged file aside: `learned.damaged.store`, `learned.damaged.2.store`.
    pub(crate) fn aside(name: &str, number: u32) -> String {
        let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
        let number = if number == 1 { String::new() } else { format!(".{number}") };
        format!("{stem}.damaged{number}.{ending}")
    }
}

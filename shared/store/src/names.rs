use std::path::{Path, PathBuf};

/// The names of the files of a store, all in one folder: for `learned.store` the other copy is `learned.copy.store`.
#[derive(Clone, Debug)]
pub(crate) struct Names {
    folder: PathBuf,
    stem: String,
}

impl Names {
    /// Of the store whose first copy has this path.
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

    /// The copies, in the order in which they are written.
    pub(crate) fn copies(&self) -> [String; 2] {
        [format!("{}.store", self.stem), format!("{}.copy.store", self.stem)]
    }

    /// What becomes a copy when it is written.
    pub(crate) fn unfinished(&self) -> String {
        format!("{}.new.store", self.stem)
    }

    /// Whoever has it locked works with the store.
    pub(crate) fn lock(&self) -> String {
        format!("{}.lock", self.stem)
    }

    /// The database of version 3 and older ones.
    pub(crate) fn database(&self) -> String {
        format!("{}.redb", self.stem)
    }

    /// Under which name a file is set aside, the n-th of its kind: `learned.damaged.store`, `learned.v3.redb`.
    pub(crate) fn aside(name: &str, why: &str, number: u32) -> String {
        let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
        let number = if number == 1 { String::new() } else { format!(".{number}") };
        format!("{stem}.{why}{number}.{ending}")
    }
}

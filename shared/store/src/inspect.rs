use std::path::Path;

use crate::files::{Disk, Files as _};
use crate::names::Names;
use crate::store::refuse_database;
use crate::survey::{CopyComparison, CopyState};
use crate::{OpenError, VERSION};

/// The state of a store, determined without opening it for use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StoreState {
    /// There is no store.
    NoFile,
    /// It is sound, and of the version of this code: [`VERSION`].
    Sound,
    /// Another process has it open, so its state is unknown.
    InUse,
    /// It is damaged, with the reason; opening repairs it as far as possible.
    Damaged(String),
}

impl StoreState {
    /// Determines the state of a store. Creates and repairs nothing.
    ///
    /// # Errors
    /// [`OpenError`] if it has another version, the database of Leo before 0.1 is beside it, or it cannot be read.
    pub fn of(path: &Path) -> Result<Self, OpenError> {
        let names = Names::of(path);
        let Some(mut disk) = Disk::inspect(names.folder()).map_err(|source| OpenError::Folder { source })?
        else {
            return Ok(Self::NoFile);
        };
        let unreadable = |source| OpenError::Unreadable { path: path.to_owned(), source };
        if !disk.lock(&names.lock(), false).map_err(unreadable)? {
            return Ok(Self::InUse);
        }
        refuse_database(&mut disk, &names)?;
        let [first, second] = names.copies();
        let (first, second) =
            (disk.read(&first).map_err(unreadable)?, disk.read(&second).map_err(unreadable)?);
        let survey = CopyComparison::of([first.as_deref(), second.as_deref()])
            .map_err(|found| OpenError::Version { path: path.to_owned(), found, known: VERSION })?;
        let damaged = names.copies().into_iter().zip(&survey.copies).filter_map(|(name, standing)| {
            let CopyState::Damaged(what) = standing else { return None };
            Some(format!("{} {what}", names.path(&name).display()))
        });
        let damaged: Vec<String> = damaged.collect();
        if damaged.is_empty() {
            let is_absent = survey.copies.contains(&CopyState::Absent);
            return Ok(if is_absent { Self::NoFile } else { Self::Sound });
        }
        Ok(Self::Damaged(damaged.join("; ")))
    }
}

use std::io;
use std::path::Path;

use crate::database::{self, DatabaseState};
use crate::files::{Disk, Files as _};
use crate::migration::MIGRATIONS;
use crate::names::Names;
use crate::survey::{CopyComparison, CopyState};
use crate::{OpenError, VERSION};

/// The version of a store, determined without opening it for use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Version {
    /// There is no store.
    NoFile,
    /// The current version of this code: [`VERSION`].
    This,
    /// An older version, which is migrated on opening.
    Older(u64),
    /// A newer or unknown version.
    Unknown(u64),
    /// Another process has it open, so the version is unknown.
    InUse,
    /// It is damaged, with the reason; opening repairs it as far as possible.
    Damaged(String),
}

impl Version {
    /// Determines the version of a store. Creates, migrates and repairs nothing.
    ///
    /// # Errors
    /// [`OpenError::Folder`] or [`OpenError::Unreadable`] if it cannot be read.
    pub fn of(path: &Path) -> Result<Self, OpenError> {
        let names = Names::of(path);
        let Some(mut disk) = Disk::inspect(names.folder()).map_err(|source| OpenError::Folder { source })?
        else {
            return Ok(Self::NoFile);
        };
        let unreadable = |source| OpenError::Unreadable { path: path.to_owned(), source };
        inspect(&mut disk, &names).map_err(unreadable)
    }
}

fn inspect(disk: &mut Disk, names: &Names) -> io::Result<Version> {
    if !disk.lock(&names.lock(), false)? || !disk.lock(&names.database(), false)? {
        return Ok(Version::InUse);
    }
    if let Some(bytes) = disk.read(&names.database())? {
        return Ok(match database::read(&bytes) {
            DatabaseState::Damaged(what) => {
                Version::Damaged(format!("{} {what}", names.path(&names.database()).display()))
            }
            DatabaseState::Sound { version: None, .. } => Version::This,
            DatabaseState::Sound { version: Some(older), .. }
                if MIGRATIONS.iter().any(|migration| migration.from == older) =>
            {
                Version::Older(older)
            }
            DatabaseState::Sound { version: Some(other), .. } => Version::Unknown(other),
        });
    }
    let [first, second] = names.copies();
    let (first, second) = (disk.read(&first)?, disk.read(&second)?);
    let survey = match CopyComparison::of([first.as_deref(), second.as_deref()]) {
        Ok(survey) => survey,
        Err(version) => return Ok(Version::Unknown(version)),
    };
    let damaged = names.copies().into_iter().zip(survey.copies.clone()).filter_map(|(name, standing)| {
        if let CopyState::Damaged(what) = standing {
            Some(format!("{} {what}", names.path(&name).display()))
        } else {
            None
        }
    });
    let damaged: Vec<String> = damaged.collect();
    Ok(if damaged.is_empty() {
        if survey.copies.contains(&CopyState::Absent) { Version::NoFile } else { Version::This }
    } else {
        Version::Damaged(damaged.join("; "))
    })
}

const _: () = assert!(VERSION > 3, "version 3 and older ones are databases");

use std::io;
use std::path::Path;

use crate::database::{self, Found};
use crate::files::{Disk, Files as _};
use crate::migration::MIGRATIONS;
use crate::names::Names;
use crate::survey::{Standing, Survey};
use crate::{OpenError, VERSION};

/// Of which version a store is that was only looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Version {
    /// There is none.
    NoFile,
    /// Of the one that this code reads and writes: [`VERSION`].
    This,
    /// Of this older one, which is taken over when it is opened.
    Older(u64),
    /// Of this one, which is newer, or none that there ever was.
    Unknown(u64),
    /// Somebody has it open, who alone knows.
    InUse,
    /// It is damaged in this way, and mended as far as can be when it is opened.
    Damaged(String),
}

impl Version {
    /// That of a store. Nothing is made, taken over or mended.
    ///
    /// # Errors
    /// [`OpenError::Folder`] or [`OpenError::Unreadable`] when it cannot be looked at.
    pub fn of(path: &Path) -> Result<Self, OpenError> {
        let names = Names::of(path);
        let Some(mut disk) = Disk::look(names.folder()).map_err(|source| OpenError::Folder { source })?
        else {
            return Ok(Self::NoFile);
        };
        let unreadable = |source| OpenError::Unreadable { path: path.to_owned(), source };
        look(&mut disk, &names).map_err(unreadable)
    }
}

fn look(disk: &mut Disk, names: &Names) -> io::Result<Version> {
    if !disk.lock(&names.lock(), false)? || !disk.lock(&names.database(), false)? {
        return Ok(Version::InUse);
    }
    if let Some(bytes) = disk.read(&names.database())? {
        return Ok(match database::read(&bytes) {
            Found::Damaged(what) => {
                Version::Damaged(format!("{} {what}", names.path(&names.database()).display()))
            }
            Found::Sound { version: None, .. } => Version::This,
            Found::Sound { version: Some(older), .. }
                if MIGRATIONS.iter().any(|migration| migration.from == older) =>
            {
                Version::Older(older)
            }
            Found::Sound { version: Some(other), .. } => Version::Unknown(other),
        });
    }
    let [first, second] = names.copies();
    let (first, second) = (disk.read(&first)?, disk.read(&second)?);
    let survey = match Survey::of([first.as_deref(), second.as_deref()]) {
        Ok(survey) => survey,
        Err(version) => return Ok(Version::Unknown(version)),
    };
    let damaged = names.copies().into_iter().zip(survey.copies.clone()).filter_map(|(name, standing)| {
        if let Standing::Damaged(what) = standing {
            Some(format!("{} {what}", names.path(&name).display()))
        } else {
            None
        }
    });
    let damaged: Vec<String> = damaged.collect();
    Ok(if damaged.is_empty() {
        if survey.copies.contains(&Standing::Absent) { Version::NoFile } else { Version::This }
    } else {
        Version::Damaged(damaged.join("; "))
    })
}

const _: () = assert!(VERSION > 3, "version 3 and older ones are databases");

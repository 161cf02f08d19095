//! `leo check --migrate`: converts configuration files of an older version, and keeps copies of the originals.

use std::ffi::OsString;
use std::fs;
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt as _, fchown};
use std::path::{Path, PathBuf};

use config::{Migration, Robot};
use folder::{Existing, Output};

use crate::failure::CommandError;
use crate::output::print;

/// Migrates a configuration, and prints what was done. Writes no file before all of them can be converted.
pub(super) fn migrate(leo: &Path) -> Result<(), CommandError> {
    let files = Robot::migrated(leo).map_err(CommandError::usage)?;
    for file in files.iter().filter(|file| !file.steps.is_empty()) {
        // The new version is written beside the original, and renamed.
        for made in [backup_path(&file.file), new(&file.file)] {
            Output::named(&made, Existing::Keep).check().map_err(|_there| {
                CommandError::usage(format!(
                    "{} exists already, and nothing was changed: move it away",
                    made.display()
                ))
            })?;
        }
    }
    replace(&files).map_err(|(file, error)| {
        CommandError::runtime(format!("cannot migrate {}: {error}", file.file.display()))
    })?;
    let all: String = files.iter().map(said).collect();
    print(&format!("{all}\n"))
}

fn said(file: &Migration) -> String {
    if file.steps.is_empty() {
        return format!("{} is of this version\n", file.file.display());
    }
    let steps: String = file.steps.iter().map(|step| format!("    {step}\n")).collect();
    format!(
        "{} was migrated; the original: {}\n{steps}",
        file.file.display(),
        backup_path(&file.file).display()
    )
}

/// Path of the copy of the original.
fn backup_path(file: &Path) -> PathBuf {
    with(file, ".old")
}

/// Path of the new file before it replaces the original.
fn new(file: &Path) -> PathBuf {
    with(file, ".new")
}

fn with(file: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(file);
    name.push(ending);
    name.into()
}

/// Copies the originals and replaces each file atomically. Everything is on the disk before the first file is replaced.
/// The extra files of files that could not be replaced are removed.
fn replace(files: &[Migration]) -> Result<(), (&Migration, io::Error)> {
    let old: Vec<&Migration> = files.iter().filter(|file| !file.steps.is_empty()).collect();
    let mut made = Vec::new();
    let mut replaced = 0;
    let mut all = || {
        for (index, &file) in old.iter().enumerate() {
            prepare(file, |path| made.push((index, path))).map_err(|error| (file, error))?;
        }
        for &file in &old {
            fs::rename(new(&file.file), &file.file).map_err(|error| (file, error))?;
            replaced += 1;
        }
        Ok(())
    };
    let done = all();
    // A file of the same name that another program created is kept.
    for (_, path) in made.iter().filter(|(index, _)| *index >= replaced) {
        let _ = fs::remove_file(path);
    }
    done
}

/// Writes the copy and the new version beside a file, synchronised to the disk. `created` is told of each as soon as it
/// exists.
fn prepare(file: &Migration, mut created: impl FnMut(PathBuf)) -> io::Result<()> {
    let old = fs::metadata(&file.file)?;
    let (backup_path, new) = (backup_path(&file.file), new(&file.file));
    for (path, bytes) in [(backup_path, fs::read(&file.file)?), (new, file.text.clone().into_bytes())] {
        let mut made = Output::named(&path, Existing::Keep).create()?;
        created(path);
        made.write_all(&bytes)?;
        // Only root can change a file's owner.
        let _granted = fchown(&made, Some(old.uid()), Some(old.gid()));
        made.set_permissions(old.permissions())?;
        made.sync_all()?;
    }
    Ok(())
}

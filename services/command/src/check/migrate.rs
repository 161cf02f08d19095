//! `leo check --migrate`: converts files of an older version, and keeps copies of the originals.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt as _, fchown};
use std::path::{Path, PathBuf};

use config::{Migration, Robot};
use folder::{Existing, Output};
use learner_process::{Access, MemoryVersion};

use crate::domain::state_directory;
use crate::failure::CommandError;
use crate::output::print;

/// Migrates a configuration and the learner's memory, and prints what was done. Writes no configuration file before all
/// of them can be converted.
pub(super) fn migrate(config: Option<&Path>, state: Option<&Path>) -> Result<(), CommandError> {
    if let Some(leo) = config {
        let files = Robot::migrated(leo).map_err(CommandError::usage)?;
        for file in files.iter().filter(|file| !file.steps.is_empty()) {
            if backup_path(&file.file).exists() {
                return Err(CommandError::usage(format!(
                    "{} exists already, and nothing was changed: move it away",
                    backup_path(&file.file).display()
                )));
            }
        }
        replace(&files).map_err(|(file, error)| {
            CommandError::runtime(format!("cannot migrate {}: {error}", file.file.display()))
        })?;
        for file in &files {
            print(&said(file))?;
        }
    }
    let state = state.map_or_else(state_directory, |state| Ok(state.to_owned()))?;
    learned(&state)
}

/// Migrates the learner's memory: opening a store of an older version converts it.
fn learned(state: &Path) -> Result<(), CommandError> {
    let file = process::state::learned(state);
    // Opening would create a missing store, which would be wrong in a mistyped directory.
    if learner_process::memory_version(state).map_err(CommandError::usage)? == MemoryVersion::NoFile {
        return print(&format!(
            "no learned tasks in {}; use --state to name another state directory\n\n",
            state.display()
        ));
    }
    process::state::prepare(state).map_err(CommandError::usage)?;
    let before = copies(state);
    if learner_process::check_memory(state).map_err(CommandError::usage)? == Access::InUse {
        return Err(CommandError::runtime(format!(
            "{} is in use, and was not checked: stop the robot first; a restarted robot migrates the tasks of an \
             older version in any case",
            file.display()
        )));
    }
    let made = copies(state);
    let new: Vec<String> = made.difference(&before).map(|file| file.display().to_string()).collect();
    print(&if new.is_empty() {
        format!("the store of learned tasks in {} is of this version\n\n", state.display())
    } else {
        format!(
            "the store of learned tasks in {} was migrated; the original: {}\n\n",
            state.display(),
            new.join(", ")
        )
    })
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
    let mut replaced = 0;
    let done = old.iter().try_for_each(|&file| prepare(file).map_err(|error| (file, error))).and_then(|()| {
        old.iter().try_for_each(|&file| {
            fs::rename(new(&file.file), &file.file).map_err(|error| (file, error))?;
            replaced += 1;
            Ok(())
        })
    });
    for file in old.iter().skip(replaced) {
        for made in [backup_path(&file.file), new(&file.file)] {
            // A file that was not created cannot be removed.
            let _ = fs::remove_file(made);
        }
    }
    done
}

/// Writes the copy and the new version beside a file, synchronised to the disk.
fn prepare(file: &Migration) -> io::Result<()> {
    let old = fs::metadata(&file.file)?;
    let (backup_path, new) = (backup_path(&file.file), new(&file.file));
    for (path, bytes) in [(backup_path, fs::read(&file.file)?), (new, file.text.clone().into_bytes())] {
        let mut made = Output::named(&path, Existing::Replace).create()?;
        made.write_all(&bytes)?;
        // Only root can change a file's owner.
        let _granted = fchown(&made, Some(old.uid()), Some(old.gid()));
        made.set_permissions(old.permissions())?;
        made.sync_all()?;
    }
    Ok(())
}

/// The copies of stores of older versions: `learned.v1.redb`, ...
fn copies(state: &Path) -> BTreeSet<PathBuf> {
    let entries = fs::read_dir(state).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_copy = |path: &PathBuf| {
        path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.starts_with("learned.v"))
    };
    entries.filter(is_copy).collect()
}

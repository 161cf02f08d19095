use std::fs::{self, File};
use std::io;
use std::os::unix::fs::{MetadataExt as _, chown};
use std::path::{Path, PathBuf};

/// Keeps a copy of a file of an older version beside it, whole and durable when this returns; gives
/// its name. What stands there already is left: the copy then gets a further number.
pub(crate) fn beside(file: &Path, version: u64) -> io::Result<PathBuf> {
    let named = |end: &str| {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let ending = file.extension().map(|ending| format!(".{}", ending.to_string_lossy()));
        file.with_file_name(format!("{stem}.v{version}{end}{}", ending.unwrap_or_default()))
    };
    let mut copy = named("");
    let mut further = 2_u32;
    while copy.try_exists()? {
        copy = named(&format!(".{further}"));
        further += 1;
    }
    // Nothing half copied ever bears the name of a copy.
    let unfinished = named(".part");
    fs::copy(file, &unfinished)?;
    // Where root migrates what a service learned, the copy is for that service too. Whoever is not root owns what he
    // makes.
    let old = fs::metadata(file)?;
    let _granted = chown(&unfinished, Some(old.uid()), Some(old.gid()));
    File::open(&unfinished)?.sync_all()?;
    fs::rename(&unfinished, &copy)?;
    if let Some(folder) = file.parent() {
        File::open(folder)?.sync_all()?;
    }
    Ok(copy)
}

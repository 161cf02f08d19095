//! Saves recorded lessons in a thread, so that the simulation does not block on the disk.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::{fs, io};

use config::lesson::{LIBRARY, Lesson};
use folder::Folder;

use crate::interactive::RefusedActError;

/// Maximum length of a title, in bytes.
const MAX_TITLE_BYTES: usize = 100;

/// The extension of a lesson that is being written.
const PARTIAL_EXTENSION: &str = "half";

/// Lessons being written, each with the serial number of the requesting act.
#[derive(Default)]
pub(crate) struct LessonSaver {
    pending: Vec<(u64, Receiver<Result<PathBuf, RefusedActError>>)>,
}

impl LessonSaver {
    /// Starts to write a lesson into a new file of a folder, for the act with this number. Never overwrites a file.
    ///
    /// # Errors
    ///
    /// The title contains no letter or is too long, or the system has no thread left.
    pub(crate) fn begin(
        &mut self,
        serial: u64,
        lesson: &Lesson,
        folder: PathBuf,
    ) -> Result<(), RefusedActError> {
        let text = lesson.to_toml();
        let name = name_of(&lesson.title)?;
        let (answer, answers) = channel();
        let write = move || {
            // Write only what can be read again.
            let read = Lesson::parse(&text, &folder.join(format!("{name}.toml")));
            let written = read.map_err(|error| RefusedActError(error.to_string())).and_then(|_| {
                let failed = |error: io::Error| {
                    RefusedActError(format!("cannot write {name} in {}: {error}", folder.display()))
                };
                write_whole(&folder, &name, &text).map_err(failed)
            });
            // At shutdown the receiver may be gone.
            let _ = answer.send(written);
        };
        let started = thread::Builder::new().name("saving".to_owned()).spawn(write);
        started.map_err(|error| RefusedActError(format!("no thread can be started to write it: {error}")))?;
        self.pending.push((serial, answers));
        Ok(())
    }

    /// The results of finished writes since the last call.
    pub(crate) fn done(&mut self) -> Vec<(u64, Result<PathBuf, RefusedActError>)> {
        let mut done = Vec::new();
        self.pending.retain(|(serial, answers)| {
            let answer = match answers.try_recv() {
                Err(TryRecvError::Empty) => return true,
                Err(TryRecvError::Disconnected) => Err(RefusedActError("it could not be written".to_owned())),
                Ok(answer) => answer,
            };
            done.push((*serial, answer));
            false
        });
        done
    }
}

/// Writes a lesson into a file named after it, with a number if that name is taken. The file appears atomically.
fn write_whole(folder: &Path, name: &str, text: &str) -> io::Result<PathBuf> {
    let own = Folder::make_all(folder)?;
    for number in 1_u32.. {
        let name = if number == 1 { name.to_owned() } else { format!("{name}_{number}") };
        // A built-in lesson would hide a file of its name.
        if LIBRARY.iter().any(|(known, _)| *known == name) {
            continue;
        }
        let [file, half] = ["toml", PARTIAL_EXTENSION].map(|extension| format!("{name}.{extension}"));
        let mut out = match own.create(&half) {
            Ok(out) => out,
            // Another lesson of this name is being written.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
            Err(error) => return Err(error),
        };
        if own.has(&file)? {
            // Remove the incomplete file; a failure to do so is harmless.
            let _ = own.remove(&half);
            continue;
        }
        let written = out.write_all(text.as_bytes()).and_then(|()| out.sync_all());
        let written = written.and_then(|()| own.rename(&half, &file));
        if written.is_err() {
            let _ = own.remove(&half);
        }
        return written.map(|()| folder.join(file));
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// Removes incomplete files of a killed process. Call it before any lesson is saved.
pub(crate) fn remove_partial_files(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let half = entry.path();
        if half.extension().is_none_or(|extension| extension != PARTIAL_EXTENSION) {
            continue;
        }
        let half_file = half.display();
        match fs::remove_file(&half) {
            Ok(()) => tracing::warn!("{half_file} was being written when its process died, and is removed"),
            Err(error) => tracing::warn!("cannot remove {half_file}, which is half written: {error}"),
        }
    }
}

/// The file name of a lesson: its title in lower case, with underscores for other characters.
fn name_of(title: &str) -> Result<String, RefusedActError> {
    let mut name = String::new();
    for letter in title.chars() {
        if letter.is_alphanumeric() {
            name.extend(letter.to_lowercase());
        } else if !name.is_empty() && !name.ends_with('_') {
            name.push('_');
        }
    }
    let name = name.trim_end_matches('_');
    if name.is_empty() || title.len() > MAX_TITLE_BYTES {
        return Err(RefusedActError(format!(
            "a lesson's title has letters or digits, and at most {MAX_TITLE_BYTES} bytes"
        )));
    }
    Ok(name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Saves a lesson of this title, and waits for the result.
    fn save(folder: &Path, title: &str) -> Result<PathBuf, RefusedActError> {
        let mut saving = LessonSaver::default();
        let lesson = Lesson { title: title.to_owned(), ..Lesson::builtin() };
        saving.begin(1, &lesson, folder.to_owned())?;
        loop {
            if let Some((_, done)) = saving.done().pop() {
                return done;
            }
            thread::yield_now();
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
        names.sort();
        names
    }

    #[test]
    fn a_title_becomes_a_file_name_in_its_folder() {
        assert_eq!(name_of("Task 1: fill the holes!").unwrap(), "task_1_fill_the_holes");
        assert_eq!(name_of("../../etc/passwd").unwrap(), "etc_passwd");
        assert!(name_of("...").is_err() && name_of(&"a".repeat(101)).is_err());
    }

    #[test]
    fn a_saved_lesson_never_replaces_another() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("lessons");
        let first = save(&folder, "By hand").unwrap();
        fs::write(&first, "kept").unwrap();
        assert_eq!(save(&folder, "By hand").unwrap(), folder.join("by_hand_2.toml"));
        assert_eq!(save(&folder, "by hand!").unwrap(), folder.join("by_hand_3.toml"));
        assert_eq!(fs::read_to_string(first).unwrap(), "kept");
        assert_eq!(names(&folder), ["by_hand.toml", "by_hand_2.toml", "by_hand_3.toml"]);
    }

    #[test]
    fn lessons_that_are_written_at_once_get_files_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let writers: Vec<_> = (0..8)
            .map(|_| {
                let folder = folder.path().to_owned();
                thread::spawn(move || save(&folder, "By hand").unwrap())
            })
            .collect();
        let mut files: Vec<PathBuf> = writers.into_iter().map(|writer| writer.join().unwrap()).collect();
        files.sort();
        files.dedup();
        assert_eq!((files.len(), names(folder.path()).len()), (8, 8));
    }

    #[test]
    fn a_lesson_saved_under_a_built_in_title_can_be_opened() {
        let folder = tempfile::tempdir().unwrap();
        for (title, name) in [("The far ones", "the_far_ones_2"), ("Three of them", "three_of_them_2")] {
            assert_eq!(save(folder.path(), title).unwrap(), folder.path().join(format!("{name}.toml")));
            assert_eq!(Lesson::named(name, folder.path()).unwrap().title, title);
        }
    }

    #[test]
    fn only_partial_files_of_a_killed_process_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["killed.half", "by_hand.toml", "notes.txt"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        remove_partial_files(folder.path());
        assert_eq!(names(folder.path()), ["by_hand.toml", "notes.txt"]);
        remove_partial_files(&folder.path().join("nowhere"));
    }

    /// The environment variable with the small file system in which this test runs itself again.
    const SMALL_DISK: &str = "LEO_SMALL_DISK";

    #[test]
    fn a_full_disk_is_named_and_left_without_half_a_lesson() {
        if let Some(disk) = std::env::var_os(SMALL_DISK) {
            return on_a_small_disk(Path::new(&disk));
        }
        let disk = tempfile::tempdir().unwrap();
        let script =
            r#"mount -t tmpfs -o size=256k tmpfs "$0" || exit 77; exec "$1" --exact --nocapture "$2""#;
        let inside = std::process::Command::new("unshare")
            .args(["--mount", "sh", "-c", script])
            .arg(disk.path())
            .arg(std::env::current_exe().unwrap())
            .arg("io::saving::tests::a_full_disk_is_named_and_left_without_half_a_lesson")
            .env(SMALL_DISK, disk.path())
            .output();
        let Some(inside) = inside
            .ok()
            .filter(|inside| inside.status.code() != Some(77) && !inside.stderr.starts_with(b"unshare:"))
        else {
            skip::skip("needs `unshare --mount` and the right to mount a tmpfs");
            return;
        };
        let said = String::from_utf8_lossy(&inside.stdout);
        assert!(inside.status.success() && said.contains("1 passed"), "{inside:?}");
    }

    fn on_a_small_disk(disk: &Path) {
        let folder = disk.join("lessons");
        fs::create_dir(&folder).unwrap();
        let mut fill = fs::File::create(disk.join("fill")).unwrap();
        while fill.write_all(&[0; 512]).is_ok() {}
        let refusal = save(&folder, "By hand").unwrap_err();
        let full = io::Error::from(io::ErrorKind::StorageFull).to_string();
        assert!(refusal.0.to_lowercase().contains(&full) || refusal.0.contains("os error 28"), "{refusal}");
        assert_eq!(names(&folder), [""; 0]);
        drop(fill);
        fs::remove_file(disk.join("fill")).unwrap();
        assert_eq!(save(&folder, "By hand").unwrap(), folder.join("by_hand.toml"));
    }
}

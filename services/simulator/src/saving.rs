//! Writing down what was taught, on a thread of its own: the world does not wait for a disk.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::{fs, io};

use config::lesson::Lesson;

use crate::by_hand::Refusal;

/// The longest title, in bytes.
const TITLE_MOST: usize = 100;

/// Lessons on their way to the disk, each with the number of the act that asked for it.
#[derive(Default)]
pub(crate) struct Saving {
    pending: Vec<(u64, Receiver<Result<PathBuf, Refusal>>)>,
}

impl Saving {
    /// Begins to write a lesson into a folder, in answer to the act of this number.
    ///
    /// # Errors
    ///
    /// The title is none, or the system has no thread left.
    pub(crate) fn begin(&mut self, serial: u64, lesson: &Lesson, folder: PathBuf) -> Result<(), Refusal> {
        let text = lesson.to_toml();
        let name = file_name(&lesson.title)?;
        let (answer, answers) = channel();
        let write = move || {
            let file = folder.join(name);
            // What could not be read again is not written.
            let written = Lesson::parse(&text, &file).map_err(|error| Refusal(error.to_string()));
            let written = written.and_then(|_| {
                let failed = |error: io::Error| Refusal(format!("cannot write {}: {error}", file.display()));
                write_whole(&folder, &file, &text).map_err(failed)
            });
            // Nobody listens where the robot stops.
            let _ = answer.send(written.map(|()| file));
        };
        let started = thread::Builder::new().name("saving".to_owned()).spawn(write);
        started.map_err(|error| Refusal(format!("no thread can be started to write it: {error}")))?;
        self.pending.push((serial, answers));
        Ok(())
    }

    /// What became of those that are done.
    pub(crate) fn done(&mut self) -> Vec<(u64, Result<PathBuf, Refusal>)> {
        let mut done = Vec::new();
        self.pending.retain(|(serial, answers)| match answers.try_recv() {
            Ok(answer) => {
                done.push((*serial, answer));
                false
            }
            Err(std::sync::mpsc::TryRecvError::Empty) => true,
            Err(std::sync::mpsc::TryRecvError::Disconnected) => {
                done.push((*serial, Err(Refusal("it could not be written".to_owned()))));
                false
            }
        });
        done
    }
}

/// The file is whole or it is not there.
fn write_whole(folder: &Path, file: &Path, text: &str) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let half = file.with_extension("half");
    let written = fs::File::create(&half).and_then(|mut out| {
        out.write_all(text.as_bytes())?;
        out.sync_all()
    });
    let written = written.and_then(|()| fs::rename(&half, file));
    if written.is_err() {
        // What is half written helps nobody; that it cannot be removed either changes nothing.
        let _ = fs::remove_file(&half);
    }
    written
}

/// The name of a lesson's file: its title in small letters, with lines for what is no letter.
fn file_name(title: &str) -> Result<String, Refusal> {
    let mut name = String::new();
    for letter in title.chars() {
        if letter.is_alphanumeric() {
            name.extend(letter.to_lowercase());
        } else if !name.is_empty() && !name.ends_with('_') {
            name.push('_');
        }
    }
    let name = name.trim_end_matches('_');
    if name.is_empty() || title.len() > TITLE_MOST {
        return Err(Refusal(format!(
            "a lesson's title has letters or digits, and at most {TITLE_MOST} bytes"
        )));
    }
    Ok(format!("{name}.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_becomes_a_file_name_in_its_folder() {
        assert_eq!(file_name("Task 1: fill the holes!").unwrap(), "task_1_fill_the_holes.toml");
        assert_eq!(file_name("../../etc/passwd").unwrap(), "etc_passwd.toml");
        assert!(file_name("...").is_err() && file_name(&"a".repeat(101)).is_err());
    }
}

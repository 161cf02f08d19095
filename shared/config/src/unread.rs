//! Files beside `leo.toml` that nothing reads: a misspelt name would otherwise mean a built-in file.

use std::fs;
use std::path::{Path, PathBuf};

/// A file that no part of the configuration reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnreadFile {
    /// Its path.
    pub path: PathBuf,
    /// The name that was probably meant.
    pub meant: Option<&'static str>,
    /// Whether a file of that name is there too, and is read.
    pub is_meant_there: bool,
}

impl std::fmt::Display for UnreadFile {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{} is read by nothing", self.path.display())?;
        match self.meant {
            None => Ok(()),
            Some(meant) if self.is_meant_there => write!(out, "; {meant} beside it is read"),
            Some(meant) => write!(out, "; did you mean {meant}?"),
        }
    }
}

/// The files that are read beside a `leo.toml`.
const SIBLINGS: [&str; 4] = ["percepts.toml", "perspective.toml", "motor.toml", "leo.urdf"];
/// Endings of files of configuration.
const ENDINGS: [&str; 4] = ["toml", "urdf", "yaml", "yml"];
/// What editors and people append to the name of a copy.
const COPIES: [&str; 5] = [".bak", ".old", ".orig", ".save", "~"];
/// A top-level key that is only in a file of a kind that the user names on the command line: a lesson, a campaign,
/// faults of mock buses, another robot's `leo.toml`, and the report of a commissioning.
const OTHER_KINDS: [&[&str]; 5] = [
    &["demonstration", "teacher"],
    &["bus", "percepts", "processes"],
    &["faults"],
    &["supervisor"],
    &["trial", "begun"],
];
/// Number of files of a folder that are looked at: a folder of configuration has few.
const MAX_FILES: usize = 1000;

/// The files of the folder of `leo` (a `leo.toml`) that nothing reads, by name.
pub(crate) fn unread(leo: &Path) -> Vec<UnreadFile> {
    let folder = leo.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or_else(|| ".".as_ref());
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let is_there = |name: &str| leo.with_file_name(name).symlink_metadata().is_ok();
    let mut files: Vec<UnreadFile> = entries
        .flatten()
        .take(MAX_FILES)
        .filter(|entry| entry.path().is_file() && Some(entry.file_name().as_os_str()) != leo.file_name())
        .filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            if SIBLINGS.contains(&name.as_str()) || name == "leo.toml" {
                return None;
            }
            // A copy beside its original is no mistake.
            let copied = original(&name).filter(|sibling| !is_there(sibling));
            let meant = nearest(&name).or(copied);
            let is_configuration =
                ENDINGS.iter().any(|ending| name.to_lowercase().ends_with(&format!(".{ending}")));
            let is_unread = meant.is_some() || is_configuration && !is_of_other_kind(&entry.path());
            is_unread.then(|| UnreadFile {
                path: leo.with_file_name(&name),
                meant,
                is_meant_there: meant.is_some_and(is_there),
            })
        })
        .collect();
    files.sort_by(|a, b| a.path.cmp(&b.path));
    files
}

/// The sibling whose name a file's name resembles: another spelling, another ending, or upper case.
fn nearest(name: &str) -> Option<&'static str> {
    let lower = name.to_lowercase();
    let bare = [".txt", ".xml"].iter().find_map(|ending| lower.strip_suffix(ending)).unwrap_or(&lower);
    let near = SIBLINGS.into_iter().map(|sibling| (strsim::damerau_levenshtein(bare, sibling), sibling));
    let of_siblings = near.min().filter(|(distance, sibling)| {
        let stem = sibling.split('.').next().unwrap_or("").chars().count();
        *distance <= ((stem + 1) / 3).max(1)
    });
    let urdf = || bare.ends_with(".urdf").then_some("leo.urdf");
    of_siblings.map(|(_, sibling)| sibling).or_else(urdf)
}

/// The sibling that a file is a copy of, by its name.
fn original(name: &str) -> Option<&'static str> {
    let bare = COPIES.iter().find_map(|ending| name.strip_suffix(ending))?;
    SIBLINGS.into_iter().find(|sibling| *sibling == bare)
}

/// Whether a file is of a kind that is named on the command line, or is no TOML that could be recognised.
fn is_of_other_kind(file: &Path) -> bool {
    let Some(table) = budget::text(file).ok().and_then(|text| text.parse::<toml::Table>().ok()) else {
        // The command that reads it says what is wrong.
        return true;
    };
    OTHER_KINDS.iter().any(|keys| keys.iter().any(|key| table.contains_key(*key)))
        && !SIBLINGS_KEYS.iter().any(|key| table.contains_key(*key))
}

/// A top-level key of the files that are read beside `leo.toml`, which no other kind has.
const SIBLINGS_KEYS: [&str; 2] = ["joint", "threshold"];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::builtin;

    #[test]
    fn a_misspelt_name_is_recognised_and_another_one_is_not() {
        for (name, meant) in [
            ("motors.toml", "motor.toml"),
            ("moter.toml", "motor.toml"),
            ("Motor.toml", "motor.toml"),
            ("motor.tml", "motor.toml"),
            ("motor.toml.txt", "motor.toml"),
            ("percept.toml", "percepts.toml"),
            ("perception.toml", "percepts.toml"),
            ("perspectives.toml", "perspective.toml"),
            ("persepctive.toml", "perspective.toml"),
            ("robot.urdf", "leo.urdf"),
            ("leo.urfd", "leo.urdf"),
            ("motor.yaml", "motor.toml"),
        ] {
            assert_eq!(nearest(name), Some(meant), "{name}");
        }
        for name in ["lesson.toml", "sensor.toml", "notes.md", "motor.toml.old", "leo2.toml", "camera.toml"] {
            assert_eq!(nearest(name), None, "{name}");
        }
    }

    #[test]
    fn files_that_something_reads_are_not_named() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("robot.toml", builtin::LEO);
        write("other.toml", builtin::LEO);
        write("percepts.toml", builtin::PERCEPTS);
        write("lesson.toml", crate::lesson::STUDY[0]);
        write("campaign.toml", "processes = []\n");
        write("faults.toml", "faults = []\n");
        write("trace.jsonl", "");
        let leo = folder.path().join("robot.toml");
        assert_eq!(unread(&leo), []);
        write("motors.toml", builtin::MOTOR);
        write("percept.toml", "");
        write("camera.toml", "rate = 5\n");
        let said: Vec<String> = unread(&leo).iter().map(ToString::to_string).collect();
        let place = folder.path().display();
        assert_eq!(
            said,
            [
                format!("{place}/camera.toml is read by nothing"),
                format!("{place}/motors.toml is read by nothing; did you mean motor.toml?"),
                format!("{place}/percept.toml is read by nothing; percepts.toml beside it is read"),
            ]
        );
    }
}

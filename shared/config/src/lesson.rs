//! `lessons/*.toml`: a lesson teaches one task by demonstrations, and sets up the novel objects on which the robot then
//! performs it. `docs/lessons.md` describes the format.
//!
//! The types here describe a checked lesson: names are resolved to indices, headings are in radians, and an object's
//! position is that of its centre. Coordinates are metres in the world frame, z up, with the table's top at z = 0.

mod check;
mod library;
mod needs;
mod raw;
mod synthetic;
#[cfg(test)]
mod task1_tests;
#[cfg(test)]
mod tests;
mod written;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use settings::SettingsError;

pub use library::{LIBRARY, STUDY};
pub use needs::Needs;

/// A checked lesson.
#[derive(Clone, Debug, PartialEq)]
pub struct Lesson {
    /// Its title.
    pub title: String,
    /// What to watch for, in two or three sentences.
    pub watch: String,
    /// The settings of `leo.toml` that it needs.
    pub needs: Needs,
    /// Seed of the sensor noise.
    pub seed: u64,
    /// The pose of the robot's base.
    pub robot: UprightPose,
    /// The teachers, in the order of the file.
    pub teachers: Vec<Teacher>,
    /// The noise of the robot's sensors.
    pub noise: Noise,
    /// The timing of setting the table.
    pub table_timing: TableTiming,
    /// The named kinds of objects.
    pub kinds: BTreeMap<String, ObjectKind>,
    /// The named colours, linear red, green and blue in [0, 1].
    pub colours: BTreeMap<String, [f64; 3]>,
    /// The demonstrations.
    pub demonstrations: Vec<Table>,
    /// The objects on which the robot performs; `None` if it does not perform.
    pub novel: Option<Table>,
}

/// A position and a heading in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UprightPose {
    /// Position, in metres.
    pub position_m: [f64; 3],
    /// Heading, anticlockwise from the world's x axis, in radians.
    pub heading_rad: f64,
}

/// A teacher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teacher {
    /// The partner number, from 1.
    pub number: u16,
    /// The position of the eyes, in metres.
    pub eyes_m: [f64; 3],
    /// The point that the teacher looks at when the lesson begins, in metres.
    pub looks_at_m: [f64; 3],
}

/// The noise of the robot's sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of an observed position along each axis, in metres.
    pub position_sd_m: f64,
    /// Confidence of every observation, in [0, 1].
    pub confidence: f64,
}

/// The timing of setting the table before each demonstration and before the novel set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableTiming {
    /// How long the table is empty between two tables, at least `occluders_first`.
    pub empty: Duration,
    /// How long the occluders stand before the objects appear.
    pub occluders_first: Duration,
    /// How long a demonstration stays after the end of its last step.
    pub keep: Duration,
}

/// The objects on the table, and the script.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// The objects, in the order of the file.
    pub objects: Vec<Object>,
    /// The boxes that block the teachers' view.
    pub occluders: Vec<Occluder>,
    /// The owners of regions of the table.
    pub territory: Vec<Territory>,
    /// The steps, in chronological order.
    pub script: Vec<Step>,
}

/// An object.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name, unique within the table.
    pub name: String,
    /// Its kind.
    pub kind: ObjectKind,
    /// Colour, linear red, green and blue in [0, 1].
    pub colour_rgb: [f64; 3],
    /// Its initial pose; the position is that of its centre.
    pub place: UprightPose,
}

/// A kind of object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectKind {
    /// Its role.
    pub role: Role,
    /// How elongated, flat, round and tapered it is, each in [0, 1].
    pub shape: [f64; 4],
    /// Half its extents along its own axes, in metres.
    pub half_extents_m: [f64; 3],
    /// Whether it has a hole in the middle of its top that takes a peg.
    pub hole: bool,
    /// Whether it can carry a marker.
    pub markable: bool,
}

/// The role of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// It is worked on.
    Block,
    /// It fits into a hole.
    Peg,
    /// It marks the object that it is put onto.
    Marker,
}

/// A box that blocks the view, its sides along the world's axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Occluder {
    /// Its name, unique within the table.
    pub name: String,
    /// Its centre, in metres.
    pub centre_m: [f64; 3],
    /// Half its extents, in metres.
    pub half_extents_m: [f64; 3],
}

/// A region of the table and its owner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Territory {
    /// The owner: 0 for the robot, n for partner n.
    pub owner: u16,
    /// The corner with the smaller coordinates, x and y in metres.
    pub from_m: [f64; 2],
    /// The opposite corner.
    pub to_m: [f64; 2],
}

/// An action of a teacher.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Its start, relative to the moment at which the objects are on the table.
    pub at: Duration,
    /// The partner number of the actor.
    pub who: u16,
    /// The action.
    pub act: Act,
}

/// The action of a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// The teacher speaks.
    Say(String),
    /// The teacher moves an object and holds it throughout.
    Move {
        /// The object: its index in the table.
        object: usize,
        /// The destination.
        to: Destination,
        /// The duration.
        takes: Duration,
    },
    /// The teacher turns their eyes to a point.
    Look {
        /// The point, in metres.
        at_m: [f64; 3],
        /// The duration.
        takes: Duration,
    },
    /// The teacher moves their head and keeps looking at the same point.
    Walk {
        /// The new position of the eyes, in metres.
        eyes_m: [f64; 3],
        /// The duration.
        takes: Duration,
    },
    /// The teacher pushes an occluder along the table.
    Slide {
        /// The occluder: its index in the table.
        occluder: usize,
        /// The new position of its centre, in metres.
        centre_m: [f64; 3],
        /// The duration.
        takes: Duration,
    },
    /// The teacher leaves.
    Leave,
    /// The teacher returns to the former position.
    Return,
}

impl Role {
    /// Its name in lesson files.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Block => "block",
            Self::Peg => "peg",
            Self::Marker => "marker",
        }
    }
}

impl Act {
    /// Its duration; zero for instantaneous actions.
    #[must_use]
    pub const fn takes(&self) -> Duration {
        match self {
            Self::Move { takes, .. }
            | Self::Look { takes, .. }
            | Self::Walk { takes, .. }
            | Self::Slide { takes, .. } => *takes,
            Self::Say(_) | Self::Leave | Self::Return => Duration::ZERO,
        }
    }
}

/// The destination of a moved object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Destination {
    /// Into the hole of an object, given by its index in the table.
    Hole(usize),
    /// Onto the top of an object, given by its index in the table. A marker marks it.
    Top(usize),
    /// To a pose of its centre.
    UprightPose(UprightPose),
}

impl Lesson {
    /// Reads and checks a lesson.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is not TOML, has an unknown or missing key, a value out of range, or inconsistent
    /// parts.
    pub fn load(file: &Path) -> Result<Self, SettingsError> {
        Self::parse(&crate::text(file)?, file)
    }

    /// Checks the text of a lesson; errors name it as `file`.
    ///
    /// # Errors
    ///
    /// As [`Lesson::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, SettingsError> {
        let raw: raw::Lesson = settings::parse(text, file)?;
        check::lesson(raw).map_err(|error| error.of(text, file))
    }

    /// Finds a lesson by name: a built-in one, otherwise `NAME.toml` in a folder.
    ///
    /// # Errors
    ///
    /// As [`Lesson::load`].
    pub fn named(name: &str, folder: &Path) -> Result<Self, SettingsError> {
        let file = PathBuf::from(format!("{name}.toml"));
        match LIBRARY.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Self::parse(text, &file),
            // Only the file name is used, so a name cannot point outside the folder.
            None => Self::load(&folder.join(file.file_name().unwrap_or_default())),
        }
    }

    /// The built-in lesson: Task 1 of the paper.
    #[must_use]
    pub fn builtin() -> Self {
        #[expect(clippy::expect_used, reason = "the text is part of the program, and a test parses it")]
        Self::parse(library::TASK_1, Path::new("config/lessons/task1.toml"))
            .expect("the built-in lesson is sound")
    }

    /// How often the robot is told to perform.
    #[must_use]
    pub fn performances(&self) -> u32 {
        let orders = self.tables().flat_map(|table| &table.script).filter(|step| match &step.act {
            Act::Say(text) => is_order(text),
            Act::Move { .. }
            | Act::Look { .. }
            | Act::Walk { .. }
            | Act::Slide { .. }
            | Act::Leave
            | Act::Return => false,
        });
        u32::try_from(orders.count()).unwrap_or(u32::MAX)
    }

    /// How many sentences the script contains.
    #[must_use]
    pub fn sentences(&self) -> u32 {
        let said =
            self.tables().flat_map(|table| &table.script).filter(|step| matches!(step.act, Act::Say(_)));
        u32::try_from(said.count()).unwrap_or(u32::MAX)
    }

    /// All tables: the demonstrations, then the novel set.
    pub fn tables(&self) -> impl Iterator<Item = &Table> {
        self.demonstrations.iter().chain(&self.novel)
    }
}

/// Whether a sentence orders the robot to perform, as in "Leo, do task 1". It must begin with the words "leo" and "do";
/// case and punctuation do not matter.
#[must_use]
pub fn is_order(text: &str) -> bool {
    let mut words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    let mut next_is = |wanted: &str| words.next().is_some_and(|word| word.eq_ignore_ascii_case(wanted));
    next_is("leo") && next_is("do")
}

//! `lessons/*.toml`: a lesson is a file that teaches one task by showing, and the novel set on
//! which the robot then performs it. `docs/lessons.md` describes the format.
//!
//! The types here are a lesson that was checked: every name has become an index, every heading
//! radians, every object stands where its centre is. Coordinates are metres in the world, z up,
//! the table's top at z = 0.

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

use crate::{ConfigError, load};

pub use library::{LIBRARY, STUDY};
pub use needs::Needs;

/// A lesson that was checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Lesson {
    /// What it is called.
    pub title: String,
    /// What to watch, in two sentences or three.
    pub watch: String,
    /// What settings it needs for that.
    pub needs: Needs,
    /// Seed of the noise.
    pub seed: u64,
    /// Where the robot's base stands.
    pub robot: Place,
    /// The teachers, in the order of the file.
    pub teachers: Vec<Teacher>,
    /// What the robot's eyes add to the truth.
    pub noise: Noise,
    /// How the table is laid.
    pub laying: Laying,
    /// The kinds of objects that it names.
    pub kinds: BTreeMap<String, Kind>,
    /// The colours that it names, linear red, green and blue in [0, 1].
    pub colours: BTreeMap<String, [f64; 3]>,
    /// The showings.
    pub demonstrations: Vec<Table>,
    /// The objects on which the robot performs, if it shall.
    pub novel: Option<Table>,
}

/// A place and a heading in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position, in metres.
    pub position_m: [f64; 3],
    /// Heading, anticlockwise from the world's x axis, in radians.
    pub heading_rad: f64,
}

/// Somebody who teaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teacher {
    /// Which partner he is, from 1.
    pub number: u16,
    /// Where his eyes are, in metres.
    pub eyes_m: [f64; 3],
    /// Where he looks when the lesson begins, in metres.
    pub looks_at_m: [f64; 3],
}

/// What the robot's eyes add to the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of an observed position along each axis, in metres.
    pub position_sigma_m: f64,
    /// Confidence of every observation, in [0, 1].
    pub confidence: f64,
}

/// How the table is laid before a demonstration and before the novel set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Laying {
    /// How long the table lies empty between two settings, at least as long as
    /// `occluders_first`.
    pub empty: Duration,
    /// How long the occluders of a setting stand before its objects lie.
    pub occluders_first: Duration,
    /// How long a demonstration stays after its last step has ended.
    pub keep: Duration,
}

/// What lies on the table, and what happens there.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The objects, in the order of the file.
    pub objects: Vec<Object>,
    /// What hides things from the teachers.
    pub occluders: Vec<Occluder>,
    /// Whose the regions of the table are.
    pub territory: Vec<Territory>,
    /// What happens, in the order of time.
    pub script: Vec<Step>,
}

/// An object.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name within the table.
    pub name: String,
    /// What kind of thing it is.
    pub kind: Kind,
    /// Colour, linear red, green and blue in [0, 1].
    pub colour_rgb: [f64; 3],
    /// Where its centre lies at first.
    pub place: Place,
}

/// A kind of object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// What it is for.
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

/// What an object is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// To be worked on.
    Block,
    /// To be put into a hole.
    Peg,
    /// To mark what it is put onto.
    Marker,
}

/// A box that hides what lies behind it, its sides along the world's axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Occluder {
    /// Its name within the table.
    pub name: String,
    /// Its centre, in metres.
    pub centre_m: [f64; 3],
    /// Half its extents, in metres.
    pub half_extents_m: [f64; 3],
}

/// A region of the table and whose it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Territory {
    /// The agent: 0 the robot, n partner n.
    pub owner: u16,
    /// Corner of the region with the lesser coordinates, x and y in metres.
    pub from_m: [f64; 2],
    /// The corner opposite.
    pub to_m: [f64; 2],
}

/// Something that somebody does.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// When it begins, counted from when the objects lie there.
    pub at: Duration,
    /// Which partner does it.
    pub who: u16,
    /// What he does.
    pub act: Act,
}

/// What a teacher does in a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// He says something.
    Say(String),
    /// He moves an object, holding it all the while.
    Move {
        /// The object: its index in the table.
        object: usize,
        /// Where to.
        to: Destination,
        /// How long it takes.
        takes: Duration,
    },
    /// He turns his eyes to a point.
    Look {
        /// The point, in metres.
        at_m: [f64; 3],
        /// How long it takes.
        takes: Duration,
    },
    /// He moves his head, and what he looks at stays the same.
    Walk {
        /// Where his eyes will be, in metres.
        eyes_m: [f64; 3],
        /// How long it takes.
        takes: Duration,
    },
    /// He pushes an occluder about on the table.
    Slide {
        /// The occluder: its index in the table.
        occluder: usize,
        /// Where its centre will be, in metres.
        centre_m: [f64; 3],
        /// How long it takes.
        takes: Duration,
    },
    /// He goes away.
    Leave,
    /// He comes back to where he was.
    Return,
}

impl Role {
    /// Its word, as lessons write it.
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
    /// How long it takes.
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

/// Where an object is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Destination {
    /// Into the hole of an object: its index in the table.
    Hole(usize),
    /// Onto the top of an object: its index in the table. A marker marks it.
    Top(usize),
    /// To a place of its centre.
    Place(Place),
}

impl Lesson {
    /// Reads and checks a lesson.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is no TOML, has a key that is unknown or missing, a value out of
    /// its range, or parts that contradict each other.
    pub fn load(file: &Path) -> Result<Self, ConfigError> {
        Self::parse(&load::text(file)?, file)
    }

    /// Checks the text of a lesson; `file` is what errors call it.
    ///
    /// # Errors
    ///
    /// As [`Lesson::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, ConfigError> {
        let raw: raw::Lesson = load::parse(text, file)?;
        check::lesson(raw).map_err(|fault| load::invalid(text, file, fault.span, fault.reason))
    }

    /// The lesson of a name: one that the program carries, or else one that was written down in a
    /// folder, as `NAME.toml`.
    ///
    /// # Errors
    ///
    /// As [`Lesson::load`].
    pub fn named(name: &str, folder: &Path) -> Result<Self, ConfigError> {
        let file = PathBuf::from(format!("{name}.toml"));
        match LIBRARY.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => Self::parse(text, &file),
            // A name is the name of a file there, and not a way out of the folder.
            None => Self::load(&folder.join(file.file_name().unwrap_or_default())),
        }
    }

    /// The lesson that the program carries: Task 1 of the paper.
    #[must_use]
    pub fn builtin() -> Self {
        #[expect(clippy::expect_used, reason = "the text is part of the program, and a test parses it")]
        Self::parse(library::TASK_1, Path::new("config/lessons/task1.toml"))
            .expect("the built-in lesson is sound")
    }

    /// How many times somebody tells the robot to do something: how often it shall perform.
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

    /// How many sentences are said in it.
    #[must_use]
    pub fn sentences(&self) -> u32 {
        let said =
            self.tables().flat_map(|table| &table.script).filter(|step| matches!(step.act, Act::Say(_)));
        u32::try_from(said.count()).unwrap_or(u32::MAX)
    }

    /// The demonstrations and then the novel set.
    pub fn tables(&self) -> impl Iterator<Item = &Table> {
        self.demonstrations.iter().chain(&self.novel)
    }
}

/// Whether a sentence tells the robot to do something: "Leo, do task 1": the words "leo" and "do" begin it,
/// however they are punctuated.
#[must_use]
pub fn is_order(text: &str) -> bool {
    let mut words = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    let mut next_is = |wanted: &str| words.next().is_some_and(|word| word.eq_ignore_ascii_case(wanted));
    next_is("leo") && next_is("do")
}

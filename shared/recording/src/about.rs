use std::collections::BTreeMap;
use std::path::Path;

use config::lesson::Lesson;
use config::{ConfigError, Files, Robot};
use geometry::{Base, Pose, World};

/// What time it was for the robot that was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Time {
    /// Simulated: every frame is there, in the order of the turns.
    Lockstep,
    /// The machine's.
    Wall,
}

impl Time {
    const ALL: [Self; 2] = [Self::Lockstep, Self::Wall];

    /// As it stands in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lockstep => "lockstep",
            Self::Wall => "wall",
        }
    }
}

/// What is known of the robot that is recorded.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Its configuration.
    pub robot: Robot,
    /// The files of its configuration by their names, which the recording holds.
    pub files: Vec<(&'static str, String)>,
    /// What time it is for it.
    pub time: Time,
    /// Partners whose perspective it takes.
    pub partners: u32,
    /// Where it stands in the room.
    pub x_world_base: Pose<World, Base>,
    /// The program that records, with its version.
    pub program: String,
}

impl Subject {
    /// The robot that a `leo.toml` describes, or the built-in one.
    ///
    /// # Errors
    ///
    /// The configuration cannot be read, or something in it is wrong.
    pub fn load(
        leo: Option<&Path>,
        time: Time,
        partners: Option<u32>,
        x_world_base: Pose<World, Base>,
        program: &str,
    ) -> Result<Self, ConfigError> {
        Self::of(&Files::read(leo)?, time, partners, x_world_base, program)
    }

    /// The robot that files describe.
    ///
    /// # Errors
    ///
    /// Something in them is wrong.
    pub fn of(
        files: &Files,
        time: Time,
        partners: Option<u32>,
        x_world_base: Pose<World, Base>,
        program: &str,
    ) -> Result<Self, ConfigError> {
        let robot = Robot::of(files)?;
        let partners = partners.unwrap_or(robot.leo.belief.partners);
        let (files, program) = (files.texts().to_vec(), program.to_owned());
        Ok(Self { robot, files, time, partners, x_world_base, program })
    }
}

/// Where a robot stands in the room of a lesson.
#[must_use]
pub fn stands(lesson: &Lesson) -> Pose<World, Base> {
    let [x, y, z] = lesson.robot.position_m;
    Pose::upright(x, y, z, lesson.robot.heading_rad)
}

/// The name of the record that says what a recording is of.
pub(crate) const ABOUT: &str = "leo";

/// What a recording says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// What time it was for the robot.
    pub time: Time,
    /// Partners whose perspective it took.
    pub partners: u32,
    /// The program that recorded, with its version.
    pub program: String,
    /// Where the robot stood in the room: position in metres, then a quaternion `[x, y, z, w]`.
    stood: [f64; 7],
}

impl About {
    pub(crate) fn of(subject: &Subject) -> Self {
        let [x, y, z] = subject.x_world_base.position_m();
        let [i, j, k, w] = subject.x_world_base.orientation_xyzw();
        let Subject { time, partners, .. } = *subject;
        Self { time, partners, program: subject.program.clone(), stood: [x, y, z, i, j, k, w] }
    }

    /// Where the robot stood in the room; the origin where the numbers are no pose.
    #[must_use]
    pub fn x_world_base(&self) -> Pose<World, Base> {
        let [x, y, z, i, j, k, w] = self.stood;
        Pose::from_parts([x, y, z], [i, j, k, w]).unwrap_or_else(Pose::identity)
    }

    pub(crate) fn written(&self) -> BTreeMap<String, String> {
        let stood: Vec<String> = self.stood.iter().map(ToString::to_string).collect();
        let entries = [
            ("time", self.time.name().to_owned()),
            ("partners", self.partners.to_string()),
            ("program", self.program.clone()),
            ("base_in_world", stood.join(" ")),
        ];
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// What such a record says; the reason where it says nothing that is understood.
    pub(crate) fn read(written: &BTreeMap<String, String>) -> Result<Self, String> {
        let get =
            |key: &str| written.get(key).ok_or_else(|| format!("`{key}` is not in its record `{ABOUT}`"));
        let time = get("time")?;
        let time = Time::ALL.into_iter().find(|known| known.name() == time);
        let time = time.ok_or("its `time` is neither `lockstep` nor `wall`")?;
        let partners = get("partners")?.parse().map_err(|_no_number| "its `partners` are no number")?;
        let stood: Vec<f64> =
            get("base_in_world")?.split(' ').filter_map(|number| number.parse().ok()).collect();
        let stood = stood.try_into().map_err(|_other| "its `base_in_world` are not seven numbers")?;
        Ok(Self { time, partners, program: get("program")?.clone(), stood })
    }
}

use std::collections::BTreeMap;
use std::path::Path;

use config::lesson::Lesson;
use config::{Files, Robot, SettingsError};
use geometry::{Base, Pose, World};

/// The time base of the recorded robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Time {
    /// Simulated time in lockstep: no frame is missing, and their order is that of the processes' turns.
    Lockstep,
    /// Wall-clock time.
    Wall,
}

impl Time {
    const ALL: [Self; 2] = [Self::Lockstep, Self::Wall];

    /// The name in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lockstep => "lockstep",
            Self::Wall => "wall",
        }
    }
}

/// The robot to record.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Its configuration.
    pub robot: Robot,
    /// The files of its configuration by their names; they are attached to the recording.
    pub files: Vec<(&'static str, String)>,
    /// Its time base.
    pub time: Time,
    /// Number of partners whose perspective it takes.
    pub partners: u32,
    /// Pose of its base in the room.
    pub x_world_base: Pose<World, Base>,
    /// The recording program, with its version.
    pub program: String,
}

impl Subject {
    /// The robot of a `leo.toml`, or the built-in one.
    ///
    /// # Errors
    ///
    /// The configuration cannot be read, or is invalid.
    pub fn load(
        leo: Option<&Path>,
        time: Time,
        partners: Option<u32>,
        x_world_base: Pose<World, Base>,
        program: &str,
    ) -> Result<Self, SettingsError> {
        Self::of(&Files::read(leo)?, time, partners, x_world_base, program)
    }

    /// The robot of the given configuration files.
    ///
    /// # Errors
    ///
    /// The configuration is invalid.
    pub fn of(
        files: &Files,
        time: Time,
        partners: Option<u32>,
        x_world_base: Pose<World, Base>,
        program: &str,
    ) -> Result<Self, SettingsError> {
        let robot = Robot::of(files)?;
        let partners = partners.unwrap_or(robot.leo.belief.partners);
        let (files, program) = (files.texts().to_vec(), program.to_owned());
        Ok(Self { robot, files, time, partners, x_world_base, program })
    }
}

/// Pose of the robot in the room of a lesson.
#[must_use]
pub fn robot_pose(lesson: &Lesson) -> Pose<World, Base> {
    let [x, y, z] = lesson.robot.position_m;
    Pose::upright(x, y, z, lesson.robot.heading_rad)
}

/// Name of the metadata record that describes the recording.
pub(crate) const ABOUT: &str = "leo";

/// The description of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The robot's time base.
    pub time: Time,
    /// Number of partners whose perspective it took.
    pub partners: u32,
    /// The recording program, with its version.
    pub program: String,
    /// Pose of the robot in the room: position in metres, then a quaternion `[x, y, z, w]`.
    base_in_world: [f64; 7],
}

impl About {
    pub(crate) fn of(subject: &Subject) -> Self {
        let [x, y, z] = subject.x_world_base.position_m();
        let [i, j, k, w] = subject.x_world_base.orientation_xyzw();
        let Subject { time, partners, .. } = *subject;
        Self { time, partners, program: subject.program.clone(), base_in_world: [x, y, z, i, j, k, w] }
    }

    /// Pose of the robot's base in the room; identity if the stored numbers are no valid pose.
    #[must_use]
    pub fn x_world_base(&self) -> Pose<World, Base> {
        let [x, y, z, i, j, k, w] = self.base_in_world;
        Pose::from_parts([x, y, z], [i, j, k, w]).unwrap_or_else(Pose::identity)
    }

    pub(crate) fn written(&self) -> BTreeMap<String, String> {
        let base_in_world: Vec<String> = self.base_in_world.iter().map(ToString::to_string).collect();
        let entries = [
            ("time", self.time.name().to_owned()),
            ("partners", self.partners.to_string()),
            ("program", self.program.clone()),
            ("base_in_world", base_in_world.join(" ")),
        ];
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// Parses the metadata record.
    pub(crate) fn read(written: &BTreeMap<String, String>) -> Result<Self, String> {
        let get =
            |key: &str| written.get(key).ok_or_else(|| format!("`{key}` is not in its record `{ABOUT}`"));
        let time = get("time")?;
        let time = Time::ALL.into_iter().find(|known| known.name() == time);
        let time = time.ok_or("its `time` is neither `lockstep` nor `wall`")?;
        let partners = get("partners")?.parse().map_err(|_no_number| "its `partners` are no number")?;
        let base_in_world: Vec<f64> =
            get("base_in_world")?.split(' ').filter_map(|number| number.parse().ok()).collect();
        let base_in_world =
            base_in_world.try_into().map_err(|_other| "its `base_in_world` are not seven numbers")?;
        Ok(Self { time, partners, program: get("program")?.clone(), base_in_world })
    }
}

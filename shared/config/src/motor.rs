//! `motor.toml`: the servo buses and the joints on them.
//!
//! A joint's index, its number in every message, is its position in the file.

use std::f64::consts::PI;
use std::path::Path;

use serde::Deserialize;
use servo::Model;
use settings::number::{Finite, Positive};
use settings::{SettingsError, Spanned, SpannedError, error_at, parse as parse_toml};

/// The supported baud rates, in bits per second: those of X-series servos from 1 Mbit/s up.
const BAUDS: [u32; 5] = [1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000];
/// The highest servo ID; 253 and 255 are reserved, and 254 is the broadcast ID.
const MAX_ID: u8 = 252;

/// The content of `motor.toml`, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// The buses.
    pub buses: Vec<Bus>,
    /// The joints; a joint's index here is its index everywhere.
    pub joints: Vec<Joint>,
    /// The names of the groups, in the order in which their torque is enabled: by the first joint of each group in the
    /// file.
    pub groups: Vec<String>,
}

/// A half-duplex bus of servos.
#[derive(Clone, Debug, PartialEq)]
pub struct Bus {
    /// Its name, unique in the file.
    pub name: String,
    /// The device.
    pub device: Device,
    /// Baud rate, in bits per second.
    pub baud: u32,
}

/// The device of a bus.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(from = "String")]
pub enum Device {
    /// The mock servo bus of this robot.
    Mock,
    /// A serial port.
    Tty(std::path::PathBuf),
}

impl From<String> for Device {
    fn from(device: String) -> Self {
        if device == "mock" { Self::Mock } else { Self::Tty(device.into()) }
    }
}

/// A joint and its servo. The servo angle is `sign` × joint + `offset_rad`; the servo's zero is the middle of its
/// range.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name, unique in the file and the same as in the URDF.
    pub name: String,
    /// The index of its bus.
    pub bus: usize,
    /// The servo's ID, unique on its bus.
    pub id: u8,
    /// The servo model.
    pub model: Model,
    /// Whether the servo turns in the opposite direction of the joint.
    pub reversed: bool,
    /// Servo angle at the joint's zero, in radians.
    pub offset_rad: f64,
    /// Lower position limit, in radians.
    pub min_rad: f64,
    /// Upper position limit, in radians.
    pub max_rad: f64,
    /// Velocity limit, in radians per second.
    pub max_velocity_rad_s: f64,
    /// Acceleration limit, in radians per second squared.
    pub max_acceleration_rad_s2: f64,
    /// The index of its group; the torque of a group's joints is enabled together.
    pub group: usize,
    /// Rest position, in radians; after some alerts the joint moves there before its torque goes off.
    pub rest_rad: f64,
    /// Maximum distance from its command, in radians; if absent, `leo.toml` decides.
    pub max_tracking_error_rad: Option<f64>,
}

impl Joint {
    /// The servo angle for a joint position, in radians from the middle of the servo's range.
    #[must_use]
    pub fn servo_rad(&self, joint_rad: f64) -> f64 {
        if self.reversed { self.offset_rad - joint_rad } else { self.offset_rad + joint_rad }
    }

    /// The joint position for a servo angle; the inverse of [`servo_rad`](Self::servo_rad).
    #[must_use]
    pub fn joint_rad(&self, servo_rad: f64) -> f64 {
        if self.reversed { self.offset_rad - servo_rad } else { servo_rad - self.offset_rad }
    }
}

/// A limit of a joint, named after its key in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// `min_rad`.
    Min,
    /// `max_rad`.
    Max,
    /// `max_velocity_rad_s`.
    Velocity,
}

impl Limit {
    /// All limits.
    pub const ALL: [Self; 3] = [Self::Min, Self::Max, Self::Velocity];

    /// Its key.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Min => "min_rad",
            Self::Max => "max_rad",
            Self::Velocity => "max_velocity_rad_s",
        }
    }

    /// Its value for a joint, in radians or radians per second.
    #[must_use]
    pub const fn of(self, joint: &Joint) -> f64 {
        match self {
            Self::Min => joint.min_rad,
            Self::Max => joint.max_rad,
            Self::Velocity => joint.max_velocity_rad_s,
        }
    }
}

/// An error about a joint limit, for checks against another file. `text` is that of `motor.toml`; the error names it as
/// `file`.
#[must_use]
pub fn limit_error(text: &str, file: &Path, joint: &str, limit: Limit, reason: String) -> SettingsError {
    let raw: RawMotor = match parse_toml(text, file) {
        Ok(raw) => raw,
        Err(error) => return error,
    };
    let found = raw.joint.iter().find(|other| other.name.get_ref() == joint);
    let span = found.map_or(0..0, |found| match limit {
        Limit::Min => found.min_rad.span(),
        Limit::Max => found.max_rad.span(),
        Limit::Velocity => found.max_velocity_rad_s.span(),
    });
    error_at(text, file, span, reason)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMotor {
    bus: Vec<RawBus>,
    joint: Vec<RawJoint>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBus {
    name: Spanned<String>,
    device: Device,
    baud: Spanned<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawJoint {
    name: Spanned<String>,
    bus: Spanned<String>,
    id: Spanned<u8>,
    model: Model,
    sign: Spanned<i8>,
    offset_rad: Spanned<Finite>,
    min_rad: Spanned<Finite>,
    max_rad: Spanned<Finite>,
    max_velocity_rad_s: Spanned<Positive>,
    max_acceleration_rad_s2: Positive,
    group: String,
    rest_rad: Option<Spanned<Finite>>,
    max_tracking_error_rad: Option<Positive>,
}

/// Reads and checks `motor.toml`.
///
/// # Errors
///
/// As [`crate::load`]; also an unknown bus, a duplicate name or servo, crossed limits, limits beyond half a turn of the
/// servo, or a velocity above the servo's maximum.
pub fn load(file: &Path) -> Result<Motor, SettingsError> {
    parse(&crate::text(file)?, file)
}

/// Checks the text of `motor.toml`; errors name it as `file`.
///
/// # Errors
///
/// As [`load`].
pub fn parse(text: &str, file: &Path) -> Result<Motor, SettingsError> {
    let raw: RawMotor = parse_toml(text, file)?;
    check(raw).map_err(|error| error.of(text, file))
}

fn check(raw: RawMotor) -> Result<Motor, SpannedError> {
    let mut motor = Motor { buses: Vec::new(), joints: Vec::new(), groups: Vec::new() };
    for bus in raw.bus {
        let (name, baud) = (bus.name.get_ref(), *bus.baud.get_ref());
        if name.is_empty() || !name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_') {
            let reason =
                format!("`{name}` cannot name a bus: use letters, digits and `_`, for it names a file");
            return Err(SpannedError::at(&bus.name, reason));
        }
        if motor.buses.iter().any(|other| other.name == *name) {
            return Err(SpannedError::at(
                &bus.name,
                format!("there are two buses named `{name}`; rename one"),
            ));
        }
        if !BAUDS.contains(&baud) {
            return Err(SpannedError::at(
                &bus.baud,
                format!(
                    "no servo supports {baud} baud: use one of {}",
                    BAUDS.map(|baud| baud.to_string()).join(", ")
                ),
            ));
        }
        motor.buses.push(Bus { name: bus.name.into_inner(), device: bus.device, baud });
    }
    for joint in raw.joint {
        let joint = check_joint(joint, &mut motor)?;
        motor.joints.push(joint);
    }
    Ok(motor)
}

fn check_joint(raw: RawJoint, motor: &mut Motor) -> Result<Joint, SpannedError> {
    let name = raw.name.get_ref();
    if motor.joints.iter().any(|other| other.name == *name) {
        return Err(SpannedError::at(&raw.name, format!("there are two joints named `{name}`; rename one")));
    }
    let Some(bus) = motor.buses.iter().position(|bus| bus.name == *raw.bus.get_ref()) else {
        let known: Vec<_> = motor.buses.iter().map(|bus| bus.name.as_str()).collect();
        let reason = format!("there is no bus `{}`; there are {}", raw.bus.get_ref(), known.join(", "));
        return Err(SpannedError::at(&raw.bus, reason));
    };
    if motor.buses.get(bus).is_some_and(|bus| bus.baud > raw.model.max_baud()) {
        let reason = format!("this servo supports at most {} baud", raw.model.max_baud());
        return Err(SpannedError::at(&raw.bus, reason));
    }
    let id = *raw.id.get_ref();
    if id > MAX_ID {
        return Err(SpannedError::at(
            &raw.id,
            format!("{id} is out of range: an id must be from 0 to {MAX_ID}"),
        ));
    }
    if let Some(other) = motor.joints.iter().find(|other| other.bus == bus && other.id == id) {
        let (bus, other) = (raw.bus.get_ref(), &other.name);
        return Err(SpannedError::at(
            &raw.id,
            format!("id {id} on bus `{bus}` belongs to `{other}` already"),
        ));
    }
    let reversed = match *raw.sign.get_ref() {
        1 => false,
        -1 => true,
        sign => return Err(SpannedError::at(&raw.sign, format!("a sign is 1 or -1, not {sign}"))),
    };
    let (min_rad, max_rad) = (raw.min_rad.get_ref().get(), raw.max_rad.get_ref().get());
    if min_rad >= max_rad {
        let reason = format!("the limits are crossed: min_rad {min_rad} must be below max_rad {max_rad}");
        return Err(SpannedError::at(&raw.max_rad, reason));
    }
    let (max_velocity_rad_s, max) = (raw.max_velocity_rad_s.get_ref().get(), raw.model.max_velocity_rad_s());
    if max_velocity_rad_s > max {
        let reason =
            format!("{max_velocity_rad_s} rad/s is faster than the servo, which turns at {max:.2} rad/s");
        return Err(SpannedError::at(&raw.max_velocity_rad_s, reason));
    }
    let group = motor.groups.iter().position(|group| *group == raw.group).unwrap_or_else(|| {
        motor.groups.push(raw.group.clone());
        motor.groups.len() - 1
    });
    let joint = Joint {
        bus,
        id,
        model: raw.model,
        reversed,
        offset_rad: raw.offset_rad.get_ref().get(),
        min_rad,
        max_rad,
        max_velocity_rad_s,
        max_acceleration_rad_s2: raw.max_acceleration_rad_s2.get(),
        group,
        // Defaults to the joint's zero, clamped to its limits.
        rest_rad: raw
            .rest_rad
            .as_ref()
            .map_or_else(|| 0.0_f64.clamp(min_rad, max_rad), |rest| rest.get_ref().get()),
        max_tracking_error_rad: raw.max_tracking_error_rad.map(Positive::get),
        name: raw.name.into_inner(),
    };
    if let Some(at) = raw.rest_rad.as_ref().filter(|_| !(min_rad..=max_rad).contains(&joint.rest_rad)) {
        let reason = format!(
            "the joint cannot rest at {} rad: its limits are {min_rad} and {max_rad}",
            joint.rest_rad
        );
        return Err(SpannedError::at(at, reason));
    }
    for (limit, at) in [(min_rad, &raw.min_rad), (max_rad, &raw.max_rad)] {
        let servo = joint.servo_rad(limit);
        // The upper end loses one count: a turn has 4096 counts, from 0 to 4095.
        if !(-PI..=PI * 2047.0 / 2048.0).contains(&servo) {
            let reason =
                format!("the servo would stand at {servo:.3} rad, beyond half a turn from its middle");
            return Err(SpannedError::at(at, reason));
        }
    }
    Ok(joint)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::assert_invalid;

    const TWO: &str = include_str!("motor_example.toml");

    fn refusal(from: &str, to: &str) -> SettingsError {
        assert!(TWO.contains(from), "the example has no `{from}`");
        parse(&TWO.replacen(from, to, 1), Path::new("m.toml")).unwrap_err()
    }

    #[test]
    fn the_example_is_read() {
        let motor = parse(TWO, Path::new("m.toml")).unwrap();
        assert_eq!((motor.buses.len(), motor.joints.len()), (2, 2));
        assert_eq!(motor.buses[0].device, Device::Mock);
        assert_eq!(motor.buses[1].device, Device::Tty("/dev/ttyUSB0".into()));
        assert_eq!(motor.groups, ["torso", "face"]);
        assert_eq!((motor.joints[1].bus, motor.joints[1].group), (1, 1));
        assert!(motor.joints[1].reversed);
    }

    #[test]
    fn servo_and_joint_angles_are_each_others_inverse() {
        let motor = parse(TWO, Path::new("m.toml")).unwrap();
        for joint in &motor.joints {
            assert!((joint.joint_rad(joint.servo_rad(0.3)) - 0.3).abs() < 1e-12);
        }
        assert!((motor.joints[1].servo_rad(0.3) - -0.2).abs() < 1e-12);
    }

    #[test]
    fn a_limit_that_another_file_contradicts_is_named_with_its_line() {
        let motor = parse(TWO, Path::new("m.toml")).unwrap();
        let [torso, jaw] = motor.joints.as_slice() else { panic!("two") };
        let mut seen = Vec::new();
        for (joint, limit) in Limit::ALL.map(|limit| (torso, limit)).into_iter().chain([(jaw, Limit::Max)]) {
            let line = TWO.lines().position(|line| {
                line.starts_with(limit.key()) && line.contains(&format!("{:?}", limit.of(joint)))
            });
            let reason = format!("`{}` is wrong", joint.name);
            let error = limit_error(TWO, Path::new("m.toml"), &joint.name, limit, reason).to_string();
            let expected = format!("m.toml:{}:", line.expect("it is in the file") + 1);
            assert!(
                error.starts_with(&expected) && error.ends_with("` is wrong"),
                "{error} is not at {expected}"
            );
            seen.push(expected);
        }
        seen.dedup();
        assert_eq!(seen.len(), 4, "{seen:?}");
    }

    #[test]
    fn a_contradictory_motor_file_is_refused_with_its_line() {
        let cases = [
            ("bus = \"torso\"", "bus = \"trunk\"", (16, 7), "trunk"),
            ("id = 1 ", "id = 253 ", (17, 6), "253"),
            ("sign = 1 ", "sign = 0 ", (19, 8), "0"),
            ("max_rad = 1.2", "max_rad = -1.2", (22, 11), "-1.2"),
            ("max_rad = 1.2", "max_rad = 3.2", (22, 11), "3.2"),
            ("max_velocity_rad_s = 2.0", "max_velocity_rad_s = 20.0", (23, 22), "20 rad/s"),
            ("max_velocity_rad_s = 2.0", "max_velocity_rad_s = nan", (23, 22), "NaN"),
            ("name = \"face\"", "name = \"torso\"", (10, 8), "torso"),
            ("name = \"face\"", "name = \"fa/ce\"", (10, 8), "fa/ce"),
            ("baud = 4000000", "baud = 4000001", (7, 8), "4000001"),
            ("name = \"jaw_pitch_joint\"", "name = \"torso_yaw_joint\"", (28, 8), "torso_yaw_joint"),
            ("bus = \"face\"", "bus = \"torso\"", (30, 6), "torso_yaw_joint"),
            ("baud = 2000000", "baud = 4500000", (29, 7), "4000000"),
            ("sign = 1 ", "sgn = 1 ", (19, 1), "`sign`?"),
            ("model = \"XM430-W350\"", "model = \"XL430-W250\"", (18, 9), "XL430-W250"),
            ("model = \"XM430-W350\"", "model = \"xm430-w210\"", (18, 9), "xm430-w210"),
            ("model = \"XM430-W350\"", "model = \"XM430-W35\"", (18, 9), "`XM430-W350`?"),
        ];
        let mut wording = String::new();
        for (from, to, place, word) in cases {
            let error = refusal(from, to);
            assert_invalid(&error, place, word);
            wording += &format!("{to}\n    {error}\n");
        }
        insta::assert_snapshot!(wording);
    }
}

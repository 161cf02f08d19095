//! The links and joints of a URDF, checked.
//!
//! Leo uses the tree of links, and the origins, axes and limits of joints. Of these, all that is needed must be there. The
//! rest may be incomplete: drawings, inertias, materials. But a number that is written must be a finite number everywhere,
//! since viewers and other readers of the URDF get it too. `<gazebo>`, `<transmission>` and unknown elements are skipped,
//! also in links and joints.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use crate::BodyError;
use crate::body_error::{BodyErrorKind, Place};
use crate::shown::shown;
use crate::xml::{Element, malformed};

/// No part of a robot is farther from the part that carries it. Larger numbers are millimetres, or a slip.
const MAX_PLACE_M: f64 = 10.0;

/// No angle is larger: beyond one turn, the number is in degrees, or a slip.
const MAX_ANGLE_RAD: f64 = 10.0;

/// The attributes that hold numbers, by the element.
const NUMBERS: [(&str, &[&str]); 16] = [
    ("origin", &["xyz", "rpy", "quat_xyzw"]),
    ("axis", &["xyz"]),
    ("limit", &["lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"]),
    ("mimic", &["multiplier", "offset"]),
    ("dynamics", &["damping", "friction"]),
    ("calibration", &["rising", "falling"]),
    ("safety_controller", &["soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"]),
    ("mass", &["value"]),
    ("inertia", &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]),
    ("box", &["size"]),
    ("cylinder", &["radius", "length"]),
    ("capsule", &["radius", "length"]),
    ("cone", &["radius", "length"]),
    ("sphere", &["radius"]),
    ("mesh", &["scale"]),
    ("color", &["rgba"]),
];

/// The attributes whose numbers are not negative, with their elements. Inertias are not among them: tools that compute
/// them write rounding errors, such as -5e-20.
const NOT_NEGATIVE: [(&str, &str); 10] = [
    ("limit", "effort"),
    ("limit", "velocity"),
    ("mass", "value"),
    ("box", "size"),
    ("cylinder", "radius"),
    ("cylinder", "length"),
    ("capsule", "radius"),
    ("capsule", "length"),
    ("sphere", "radius"),
    ("dynamics", "damping"),
];

/// The elements without numbers of their own that hold elements with numbers.
const CONTAINERS: [&str; 5] = ["visual", "collision", "inertial", "geometry", "material"];

/// The children of which a joint has one at most.
const SINGLE: [&str; 6] = ["origin", "parent", "child", "axis", "limit", "mimic"];

/// The types of joints.
const TYPES: [&str; 7] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];

/// The links and joints of a URDF, in its order.
#[derive(Clone, Debug)]
pub(crate) struct Urdf {
    pub(crate) place: Place,
    pub(crate) links: Vec<UrdfLink>,
    pub(crate) joints: Vec<UrdfJoint>,
}

/// The places of the links and joints read so far, by their names.
#[derive(Default)]
struct FirstPlaces {
    links: BTreeMap<String, Place>,
    joints: BTreeMap<String, Place>,
}

/// A link.
#[derive(Clone, Debug)]
pub(crate) struct UrdfLink {
    pub(crate) place: Place,
    pub(crate) name: String,
}

/// A joint between two links.
#[derive(Clone, Debug)]
pub(crate) struct UrdfJoint {
    pub(crate) place: Place,
    pub(crate) name: String,
    /// One of [`TYPES`].
    pub(crate) joint_type: &'static str,
    pub(crate) parent: String,
    pub(crate) child: String,
    /// The pose in the parent link's frame at position zero.
    pub(crate) origin: Isometry3<f64>,
    element: Element,
    /// The version of URDF is 1.2 or later: omitted limits are infinite, and not zero.
    has_open_limits: bool,
}

impl Urdf {
    /// Reads and checks a URDF.
    ///
    /// # Errors
    ///
    /// [`BodyError`] if the text is no URDF, a number is not finite, a name is there twice, or a part that Leo needs is
    /// missing.
    pub(crate) fn parse(text: &str) -> Result<Self, BodyError> {
        let robot = Element::root(text)?;
        if robot.tag != "robot" {
            let reason = format!("its root element is `<{}>`, and not `<robot>`", shown(&robot.tag));
            return Err(malformed(robot.place, reason));
        }
        let version = version(&robot);
        let mut urdf = Self { place: robot.place, links: Vec::new(), joints: Vec::new() };
        let mut first = FirstPlaces::default();
        for element in robot.children {
            match element.tag.as_str() {
                "link" => urdf.add_link(&element, &mut first.links)?,
                "joint" => urdf.add_joint(element, version, &mut first.joints)?,
                "material" => {
                    let name = element.attribute("name").unwrap_or_default();
                    check_numbers(&format!("material `{}`", shown(name)), &element)?;
                }
                _ => {}
            }
        }
        Ok(urdf)
    }

    fn add_link(&mut self, element: &Element, first: &mut BTreeMap<String, Place>) -> Result<(), BodyError> {
        let name = name(element)?;
        let place = element.place;
        let link = format!("link `{}`", shown(&name));
        if let Some(first) = first.insert(name.clone(), place) {
            return Err(twice(place, link, first));
        }
        check_numbers(&link, element)?;
        self.links.push(UrdfLink { place, name });
        Ok(())
    }

    fn add_joint(
        &mut self,
        element: Element,
        version: (u32, u32),
        first: &mut BTreeMap<String, Place>,
    ) -> Result<(), BodyError> {
        let name = name(&element)?;
        let place = element.place;
        let shown = format!("joint `{}`", shown(&name));
        if let Some(first) = first.insert(name.clone(), place) {
            return Err(twice(place, shown, first));
        }
        for tag in SINGLE {
            let mut children = element.children.iter().filter(|child| child.tag == tag);
            if let (Some(first), Some(second)) = (children.next(), children.next()) {
                return Err(twice(second.place, format!("{shown}: `<{tag}>`"), first.place));
            }
        }
        check_numbers(&shown, &element)?;
        let found = element.attribute("type").ok_or_else(|| missing(&element, shown.clone(), "`type`"))?;
        let Some(joint_type) = TYPES.into_iter().find(|known| *known == found.trim()) else {
            let reason = format!("it must be one of {}", TYPES.join(", "));
            return Err(wrong_value(place, shown, "type", found, reason));
        };
        let link = |tag: &str| {
            let part = element.child(tag);
            let part = part.ok_or_else(|| missing(&element, shown.clone(), &format!("`<{tag}>`")))?;
            let link = part.attribute("link");
            link.map(str::to_owned).ok_or_else(|| missing(part, format!("{shown}: `<{tag}>`"), "`link`"))
        };
        let (parent, child) = (link("parent")?, link("child")?);
        let origin = match element.child("origin") {
            Some(origin) => pose(&format!("{shown}: `<origin>`"), origin, version)?,
            None => Isometry3::identity(),
        };
        let has_open_limits = version >= (1, 2);
        self.joints.push(UrdfJoint {
            place,
            name,
            joint_type,
            parent,
            child,
            origin,
            element,
            has_open_limits,
        });
        Ok(())
    }
}

impl UrdfJoint {
    /// The place of its `<mimic>`; `None` if it follows no other joint.
    pub(crate) fn mimic(&self) -> Option<Place> {
        self.element.child("mimic").map(|mimic| mimic.place)
    }

    /// The axis in the link's frame.
    ///
    /// # Errors
    ///
    /// [`BodyErrorKind::NoAxis`] if it is shorter than 1e-6, [`BodyErrorKind::Value`] if it has not three numbers.
    pub(crate) fn axis(&self) -> Result<Unit<Vector3<f64>>, BodyError> {
        let Some(element) = self.element.child("axis") else { return Ok(Vector3::x_axis()) };
        let shown = format!("joint `{}`: `<axis>`", shown(&self.name));
        let axis = numbers::<3>(&shown, element, "xyz")?;
        let axis = Vector3::from(axis.ok_or_else(|| missing(element, shown.clone(), "`xyz`"))?);
        let largest = axis.amax();
        // The square of a large number is infinite, so the vector is scaled first.
        if largest > 1e-6 {
            Ok(Unit::new_normalize(axis / largest))
        } else {
            Err(element.place.error(BodyErrorKind::NoAxis { joint: self.name.clone() }))
        }
    }

    /// The lower and upper limit, in radians, and the maximum speed, in radians per second.
    ///
    /// # Errors
    ///
    /// [`BodyErrorKind::Missing`] if one is missing, [`BodyErrorKind::Limits`] if they are crossed or there is
    /// no speed.
    pub(crate) fn limits(&self) -> Result<[f64; 3], BodyError> {
        let joint = || format!("joint `{}`", shown(&self.name));
        let limit = self.element.child("limit");
        let limit = limit.ok_or_else(|| missing(&self.element, joint(), "`<limit>`"))?;
        let shown = format!("{}: `<limit>`", joint());
        let number = |attribute: &str| {
            let found = numbers::<1>(&shown, limit, attribute)?.map(|[number]| number);
            // Before URDF 1.2, an omitted position limit is zero.
            let omitted = (attribute != "velocity" && !self.has_open_limits).then_some(0.0);
            found.or(omitted).ok_or_else(|| missing(limit, shown.clone(), &format!("`{attribute}`")))
        };
        let (lower_rad, upper_rad) = (number("lower")?, number("upper")?);
        let velocity_rad_s = number("velocity")?;
        // Written so that NaN fails.
        if lower_rad <= upper_rad && velocity_rad_s > 0.0 {
            Ok([lower_rad, upper_rad, velocity_rad_s])
        } else {
            let joint = self.name.clone();
            let kind = BodyErrorKind::Limits { joint, lower_rad, upper_rad, velocity_rad_s };
            Err(limit.place.error(kind))
        }
    }
}

/// The version of the format; 1.0 if it is missing or unreadable.
fn version(robot: &Element) -> (u32, u32) {
    let said = robot.attribute("version").and_then(|version| {
        let (major, minor) = version.trim().split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    });
    said.unwrap_or((1, 0))
}

/// Checks every number of the known elements in an element.
fn check_numbers(owner: &str, element: &Element) -> Result<(), BodyError> {
    for child in &element.children {
        let of_tag = NUMBERS.iter().filter(|(tag, _)| *tag == child.tag);
        for attribute in of_tag.flat_map(|(_, attributes)| attributes.iter().copied()) {
            let Some(value) = child.attribute(attribute) else { continue };
            for word in value.split_whitespace() {
                if let Some(reason) = number_error(&child.tag, attribute, word) {
                    let element = format!("{owner}: `<{}>`", child.tag);
                    return Err(wrong_value(child.place, element, attribute, value, reason));
                }
            }
        }
        if CONTAINERS.contains(&child.tag.as_str()) {
            check_numbers(owner, child)?;
        }
    }
    Ok(())
}

/// What is wrong with a number, if anything.
fn number_error(tag: &str, attribute: &str, word: &str) -> Option<String> {
    let Some(number) = word.parse::<f64>().ok().filter(|number| number.is_finite()) else {
        return Some(format!("`{}` is not a finite number", shortened(word)));
    };
    if NOT_NEGATIVE.contains(&(tag, attribute)) && number < 0.0 {
        return Some(format!("{} is negative", shortened(word)));
    }
    let (max, unit) = match (tag, attribute) {
        ("origin", "xyz") => (MAX_PLACE_M, "metres"),
        ("origin", "rpy") => (MAX_ANGLE_RAD, "radians"),
        _ => return None,
    };
    (number.abs() > max).then(|| format!("{} is beyond {max} {unit}", shortened(word)))
}

/// The numbers of an attribute; `None` without the attribute.
fn numbers<const N: usize>(
    owner: &str,
    element: &Element,
    attribute: &str,
) -> Result<Option<[f64; N]>, BodyError> {
    let Some(value) = element.attribute(attribute) else { return Ok(None) };
    let numbers: Vec<f64> = value.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    match <[f64; N]>::try_from(numbers) {
        Ok(numbers) => Ok(Some(numbers)),
        Err(numbers) => {
            let needed = if N == 1 { "1 number is".to_owned() } else { format!("{N} numbers are") };
            let reason = format!("{needed} needed, and not {}", numbers.len());
            Err(wrong_value(element.place, owner.to_owned(), attribute, value, reason))
        }
    }
}

/// A URDF origin: roll, pitch and yaw about fixed axes, in that order; or a quaternion, which needs version 1.1.
fn pose(owner: &str, origin: &Element, version: (u32, u32)) -> Result<Isometry3<f64>, BodyError> {
    let place = numbers::<3>(owner, origin, "xyz")?.unwrap_or_default();
    let angles = numbers::<3>(owner, origin, "rpy")?;
    let quaternion = numbers::<4>(owner, origin, "quat_xyzw")?;
    let wrong = |reason: &str| {
        let value = origin.attribute("quat_xyzw").unwrap_or_default();
        wrong_value(origin.place, owner.to_owned(), "quat_xyzw", value, reason.to_owned())
    };
    if quaternion.is_some() && version < (1, 1) {
        return Err(wrong("it needs `version=\"1.1\"` in `<robot>`; without it, use `rpy`"));
    }
    let rotation = match (angles, quaternion) {
        (Some(_), Some(_)) => return Err(wrong("`rpy` is there too, and one of them is enough")),
        (None, Some(quaternion)) => {
            let quaternion = Quaternion::from(quaternion);
            let unit = UnitQuaternion::try_new(quaternion, 1e-6).filter(|unit| unit.norm().is_normal());
            unit.ok_or_else(|| wrong("it has no direction"))?
        }
        (angles, None) => {
            let [roll, pitch, yaw] = angles.unwrap_or_default();
            UnitQuaternion::from_euler_angles(roll, pitch, yaw)
        }
    };
    Ok(Isometry3::from_parts(Translation3::from(Vector3::from(place)), rotation))
}

fn name(element: &Element) -> Result<String, BodyError> {
    match element.attribute("name") {
        Some(name) if !name.trim().is_empty() => Ok(name.to_owned()),
        _ => Err(missing(element, format!("a `<{}>`", shown(&element.tag)), "`name`")),
    }
}

fn missing(element: &Element, shown: String, missing: &str) -> BodyError {
    element.place.error(BodyErrorKind::Missing { element: shown, missing: missing.to_owned() })
}

fn twice(place: Place, element: String, first: Place) -> BodyError {
    place.error(BodyErrorKind::Twice { element, first_line: first.line })
}

fn wrong_value(place: Place, element: String, attribute: &str, value: &str, reason: String) -> BodyError {
    let (attribute, value) = (attribute.to_owned(), shortened(value));
    place.error(BodyErrorKind::Value { element, attribute, value, reason })
}

/// A value as errors show it: on one line, its first 40 characters.
fn shortened(value: &str) -> String {
    const MAX_CHARACTERS: usize = 40;
    let words = value.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut shown: String = words.chars().take(MAX_CHARACTERS).flat_map(char::escape_debug).collect();
    if words.chars().nth(MAX_CHARACTERS).is_some() {
        shown.push('…');
    }
    shown
}

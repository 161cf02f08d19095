use crate::ARM_JOINTS;
use crate::shown::shown;

/// A place in the text of a URDF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Line, from one.
    pub(crate) line: usize,
    /// Column, from one.
    pub(crate) column: usize,
}

impl Place {
    /// The first character.
    pub(crate) const START: Self = Self { line: 1, column: 1 };

    pub(crate) const fn error(self, kind: BodyErrorKind) -> BodyError {
        BodyError { line: self.line, column: self.column, kind }
    }
}

/// A URDF is not a valid body: the place and the reason.
#[derive(Debug, thiserror::Error)]
#[error("line {line}, column {column} of the URDF: {kind}")]
pub struct BodyError {
    /// Line, from one.
    pub line: usize,
    /// Column, from one.
    pub column: usize,
    /// The reason. It names the joint or link.
    pub kind: BodyErrorKind,
}

/// Why a URDF is not a valid body.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum BodyErrorKind {
    /// The text is no XML, or its root is not `<robot>`.
    #[error("not a URDF: {reason}")]
    Urdf {
        /// What is wrong with the text.
        reason: String,
    },
    /// A required attribute or child is missing.
    #[error("{element} has no {missing}")]
    Missing {
        /// The joint or link, and the part of it.
        element: String,
        /// What is missing, as it is written in XML.
        missing: String,
    },
    /// The value of an attribute is wrong.
    #[error("{element}: `{attribute}` is \"{value}\": {reason}")]
    Value {
        /// The joint or link, and the part of it.
        element: String,
        /// Name of the attribute.
        attribute: String,
        /// Its value, shortened.
        value: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Two joints or two links have one name, or a joint has two children of one kind.
    #[error("{element} is there twice; the first is in line {first_line}: remove or rename one")]
    Twice {
        /// The joint or link, and the part of it.
        element: String,
        /// Line of the first one, from one.
        first_line: usize,
    },
    /// A joint of the list is not in the URDF.
    #[error(
        "no revolute joint `{}` in the URDF; the names there and in motor.toml must be the same",
        shown(.joint)
    )]
    MissingJoint {
        /// Name of the joint.
        joint: String,
    },
    /// A joint of the list is of another type.
    #[error(
        "joint `{}` is of type `{found}`, and motor.toml has a servo for it: a servo needs `revolute`",
        shown(.joint)
    )]
    NotRevolute {
        /// Name of the joint.
        joint: String,
        /// Its type.
        found: String,
    },
    /// A joint of the list follows another one.
    #[error(
        "joint `{}` has a `<mimic>`, and motor.toml has a servo for it: remove the `<mimic>`, or the servo and \
         make the joint fixed",
        shown(.joint)
    )]
    Mimic {
        /// Name of the joint.
        joint: String,
    },
    /// A movable joint of the URDF is not in the list.
    #[error("the URDF's joint `{}` moves and has no servo; add it to motor.toml or make it fixed", shown(.joint))]
    UnlistedJoint {
        /// Name of the joint.
        joint: String,
    },
    /// The limits are crossed, or the maximum speed is not positive.
    #[error(
        "joint `{}`: {}",
        shown(.joint),
        limits_fault(*lower_rad, *upper_rad, *velocity_rad_s)
    )]
    Limits {
        /// Name of the joint.
        joint: String,
        /// Lower limit, in radians.
        lower_rad: f64,
        /// Upper limit, in radians.
        upper_rad: f64,
        /// Maximum speed, in radians per second.
        velocity_rad_s: f64,
    },
    /// The axis of a joint has no length.
    #[error("joint `{}`: its axis has no length", shown(.joint))]
    NoAxis {
        /// Name of the joint.
        joint: String,
    },
    /// A joint names an unknown link.
    #[error("joint `{}` joins a link `{}`, which is not in the URDF", shown(.joint), shown(.link))]
    UnknownLink {
        /// Name of the joint.
        joint: String,
        /// Name of the link.
        link: String,
    },
    /// A link is the child of two joints.
    #[error("link `{}` is the child of two joints: `{}` and `{}`", shown(.link), shown(.one), shown(.other))]
    TwoParents {
        /// Name of the link.
        link: String,
        /// The first joint.
        one: String,
        /// The second joint.
        other: String,
    },
    /// There is no link.
    #[error("the URDF has no `<link>`")]
    NoLinks,
    /// No link is the root.
    #[error("no link is the root: every link is the child of a joint, so the joints form a loop")]
    NoRoot,
    /// Two links have no parent.
    #[error("links `{}` and `{}` both have no parent: join them", shown(.one), shown(.other))]
    TwoRoots {
        /// The first one.
        one: String,
        /// The second one.
        other: String,
    },
    /// The joints form a cycle.
    #[error("link `{}` is part of a loop of joints", shown(.link))]
    Ring {
        /// A link of the cycle.
        link: String,
    },
    /// A hand or eye link is missing.
    #[error("no link `{link}` in the URDF: hands are `<side>_grasp`, eyes `<side>_eye`")]
    MissingLink {
        /// Name of the link.
        link: String,
    },
    /// Fewer than [`ARM_JOINTS`] joints move a hand.
    #[error("{found} joints move `{link}`; an arm needs {ARM_JOINTS}")]
    ShortArm {
        /// The link of the hand.
        link: String,
        /// Number of joints between it and the root.
        found: usize,
    },
}

/// What is wrong with the limits of a joint.
fn limits_fault(lower_rad: f64, upper_rad: f64, velocity_rad_s: f64) -> String {
    if lower_rad > upper_rad {
        format!("the lower limit {lower_rad} is above the upper limit {upper_rad}")
    } else {
        format!("the limit of the velocity is {velocity_rad_s}, and has to be positive")
    }
}

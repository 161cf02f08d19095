use geometry::{Base, Eye, Hand, Pose};
use nalgebra::Isometry3;

use crate::body_error::BodyErrorKind;
use crate::tree::{Step, Tree};
use crate::urdf::{Urdf, UrdfJoint};
use crate::{BodyError, Link};

/// Number of joints of an arm, from the shoulder to the wrist.
pub const ARM_JOINTS: usize = 7;

/// A side of the body; left is +y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// The robot's left.
    Left,
    /// The robot's right.
    Right,
}

impl Side {
    /// Both sides, left first.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// The prefix of the names of its joints.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// The one of a pair that belongs to this side.
    #[must_use]
    pub fn of<T>(self, [left, right]: [T; 2]) -> T {
        if self == Self::Left { left } else { right }
    }
}

/// A revolute joint of the URDF.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name of the joint.
    pub name: String,
    /// Lower limit, in radians.
    pub lower_rad: f64,
    /// Upper limit, in radians.
    pub upper_rad: f64,
    /// Maximum speed, in radians per second.
    pub velocity_rad_s: f64,
}

impl Joint {
    /// Clamps a position to the limits; NaN becomes the lower limit.
    #[must_use]
    pub fn limited(&self, position_rad: f64) -> f64 {
        position_rad.max(self.lower_rad).min(self.upper_rad)
    }
}

/// An arm: the last seven joints before the hand, and what carries them.
#[derive(Clone, Debug)]
pub(crate) struct Arm {
    /// The steps from the root to the first joint of the arm, without it.
    pub(crate) mount: Vec<Step>,
    /// The steps from the first joint of the arm to the hand.
    pub(crate) chain: Vec<Step>,
    /// The indices of its joints.
    pub(crate) joints: [usize; ARM_JOINTS],
}

/// The joints and links of a humanoid with two hands and two eyes.
#[derive(Clone, Debug)]
pub struct Body {
    joints: Vec<Joint>,
    tree: Tree,
    arms: [Arm; 2],
    hands: [Link; 2],
    eyes: [Link; 2],
}

impl Body {
    /// Reads a URDF. `names` lists every movable joint and defines the joint indices. The root link is the
    /// base. Hands are the links `left_grasp` and `right_grasp`, eyes `left_eye` and `right_eye`.
    ///
    /// # Errors
    ///
    /// [`BodyError`] if the text is no URDF, or its movable joints are not those of `names`. Also if its
    /// links are not one tree with two arms and two eyes.
    pub fn from_urdf(text: &str, names: &[&str]) -> Result<Self, BodyError> {
        let urdf = Urdf::parse(text)?;
        let moves = |joint: &&UrdfJoint| joint.joint_type != "fixed";
        if let Some(joint) =
            urdf.joints.iter().filter(moves).find(|joint| !names.contains(&joint.name.as_str()))
        {
            return Err(joint.place.error(BodyErrorKind::UnlistedJoint { joint: joint.name.clone() }));
        }
        let joints = names.iter().map(|name| joint(&urdf, name)).collect::<Result<Vec<_>, _>>()?;
        let tree = Tree::new(&urdf, |name| names.iter().position(|known| *known == name))?;
        let link = |name: String| {
            tree.link(&name).ok_or_else(|| urdf.place.error(BodyErrorKind::MissingLink { link: name }))
        };
        let [left, right] = Side::BOTH.map(|side| format!("{}_grasp", side.name()));
        let hands = [link(left)?, link(right)?];
        let [left, right] = Side::BOTH.map(|side| format!("{}_eye", side.name()));
        let eyes = [link(left)?, link(right)?];
        let [left, right] = hands;
        let arms = [arm(&tree, left, Side::Left)?, arm(&tree, right, Side::Right)?];
        Ok(Self { joints, tree, arms, hands, eyes })
    }

    /// The joints, in the order of their indices.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// The index of a joint; `None` if there is none of that name.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// The indices of an arm's joints, from the shoulder to the wrist.
    #[must_use]
    pub fn arm_joints(&self, side: Side) -> [usize; ARM_JOINTS] {
        self.arm(side).joints
    }

    /// A link by its name in the URDF.
    #[must_use]
    pub fn link(&self, name: &str) -> Option<Link> {
        self.tree.link(name)
    }

    /// The pose of a link in the base frame; the caller chooses the frame type. Positions are in radians.
    #[must_use]
    pub fn pose<F>(&self, link: Link, positions_rad: &[f64]) -> Pose<Base, F> {
        Pose::from_isometry(self.tree.pose(link, positions_rad))
    }

    /// Every link but the root: its parent's name, its own name, and its pose in the parent's frame.
    pub fn links(&self, positions_rad: &[f64]) -> impl Iterator<Item = (&str, &str, Isometry3<f64>)> {
        self.tree.joined(positions_rad)
    }

    /// The name of the root link: the base.
    #[must_use]
    pub fn root(&self) -> &str {
        self.tree.root()
    }

    /// The pose of a hand: origin between the fingertips, x along the fingers.
    ///
    /// ```
    /// use geometry::Position;
    /// use kinematics::{Body, Side};
    /// # let urdf = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/leo.urdf"));
    /// # let names: Vec<&str> = urdf.lines().filter(|line| line.contains("revolute"))
    /// #     .filter_map(|line| line.split('"').nth(1)).collect();
    /// let body = Body::from_urdf(urdf, &names)?;
    /// let mut positions_rad = vec![0.0; body.joints().len()];
    /// // The arm hangs: shoulder at (0, 0.18, 0.40), then 0.34 + 0.32 + 0.12 m straight down, and
    /// // the grasp point 0.012 m in front of the palm, which faces back.
    /// let hanging = body.hand(Side::Left, &positions_rad).origin();
    /// assert!(hanging.distance(&Position::new(-0.012, 0.18, 0.40 - 0.78)) < 1e-12);
    /// // The elbow bent by a right angle points the forearm forwards; the palm then faces down.
    /// let elbow = body.joint("left_elbow_pitch_joint").ok_or("no elbow")?;
    /// positions_rad[elbow] = -std::f64::consts::FRAC_PI_2;
    /// let bent = body.hand(Side::Left, &positions_rad).origin();
    /// assert!(bent.distance(&Position::new(0.44, 0.18, 0.06 - 0.012)) < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn hand(&self, side: Side, positions_rad: &[f64]) -> Pose<Base, Hand> {
        self.pose(side.of(self.hands), positions_rad)
    }

    /// The pose of an eye: x along the line of sight.
    #[must_use]
    pub fn eye(&self, side: Side, positions_rad: &[f64]) -> Pose<Base, Eye> {
        self.pose(side.of(self.eyes), positions_rad)
    }

    pub(crate) fn arm(&self, side: Side) -> &Arm {
        side.of(self.arms.each_ref())
    }
}

fn joint(urdf: &Urdf, name: &str) -> Result<Joint, BodyError> {
    let missing = || urdf.place.error(BodyErrorKind::MissingJoint { joint: name.to_owned() });
    let joint = urdf.joints.iter().find(|joint| joint.name == name).ok_or_else(missing)?;
    let name = name.to_owned();
    if joint.joint_type != "revolute" {
        let found = joint.joint_type.to_owned();
        return Err(joint.place.error(BodyErrorKind::NotRevolute { joint: name, found }));
    }
    if let Some(mimic) = joint.mimic() {
        return Err(mimic.error(BodyErrorKind::Mimic { joint: name }));
    }
    let [lower_rad, upper_rad, velocity_rad_s] = joint.limits()?;
    Ok(Joint { name, lower_rad, upper_rad, velocity_rad_s })
}

fn arm(tree: &Tree, hand: Link, side: Side) -> Result<Arm, BodyError> {
    let mut mount = tree.chain(hand);
    let turning: Vec<usize> = mount.iter().filter_map(|step| Some(step.turn?.joint)).collect();
    let short = || {
        let link = format!("{}_grasp", side.name());
        tree.place(hand).error(BodyErrorKind::ShortArm { link, found: turning.len() })
    };
    let joints: [usize; ARM_JOINTS] = *turning.last_chunk().ok_or_else(short)?;
    let [shoulder, ..] = joints;
    let first = mount
        .iter()
        .position(|step| step.turn.is_some_and(|turn| turn.joint == shoulder))
        .ok_or_else(short)?;
    let chain = mount.split_off(first);
    Ok(Arm { mount, chain, joints })
}

impl Arm {
    /// Pose of the arm's mount in the base frame.
    pub(crate) fn mount(&self, positions_rad: &[f64]) -> Isometry3<f64> {
        self.mount.iter().fold(Isometry3::identity(), |inner, step| inner * step.pose(positions_rad))
    }
}

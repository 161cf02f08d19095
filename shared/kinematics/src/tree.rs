use std::collections::BTreeMap;

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use crate::BodyError;
use crate::body_error::{BodyErrorKind, Place};
use crate::urdf::Urdf;

/// Handle of a link, valid for the body that returned it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link(usize);

/// A link and its joint to the parent.
#[derive(Clone, Debug)]
struct Node {
    name: String,
    /// Place of the link in the URDF.
    place: Place,
    parent: Option<usize>,
    /// Pose in the parent's frame at joint position zero.
    origin: Isometry3<f64>,
    turn: Option<Turn>,
}

/// A revolute joint: its index, and the axis in the link's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    pub(crate) joint: usize,
    pub(crate) axis: Unit<Vector3<f64>>,
}

/// The links of a body, each with its parent.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
}

/// One link of a chain from the root.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub(crate) origin: Isometry3<f64>,
    pub(crate) turn: Option<Turn>,
}

impl Step {
    /// The link's pose in the parent's frame.
    pub(crate) fn pose(&self, positions_rad: &[f64]) -> Isometry3<f64> {
        match self.turn {
            None => self.origin,
            Some(Turn { joint, axis }) => {
                let angle = positions_rad.get(joint).copied().unwrap_or(0.0);
                self.origin * UnitQuaternion::from_axis_angle(&axis, angle)
            }
        }
    }
}

impl Tree {
    /// Reads links and joints; `index` maps the names of revolute joints to indices.
    pub(crate) fn new(urdf: &Urdf, index: impl Fn(&str) -> Option<usize>) -> Result<Self, BodyError> {
        let indices: BTreeMap<&str, usize> =
            urdf.links.iter().enumerate().map(|(index, link)| (link.name.as_str(), index)).collect();
        let find = |name: &str| indices.get(name).copied();
        let mut nodes: Vec<Node> = urdf
            .links
            .iter()
            .map(|link| Node {
                name: link.name.clone(),
                place: link.place,
                parent: None,
                origin: Isometry3::identity(),
                turn: None,
            })
            .collect();
        for joint in &urdf.joints {
            let unknown = |link: &str| {
                let (joint_name, link) = (joint.name.clone(), link.to_owned());
                joint.place.error(BodyErrorKind::UnknownLink { joint: joint_name, link })
            };
            let parent = find(&joint.parent).ok_or_else(|| unknown(&joint.parent))?;
            let node = find(&joint.child)
                .and_then(|child| nodes.get_mut(child))
                .ok_or_else(|| unknown(&joint.child))?;
            if node.parent.is_some() {
                let mut parents = urdf.joints.iter().filter(|other| other.child == joint.child);
                let one = parents.next().map(|joint| joint.name.clone()).unwrap_or_default();
                let (link, other) = (node.name.clone(), joint.name.clone());
                return Err(joint.place.error(BodyErrorKind::TwoParents { link, one, other }));
            }
            node.parent = Some(parent);
            node.origin = joint.origin;
            node.turn = match index(&joint.name) {
                None => None,
                Some(number) => Some(Turn { joint: number, axis: joint.axis()? }),
            };
        }
        let tree = Self { nodes };
        // With exactly one root, a link is connected to it or part of a cycle.
        let mut roots = tree.nodes.iter().filter(|node| node.parent.is_none());
        match (roots.next(), roots.next()) {
            (Some(_), None) => {}
            (None, _) if tree.nodes.is_empty() => return Err(urdf.place.error(BodyErrorKind::NoLinks)),
            (None, _) => return Err(urdf.place.error(BodyErrorKind::NoRoot)),
            (Some(one), Some(other)) => {
                let kind = BodyErrorKind::TwoRoots { one: one.name.clone(), other: other.name.clone() };
                return Err(other.place.error(kind));
            }
        }
        match tree.cycle() {
            Some(node) => Err(node.place.error(BodyErrorKind::Ring { link: node.name.clone() })),
            None => Ok(tree),
        }
    }

    /// A link of a cycle; `None` if every link is connected to a root. Each link is visited once.
    fn cycle(&self) -> Option<&Node> {
        // The walk that visited a link first: a walk that meets itself is a cycle.
        let mut walks: Vec<Option<usize>> = vec![None; self.nodes.len()];
        for walk in 0..self.nodes.len() {
            let mut at = Some(walk);
            while let Some(link) = at {
                let visited = walks.get_mut(link)?;
                match visited {
                    Some(before) if *before == walk => return self.nodes.get(link),
                    Some(_) => break,
                    None => *visited = Some(walk),
                }
                at = self.nodes.get(link)?.parent;
            }
        }
        None
    }

    /// The link's place in the URDF.
    pub(crate) fn place(&self, link: Link) -> Place {
        self.nodes.get(link.0).map_or(Place::START, |node| node.place)
    }

    pub(crate) fn link(&self, name: &str) -> Option<Link> {
        self.nodes.iter().position(|node| node.name == name).map(Link)
    }

    /// Every link but the root, in the order of the URDF: its parent's name, its own name, and its pose in
    /// the parent's frame.
    pub(crate) fn joined(&self, positions_rad: &[f64]) -> impl Iterator<Item = (&str, &str, Isometry3<f64>)> {
        self.nodes.iter().filter_map(move |node| {
            let parent = self.nodes.get(node.parent?)?;
            let step = Step { origin: node.origin, turn: node.turn };
            Some((parent.name.as_str(), node.name.as_str(), step.pose(positions_rad)))
        })
    }

    /// The name of the root link.
    pub(crate) fn root(&self) -> &str {
        self.nodes.iter().find(|node| node.parent.is_none()).map_or("", |node| node.name.as_str())
    }

    /// The link's pose in the root's frame.
    pub(crate) fn pose(&self, link: Link, positions_rad: &[f64]) -> Isometry3<f64> {
        self.towards_root(link).fold(Isometry3::identity(), |outer, step| step.pose(positions_rad) * outer)
    }

    /// The steps from the root to the link.
    pub(crate) fn chain(&self, link: Link) -> Vec<Step> {
        let mut steps: Vec<Step> = self.towards_root(link).collect();
        steps.reverse();
        steps
    }

    /// The steps from the link to the root.
    fn towards_root(&self, link: Link) -> impl Iterator<Item = Step> + '_ {
        let mut at = self.nodes.get(link.0);
        std::iter::from_fn(move || {
            let node = at?;
            at = node.parent.and_then(|parent| self.nodes.get(parent));
            Some(Step { origin: node.origin, turn: node.turn })
        })
    }
}

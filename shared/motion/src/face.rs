/// A facial expression of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Face {
    /// At rest.
    Neutral,
    /// Ears up and forward, eyes wide: attention.
    Attentive,
    /// One brow up, ears apart: confusion.
    Puzzled,
    /// Cheeks and corners of the mouth up: pleasure.
    Pleased,
}

/// A part of the face, and whether there is one on each side.
pub(crate) struct FacePart {
    name: &'static str,
    paired: bool,
    /// Joint positions in radians when attentive, puzzled, and pleased. They are equal on both sides except for
    /// `puzzled`.
    attentive: f64,
    puzzled: [f64; 2],
    pleased: f64,
    /// Whether both sides rotate about the same axis, so that the sign changes on the right.
    mirrored: bool,
}

const fn paired(name: &'static str, attentive: f64, puzzled: [f64; 2], pleased: f64) -> FacePart {
    FacePart { name, paired: true, attentive, puzzled, pleased, mirrored: false }
}

const fn middle(name: &'static str, attentive: f64, puzzled: f64, pleased: f64) -> FacePart {
    FacePart { name, paired: false, attentive, puzzled: [puzzled, 0.0], pleased, mirrored: false }
}

/// Every joint of the face except those of the eyeballs, which follow the gaze.
pub(crate) const FACE_PARTS: [FacePart; 16] = [
    FacePart { mirrored: true, ..paired("ear_yaw", -0.4, [-0.3, 0.2], 0.0) },
    paired("ear_pitch", 0.2, [-0.1, 0.3], -0.1),
    paired("ear_roll", 0.5, [0.4, -0.4], 0.3),
    paired("upper_eyelid_pitch", -0.25, [0.1, -0.1], 0.2),
    paired("lower_eyelid_pitch", -0.1, [0.0, 0.1], 0.3),
    paired("inner_brow_pitch", 0.3, [0.4, -0.2], 0.2),
    paired("outer_brow_pitch", 0.2, [0.3, -0.2], 0.2),
    paired("cheek_pitch", 0.0, [0.0, 0.1], 0.4),
    paired("mouth_corner_pitch", 0.1, [-0.2, -0.1], 0.5),
    paired("mouth_corner_yaw", 0.0, [-0.1, -0.1], 0.3),
    paired("upper_lip_pitch", 0.0, [0.0, 0.0], 0.2),
    paired("lower_lip_pitch", 0.0, [0.1, 0.1], 0.0),
    middle("jaw_pitch", 0.05, 0.0, 0.15),
    middle("nose_pitch", 0.1, 0.15, 0.1),
    middle("upper_lip_pitch", 0.0, 0.0, 0.2),
    middle("lower_lip_pitch", 0.0, 0.1, 0.0),
];

impl Face {
    /// Names of a part's joints without `_joint`, left before right.
    pub(crate) fn joints_of(part: &FacePart) -> Vec<String> {
        if part.paired {
            vec![format!("left_{}", part.name), format!("right_{}", part.name)]
        } else {
            vec![part.name.to_owned()]
        }
    }

    /// Positions of the face's joints in radians, in the order of [`FACE_PARTS`], left before right.
    pub(crate) fn positions_rad(self) -> impl Iterator<Item = f64> {
        FACE_PARTS.iter().flat_map(move |part| {
            let [left, right] = match self {
                Self::Neutral => [0.0, 0.0],
                Self::Attentive => [part.attentive; 2],
                Self::Puzzled => part.puzzled,
                Self::Pleased => [part.pleased; 2],
            };
            let right = if part.mirrored { -right } else { right };
            [left, right].into_iter().take(if part.paired { 2 } else { 1 })
        })
    }
}

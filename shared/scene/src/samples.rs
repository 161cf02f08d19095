use glam::Vec4;
use quantity::number::single;
use serde::Deserialize;

/// Which sample points of a box are tested for visibility.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Samples {
    /// The centre alone.
    Centre,
    /// The centre and the centres of the faces: 7 points.
    Faces,
    /// The centre and the corners: 9 points.
    Corners,
    /// The corners and the middles of the edges and faces, without the centre: 26 points. An opaque box hides its own
    /// centre, so this measures the visible share of the surface. A configuration cannot choose it.
    #[serde(skip_deserializing)]
    Surface,
}

const CENTRE: [[f64; 3]; 1] = [[0.0, 0.0, 0.0]];

const FACES: [[f64; 3]; 7] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];

const CORNERS: [[f64; 3]; 9] = [
    [0.0, 0.0, 0.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0],
    [-1.0, 1.0, 1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [-1.0, -1.0, -1.0],
];

const SURFACE: [[f64; 3]; 26] = [
    [1.0, 1.0, 1.0],
    [1.0, 1.0, 0.0],
    [1.0, 1.0, -1.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, 0.0],
    [1.0, 0.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, 0.0],
    [1.0, -1.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, 0.0],
    [0.0, 1.0, -1.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [0.0, -1.0, 1.0],
    [0.0, -1.0, 0.0],
    [0.0, -1.0, -1.0],
    [-1.0, 1.0, 1.0],
    [-1.0, 1.0, 0.0],
    [-1.0, 1.0, -1.0],
    [-1.0, 0.0, 1.0],
    [-1.0, 0.0, 0.0],
    [-1.0, 0.0, -1.0],
    [-1.0, -1.0, 1.0],
    [-1.0, -1.0, 0.0],
    [-1.0, -1.0, -1.0],
];

/// Four points at a time, by coordinate, in half extents from the centre. Unused entries at the end are centres.
pub(crate) type Fours = [[Vec4; 3]];

const CENTRE_FOURS: [[Vec4; 3]; 1] = fours(&CENTRE);
const FACES_FOURS: [[Vec4; 3]; 2] = fours(&FACES);
const CORNERS_FOURS: [[Vec4; 3]; 3] = fours(&CORNERS);
const SURFACE_FOURS: [[Vec4; 3]; 7] = fours(&SURFACE);

#[expect(
    clippy::indexing_slicing,
    reason = "it is evaluated by the compiler alone, which refuses an index out of range"
)]
const fn fours<const POINTS: usize, const FOURS: usize>(points: &[[f64; 3]; POINTS]) -> [[Vec4; 3]; FOURS] {
    let mut fours = [[Vec4::ZERO; 3]; FOURS];
    let mut four = 0;
    while four < FOURS {
        let mut axis = 0;
        while axis < 3 {
            let (mut lanes, mut lane) = ([0.0; 4], 0);
            while lane < 4 && 4 * four + lane < POINTS {
                lanes[lane] = single(points[4 * four + lane][axis]);
                lane += 1;
            }
            fours[four][axis] = Vec4::from_array(lanes);
            axis += 1;
        }
        four += 1;
    }
    fours
}

impl Samples {
    /// The points, in half extents from the centre.
    pub(crate) fn points(self) -> &'static [[f64; 3]] {
        match self {
            Self::Centre => &CENTRE,
            Self::Faces => &FACES,
            Self::Corners => &CORNERS,
            Self::Surface => &SURFACE,
        }
    }

    /// The same points, four at a time.
    pub(crate) fn fours(self) -> &'static Fours {
        match self {
            Self::Centre => &CENTRE_FOURS,
            Self::Faces => &FACES_FOURS,
            Self::Corners => &CORNERS_FOURS,
            Self::Surface => &SURFACE_FOURS,
        }
    }
}

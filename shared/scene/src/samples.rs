/// Which points of a box stand for it when its visibility is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// Its centre alone.
    Centre,
    /// Its centre and the centres of its faces: 7 points.
    Faces,
    /// Its centre and its corners: 9 points.
    Corners,
    /// Its corners and the middles of its edges and faces, without its centre: 26 points. A box hides
    /// its own centre, and this is how much of it shows.
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
}

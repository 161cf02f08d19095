/// A detection that continues a track.
#[derive(Clone, Copy, Debug)]
pub(super) struct Continuation {
    pub(super) distance: f64,
    /// The slot of the belief with the track.
    pub(super) old: u32,
    /// The slot of the detection.
    pub(super) fresh: u32,
}

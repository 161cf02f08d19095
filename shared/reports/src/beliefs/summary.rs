use std::collections::BTreeSet;

use serde::Serialize;

/// Statistics of the processed input, for the end of the report.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// The instant of the first frame, in nanoseconds of the recording's clock.
    pub first_at_ns: Option<u64>,
    /// The newest instant.
    pub last_at_ns: Option<u64>,
    /// Frames processed.
    pub frames: u64,
    /// Frames older than one before them, which were processed at that one's instant.
    pub earlier: u64,
    /// Observations accepted, of things, persons and occluders.
    pub observations: u64,
    /// Observations rejected, by reason.
    pub refused: Vec<Refusal>,
    /// Observations dropped because there was no room.
    pub left_out: u64,
    /// Whether the recording ended in the middle of a frame.
    pub cut_short: bool,
    /// Partners that were observed and whose beliefs were not simulated.
    pub not_simulated: BTreeSet<u16>,
    /// The settings that were changed to the literal text of the paper.
    pub literal: Vec<String>,
}

/// Observations rejected for one reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Refusal {
    /// The reason.
    pub reason: String,
    /// Number of observations.
    pub observations: u64,
    /// Position of the first of them in the recording.
    pub first: String,
}

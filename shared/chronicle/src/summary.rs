use std::collections::BTreeSet;

use serde::Serialize;

/// What went in, to be told at the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// The instant of the first frame, in nanoseconds of the recording's clock.
    pub first_at_ns: Option<u64>,
    /// The newest instant.
    pub last_at_ns: Option<u64>,
    /// Frames taken in.
    pub frames: u64,
    /// Frames of those that are earlier than one before them, and were taken as of that one's instant.
    pub earlier: u64,
    /// Observations taken in, of things, persons and occluders.
    pub observations: u64,
    /// Observations refused, by reason.
    pub refused: Vec<Refusal>,
    /// Observations that found no room.
    pub left_out: u64,
    /// Whether the recording ended in the middle of a frame.
    pub cut_short: bool,
    /// Partners who were observed and whose beliefs were not simulated.
    pub not_simulated: BTreeSet<u16>,
    /// The settings that were changed to what the paper literally says.
    pub literal: Vec<String>,
}

/// Observations refused for one reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Refusal {
    /// Why.
    pub reason: String,
    /// How many.
    pub observations: u64,
    /// Where the first of them stands.
    pub first: String,
}

//! Number conversions with defined behaviour at the limits.

pub mod number;

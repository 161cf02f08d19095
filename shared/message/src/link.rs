use crate::{Histogram, ZeroCopySend};

/// Health of the link to another machine, counted since this incarnation of the link process started. The link
/// process writes it to its board. Delays are between the two machines, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/LinkHealth/1")]
pub struct LinkHealth {
    /// Whether the link to the other machine is up: 1 yes, 0 no.
    pub is_up: u64,
    /// Number of times that the link came up: once, and once more after each interruption.
    pub sessions: u64,
    /// The last round-trip time, without the processing time of the other machine.
    pub round_trip_ns: u64,
    /// Bound on the error of time stamps received over the link, from the uncertainty of the clock offset.
    pub clock_error_ns: u64,
    /// Frames passed to the network.
    pub sent: u64,
    /// Frames replaced by a newer one of their topic before they were sent, because the network is slower than their
    /// writer.
    pub overtaken: u64,
    /// Frames dropped while the link was down, because of their age or number.
    pub expired: u64,
    /// Frames received and published here.
    pub received: u64,
    /// Batches sent to this machine that did not arrive.
    pub lost: u64,
    /// Frames and messages of the other machine that were malformed or of another version.
    pub refused: u64,
    /// Commands that arrived too late to be executed.
    pub late: u64,
    /// Bytes passed to the network.
    pub bytes_sent: u64,
    /// Bytes received.
    pub bytes_received: u64,
    /// One-way delay of batches from the other machine, with an error of at most [`Self::clock_error_ns`].
    pub delay: Histogram,
}

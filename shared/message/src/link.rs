use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::Histogram;

/// How the link to another machine fares, since the link process's life began: it writes this to a board of
/// its own. Delays are between the two machines, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/LinkHealth/1")]
pub struct LinkHealth {
    /// Whether the other machine is heard now: 1 yes, 0 no.
    pub is_heard: u64,
    /// How often it came to be heard: once, and once more after each silence.
    pub hearings: u64,
    /// The newest round trip to the other machine and back, without the time that it took to answer.
    pub round_trip_ns: u64,
    /// By how much the instants of frames that came over the link are wrong at most: what is not known of the
    /// difference between the two machines' clocks.
    pub clock_error_ns: u64,
    /// Frames that were handed to the network.
    pub sent: u64,
    /// Frames that were not sent because a newer one of their topic overtook them: the network is slower than
    /// their writer.
    pub overtaken: u64,
    /// Frames that waited for the other machine for too long, or were too many, and were given up.
    pub given_up: u64,
    /// Frames that came and were published here.
    pub received: u64,
    /// Bundles of frames that were sent to this machine and did not arrive.
    pub lost: u64,
    /// Frames and messages from the other machine that were nonsense, or of another version.
    pub refused: u64,
    /// Commands that came too late to be carried out.
    pub late: u64,
    /// Bytes that were handed to the network.
    pub bytes_sent: u64,
    /// Bytes that came.
    pub bytes_received: u64,
    /// How long bundles of frames took from the other machine to this one, wrong by
    /// [`Self::clock_error_ns`] at most.
    pub delay: Histogram,
}

use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::bytes::laid_out;
use crate::{BeliefHead, DivergenceHead, PerceptHead, SceneHead, numbered};

numbered! {
    /// A point on the way of a frame, in the direction the data flows.
    Hop: u16 {
        /// The source published the observations.
        Observed = 0,
        /// The sensor process began the cycle that read them.
        SensorStarted = 1,
        /// The sensor process published the percept buffer.
        Perceived = 2,
        /// The belief process began its step on it.
        BeliefStarted = 3,
        /// The belief process published the belief buffers.
        Believed = 4,
        /// The learner published the joint goals.
        Decided = 5,
        /// The motor process took the joint goals.
        Commanded = 6,
        /// The motor process published the joint states.
        Moved = 7,
    }
}

/// The beginning of every frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Header/1")]
pub struct Header {
    /// The instant that the frame speaks about, in nanoseconds of the clock.
    pub valid_at_ns: u64,
    /// Counts the writer's frames from one, without gaps: a gap at the reader is a loss.
    pub sequence: u64,
    /// Counts the writer's lives from one: a change says that its memory began anew.
    pub incarnation: u64,
    /// When the frame, or what it was made from, passed each hop; zero where it did not.
    pub hops_ns: [u64; 8],
    /// Entries that did not fit into this frame, or into those it was made from, and were left out.
    pub left_out: u64,
}

impl Header {
    /// A header that speaks about `valid_at_ns`, to be numbered by the outlet that sends it.
    #[must_use]
    pub fn at(valid_at_ns: u64) -> Self {
        Self { valid_at_ns, ..Self::default() }
    }

    /// The same way travelled and losses suffered, for a frame made from this one.
    #[must_use]
    pub fn onwards(&self) -> Self {
        Self {
            valid_at_ns: self.valid_at_ns,
            hops_ns: self.hops_ns,
            left_out: self.left_out,
            ..Self::default()
        }
    }

    /// Stamps a hop.
    pub fn pass(&mut self, hop: Hop, at_ns: u64) {
        if let Some(stamp) = self.hops_ns.get_mut(usize::from(hop.raw())) {
            *stamp = at_ns;
        }
    }

    /// When the frame passed a hop, if it did.
    #[must_use]
    pub fn passed(&self, hop: Hop) -> Option<u64> {
        self.hops_ns.get(usize::from(hop.raw())).copied().filter(|&stamp| stamp != 0)
    }
}

/// What stands before the entries of a frame and begins with a [`Header`].
pub trait Head: ZeroCopySend + Copy + Default + std::fmt::Debug + 'static {
    /// The frame's header.
    fn header(&self) -> &Header;
    /// The frame's header.
    fn header_mut(&mut self) -> &mut Header;
}

impl Head for Header {
    fn header(&self) -> &Header {
        self
    }

    fn header_mut(&mut self) -> &mut Header {
        self
    }
}

/// Heads that have a header and say more beside it.
macro_rules! headed {
    ($($head:ty),*) => {$(
        impl Head for $head {
            fn header(&self) -> &Header {
                &self.header
            }

            fn header_mut(&mut self) -> &mut Header {
                &mut self.header
            }
        }
    )*};
}

headed!(BeliefHead, DivergenceHead, PerceptHead, SceneHead);

laid_out!(Header = "leo/Header/1" {
    valid_at_ns, sequence, incarnation, hops_ns, left_out
});

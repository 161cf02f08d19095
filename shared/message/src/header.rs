use crate::bytes::impl_bytes;
use crate::{BeliefHead, DivergenceHead, PerceptHead, SceneHead, ZeroCopySend, wire_enum};

wire_enum! {
    /// A stage that a frame passes, in the direction of the data flow.
    Hop: u16 {
        /// The source published the observations.
        Observed = 0,
        /// The sensor process started the cycle that read them.
        SensorStarted = 1,
        /// The sensor process published the percept buffer.
        Perceived = 2,
        /// The belief process started its step on the percepts.
        BeliefStarted = 3,
        /// The belief process published the belief buffers.
        Believed = 4,
        /// The learner published the joint goals.
        Decided = 5,
        /// The motor process received the joint goals.
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
    /// Time stamp of the frame's content, in nanoseconds of the clock.
    pub valid_at_ns: u64,
    /// Sequence number of the writer's frames, from one without gaps. A gap at the reader means lost frames.
    pub sequence: u64,
    /// Incarnation of the writer, from one. A change means that the writer restarted and lost its state.
    pub incarnation: u64,
    /// When the frame or its inputs passed each hop; zero for hops not passed.
    pub hops_ns: [u64; 8],
    /// Number of entries left out for lack of space, in this frame or its inputs.
    pub over_capacity: u64,
}

impl Header {
    /// A header with time stamp `valid_at_ns`. The publisher assigns the sequence number.
    #[must_use]
    pub fn at(valid_at_ns: u64) -> Self {
        Self { valid_at_ns, ..Self::default() }
    }

    /// A header for a frame derived from this one: keeps time stamp, hop times and number of left out entries.
    #[must_use]
    pub fn header_for_derived(&self) -> Self {
        Self {
            valid_at_ns: self.valid_at_ns,
            hops_ns: self.hops_ns,
            over_capacity: self.over_capacity,
            ..Self::default()
        }
    }

    /// Records when the frame passed a hop.
    pub fn pass(&mut self, hop: Hop, at_ns: u64) {
        if let Some(stamp) = self.hops_ns.get_mut(usize::from(hop.raw())) {
            *stamp = at_ns;
        }
    }

    /// When the frame passed a hop; `None` if it did not.
    #[must_use]
    pub fn hop_time(&self, hop: Hop) -> Option<u64> {
        self.hops_ns.get(usize::from(hop.raw())).copied().filter(|&stamp| stamp != 0)
    }
}

/// The head of a frame, which begins with a [`Header`].
pub trait Head: ZeroCopySend + Copy + Default + std::fmt::Debug + 'static {
    /// The frame's header.
    fn header(&self) -> &Header;
    /// Mutable access to the frame's header.
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

/// Implements [`Head`] for heads with a `header` field.
macro_rules! impl_head {
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

impl_head!(BeliefHead, DivergenceHead, PerceptHead, SceneHead);

impl_bytes!(Header = "leo/Header/1" {
    valid_at_ns, sequence, incarnation, hops_ns, over_capacity
});

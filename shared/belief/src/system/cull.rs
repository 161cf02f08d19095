use std::fmt;

use clock::Instant;
use message::Remembered;

use crate::storage::{Memory, Sample};

/// A culling function c (Eq. 5), for `when = { plugin = "NAME" }`.
///
/// ```
/// use belief::{Cull, CullContext};
///
/// /// Culls beliefs with a single observation, as reflections.
/// struct SeenOnce;
///
/// impl Cull for SeenOnce {
///     fn agrees(&self, belief: &CullContext<'_>) -> bool {
///         belief.observations() == 1
///     }
/// }
/// ```
pub trait Cull: Send + Sync {
    /// Whether the belief may be culled. It is culled if every culling function agrees. Must not allocate.
    fn agrees(&self, belief: &CullContext<'_>) -> bool;
}

/// Only says that there is one: a plug-in function has no contents to show.
impl fmt::Debug for dyn Cull {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Supplied")
    }
}

/// Read access to a belief that is tested for culling.
pub struct CullContext<'a> {
    pub(crate) now: Instant,
    pub(crate) memory: &'a Memory,
    pub(crate) place: Option<[f32; 3]>,
    pub(crate) remembered: &'a dyn Fn(u16) -> Option<Sample>,
    pub(crate) in_view: &'a dyn Fn([f32; 3]) -> bool,
}

impl CullContext<'_> {
    /// The present instant.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Time of the first observation.
    #[must_use]
    pub const fn born_at(&self) -> Instant {
        self.memory.born_at
    }

    /// Time of the last observation. It is earlier than [`Self::now`] by the processing delay of its source.
    #[must_use]
    pub const fn perceived_at(&self) -> Instant {
        self.memory.perceived_at
    }

    /// Whether an observation was added to the belief in this step.
    #[must_use]
    pub fn is_perceived(&self) -> bool {
        self.memory.updated_at >= self.now
    }

    /// Since when the belief's position is observed to be empty, in view of a source that saw it before. `None` if it
    /// is not, or if no configured culling function needs it.
    #[must_use]
    pub const fn empty_since(&self) -> Option<Instant> {
        self.memory.empty_since
    }

    /// Number of observations of the belief.
    #[must_use]
    pub const fn observations(&self) -> u64 {
        self.memory.observations
    }

    /// The agent last perceived to hold it, or [`message::NOBODY`].
    #[must_use]
    pub const fn held_by(&self) -> u16 {
        self.memory.held_by
    }

    /// Remembered position, in metres in the perspective's frame.
    #[must_use]
    pub const fn place_m(&self) -> Option<[f32; 3]> {
        self.place
    }

    /// Whether that position is now in view of a source that saw the thing before; `None` if it has no position.
    #[must_use]
    pub fn is_in_view(&self) -> Option<bool> {
        self.place.map(|place| (self.in_view)(place))
    }

    /// A percept, evaluated at the present instant (Eq. 3).
    #[must_use]
    pub fn percept(&self, percept: u16) -> Option<Remembered> {
        let Sample { at, matching, confidence, feature } = (self.remembered)(percept)?;
        Some(Remembered::new(percept, at.as_nanos(), matching, confidence, feature))
    }
}

impl fmt::Debug for CullContext<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Doubtful({:?} at {:?})", self.memory, self.now)
    }
}

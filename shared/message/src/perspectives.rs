use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::Path;

/// Perspectives of which a board can tell: as many as a robot can keep
/// ([`PERSPECTIVES_MOST`](crate::PERSPECTIVES_MOST)).
pub const MAX_PERSPECTIVES: usize = 256;

/// What was computed of one perspective, since its process's life began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/PerspectiveHealth/2")]
pub struct PerspectiveHealth {
    /// Whose it is, and within whose.
    pub path: Path,
    /// How often its beliefs were brought to an instant.
    pub steps: u64,
    /// Beliefs that it held after each of these steps, all together.
    pub beliefs: u64,
    /// Observations, beliefs and occluders for which it had no room.
    pub left_out: u64,
    /// Observations and evaluations that it refused as nonsense.
    pub refused: u64,
}

/// What was computed of each perspective: the belief process writes it to a board of its own. Where
/// perspective taking is off there is one, the robot's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Perspectives/2")]
pub struct Perspectives {
    /// How many perspectives there are.
    pub count: u64,
    /// Each of them, by its number.
    pub perspectives: [PerspectiveHealth; MAX_PERSPECTIVES],
}

impl Default for Perspectives {
    fn default() -> Self {
        Self { count: 0, perspectives: [PerspectiveHealth::default(); MAX_PERSPECTIVES] }
    }
}

impl Perspectives {
    /// The perspectives that there are, in the order of their numbers.
    #[must_use]
    pub fn all(&self) -> &[PerspectiveHealth] {
        let count = usize::try_from(self.count).unwrap_or(MAX_PERSPECTIVES).min(MAX_PERSPECTIVES);
        self.perspectives.get(..count).unwrap_or(&[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lying_count_shows_no_more_perspectives_than_there_is_room_for() {
        let count = |count| Perspectives { count, ..Perspectives::default() }.all().len();
        assert_eq!((count(u64::MAX), count(2)), (MAX_PERSPECTIVES, 2));
    }

    #[test]
    fn there_is_room_for_as_many_as_a_robot_can_keep() {
        assert_eq!(usize::try_from(crate::PERSPECTIVES_MOST), Ok(MAX_PERSPECTIVES));
    }
}

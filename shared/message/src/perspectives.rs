use crate::{Path, ZeroCopySend, filled};

/// Maximum number of perspectives of a robot, its own included.
pub const MAX_PERSPECTIVES: usize = 256;

/// Counters of one perspective, since this incarnation of the process started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/PerspectiveHealth/2")]
pub struct PerspectiveHealth {
    /// Its path.
    pub path: Path,
    /// Number of update steps.
    pub steps: u64,
    /// Sum over these steps of the number of beliefs after the step.
    pub beliefs: u64,
    /// Observations, beliefs and occluders dropped for lack of space.
    pub over_capacity: u64,
    /// Observations and evaluations refused as invalid.
    pub refused: u64,
}

/// Counters of all perspectives. The belief process writes them to its board. Without perspective taking there is
/// one, the robot's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Perspectives/2")]
pub struct Perspectives {
    /// Number of perspectives.
    pub count: u64,
    /// The perspectives, by number.
    pub perspectives: [PerspectiveHealth; MAX_PERSPECTIVES],
}

impl Default for Perspectives {
    fn default() -> Self {
        Self { count: 0, perspectives: [PerspectiveHealth::default(); MAX_PERSPECTIVES] }
    }
}

impl Perspectives {
    /// The perspectives in use, by number.
    #[must_use]
    pub fn all(&self) -> &[PerspectiveHealth] {
        filled(&self.perspectives, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_false_perspective_count_is_limited_to_the_capacity() {
        let count = |count| Perspectives { count, ..Perspectives::default() }.all().len();
        assert_eq!((count(u64::MAX), count(2)), (MAX_PERSPECTIVES, 2));
    }
}

use crate::{JointCause, JointMode, JointState, ZeroCopySend, filled};

/// Capacity of the board in joints. Further joints of a larger body are only in the topic.
pub const MAX_JOINTS: usize = 256;

/// The newest joint states, on a board of the motor process, for occasional readers. Unlike a subscriber to the
/// topic, a reader of a board costs the writer no memory.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Joints/2")]
pub struct Joints {
    /// Number of joints.
    pub count: u64,
    /// Number of times that a joint was locked since the motor process started. An acknowledgement contains the last
    /// value read, so that it never covers a newer lock.
    pub locks: u64,
    /// Goals beyond a joint's limits, which were clamped.
    pub limited: u64,
    /// Goals refused: not a number, or for an unknown joint.
    pub refused: u64,
    /// The joint states.
    pub states: [JointState; MAX_JOINTS],
}

impl Default for Joints {
    fn default() -> Self {
        let unread = JointState::unread(u32::MAX, JointMode::Limp, JointCause::NotStarted);
        Self { count: 0, locks: 0, limited: 0, refused: 0, states: [unread; MAX_JOINTS] }
    }
}

impl Joints {
    /// The joint states in use.
    #[must_use]
    pub fn all(&self) -> &[JointState] {
        filled(&self.states, self.count)
    }

    /// Replaces the states. States beyond the capacity are counted, but not stored.
    pub fn set(&mut self, states: impl Iterator<Item = JointState>) {
        let mut slots = self.states.iter_mut();
        self.count = 0;
        for state in states {
            if let Some(slot) = slots.next() {
                *slot = state;
            }
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_false_count_is_limited_to_the_capacity() {
        let state = |joint| JointState::unread(joint, JointMode::Limp, JointCause::NotStarted);
        let mut joints = Joints::default();
        joints.set((0..300).map(state));
        assert_eq!((joints.all().len(), joints.count), (MAX_JOINTS, 300));
        joints.set((0..65).map(state));
        assert_eq!((joints.all().len(), joints.all().last().map(|last| last.joint)), (65, Some(64)));
        assert_eq!(Joints { count: u64::MAX, ..Joints::default() }.all().len(), MAX_JOINTS);
    }
}

use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::{JointCause, JointMode, JointState};

/// Joints of which a board can tell; those of a body that has more are told by its topic alone.
pub const MAX_JOINTS: usize = 256;

/// The newest joint states, for whoever looks now and then: the motor process writes them to a board of
/// its own. Who reads a topic is known to its writer, and costs it a page now and then; who reads a board
/// is not.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Joints/2")]
pub struct Joints {
    /// How many joints there are.
    pub count: u64,
    /// How often a joint was locked since the motor process started. An acknowledgement names the newest that
    /// was seen, so that it acknowledges no other.
    pub locks: u64,
    /// Goals beyond a joint's limits, which became the limit.
    pub limited: u64,
    /// Goals refused: no number, or for no joint.
    pub refused: u64,
    /// What each of them does.
    pub states: [JointState; MAX_JOINTS],
}

impl Default for Joints {
    fn default() -> Self {
        let unread = JointState::unread(u32::MAX, JointMode::Limp, JointCause::NotStarted);
        Self { count: 0, locks: 0, limited: 0, refused: 0, states: [unread; MAX_JOINTS] }
    }
}

impl Joints {
    /// What the joints do.
    #[must_use]
    pub fn all(&self) -> &[JointState] {
        let count = usize::try_from(self.count).unwrap_or(MAX_JOINTS).min(MAX_JOINTS);
        self.states.get(..count).unwrap_or(&[])
    }

    /// Puts other states in place of these; those that there is no room for are counted and left out.
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
    fn what_there_is_room_for_is_told_and_a_lying_count_tells_no_more() {
        let state = |joint| JointState::unread(joint, JointMode::Limp, JointCause::NotStarted);
        let mut joints = Joints::default();
        joints.set((0..300).map(state));
        assert_eq!((joints.all().len(), joints.count), (MAX_JOINTS, 300));
        joints.set((0..65).map(state));
        assert_eq!((joints.all().len(), joints.all().last().map(|last| last.joint)), (65, Some(64)));
        assert_eq!(Joints { count: u64::MAX, ..Joints::default() }.all().len(), MAX_JOINTS);
    }
}

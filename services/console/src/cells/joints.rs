use message::JointState;

use super::rounded;
use crate::state_store::StateStore;
use crate::view::JointStateRow;

/// Publishes the joint positions, and the state machines of the joints in trouble.
pub(crate) fn joints(state_store: &mut StateStore, names: &[String], states: &[JointState]) {
    let mut positions = vec![None; names.len()];
    let mut trouble = Vec::new();
    for state in states {
        let joint = usize::try_from(state.joint).unwrap_or(usize::MAX);
        let (Some(slot), Some(name)) = (positions.get_mut(joint), names.get(joint)) else { continue };
        *slot = state.present_position_rad().and_then(|position_rad| rounded(position_rad, 1e3));
        if state.is_in_trouble() {
            trouble.push(JointStateRow::of(name.clone(), state));
        }
    }
    state_store.put("joints", &positions);
    state_store.put("joint-trouble", &trouble);
}

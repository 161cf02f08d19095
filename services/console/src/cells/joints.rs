use message::{JointCause, JointState};

use super::rounded;
use crate::state_store::StateStore;
use crate::view::JointStateRow;

/// Publishes the joint positions, the state machines of the joints in trouble, and how many joints were stopped.
pub(crate) fn joints(state_store: &mut StateStore, names: &[String], states: &[JointState]) {
    let mut positions = vec![None; names.len()];
    let mut trouble = Vec::new();
    let (mut ended, mut emergency) = (0, 0);
    for state in states {
        let joint = usize::try_from(state.joint).unwrap_or(usize::MAX);
        let (Some(slot), Some(name)) = (positions.get_mut(joint), names.get(joint)) else { continue };
        *slot = state.present_position_rad().and_then(|position_rad| rounded(position_rad, 1e3));
        if state.is_in_trouble() {
            trouble.push(JointStateRow::of(name.clone(), state));
        }
        if state.is_stopped() {
            let is_end = state.cause() == Some(JointCause::Stopped);
            *(if is_end { &mut ended } else { &mut emergency }) += 1;
        }
    }
    state_store.put("joints", &positions);
    state_store.put("joint-trouble", &trouble);
    state_store.put("joints-stopped", &serde_json::json!({ "ended": ended, "emergency": emergency }));
}

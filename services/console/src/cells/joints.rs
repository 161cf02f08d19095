use message::{JointCause, JointMode, JointState};
use serde_json::json;

use super::rounded;
use crate::state_store::StateStore;

/// Publishes the joint positions, and the state machines of the joints in trouble.
pub(crate) fn joints(state_store: &mut StateStore, names: &[String], states: &[JointState]) {
    let mut positions = vec![None; names.len()];
    let mut trouble = Vec::new();
    for state in states {
        let joint = usize::try_from(state.joint).unwrap_or(usize::MAX);
        let (Some(slot), Some(name)) = (positions.get_mut(joint), names.get(joint)) else { continue };
        *slot = state.present_position_rad().and_then(|position_rad| rounded(position_rad, 1e3));
        if state.is_in_trouble() {
            let machines = state.machines();
            trouble.push(json!({
                "joint": name,
                "mode": state.mode().map(JointMode::name),
                "cause": state.cause().map(JointCause::name),
                "link": machines.map(|machines| machines.link.name()),
                "power": machines.map(|machines| machines.power.name()),
                "arming": machines.map(|machines| machines.arming.name()),
                "arming_cause": machines.map(|machines| machines.arming_cause.name()),
                "motion": machines.map(|machines| machines.motion.name()),
            }));
        }
    }
    state_store.put("joints", &positions);
    state_store.put("joint-trouble", &trouble);
}

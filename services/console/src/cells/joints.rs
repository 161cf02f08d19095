use message::{JointCause, JointMode, JointState};
use serde_json::json;

use super::rounded;
use crate::sheet::Sheet;

/// Shows where the joints are, and which are in trouble.
pub(crate) fn joints(sheet: &mut Sheet, names: &[String], states: &[JointState]) {
    let mut positions = vec![None; names.len()];
    let mut trouble = Vec::new();
    for state in states {
        let joint = usize::try_from(state.joint).unwrap_or(usize::MAX);
        let (Some(slot), Some(name)) = (positions.get_mut(joint), names.get(joint)) else { continue };
        *slot = state.present_position_rad().and_then(|position_rad| rounded(position_rad, 1e3));
        let (mode, cause) = (state.mode(), state.cause());
        if mode != Some(JointMode::Following) || cause != Some(JointCause::None) {
            trouble.push(json!({
                "joint": name,
                "mode": mode.map(JointMode::name),
                "cause": cause.map(JointCause::name),
            }));
        }
    }
    sheet.put("joints", &positions);
    sheet.put("joint-trouble", &trouble);
}

use message::{ArmingGroup, ArmingSummary, Joints};
use serde_json::{Value, json};

use crate::state_store::StateStore;

/// Publishes how many joints may move, and why the others may not.
pub(crate) fn arming(state_store: &mut StateStore, names: &[String], joints: &Joints, is_stopped: bool) {
    let summary = ArmingSummary::of(joints.all());
    let groups = |groups: &[ArmingGroup]| -> Value {
        groups
            .iter()
            .map(|group| {
                let name = |joint: &u32| usize::try_from(*joint).ok().and_then(|index| names.get(index));
                json!({
                    "cause": group.cause.name(),
                    "meaning": group.cause.meaning(),
                    "remedy": group.cause.remedy(),
                    "count": group.joints.len(),
                    "joints": group.joints.iter().filter_map(name).collect::<Vec<_>>(),
                })
            })
            .collect()
    };
    state_store.put(
        "arming",
        &json!({
            "joints": joints.all().len(),
            "armed": summary.armed,
            "disarmed": groups(&summary.disarmed),
            "locked": groups(&summary.locked),
            "locks": joints.locks,
            "stopped": is_stopped,
            "limited": joints.limited,
            "refused": joints.refused,
        }),
    );
}

#[cfg(test)]
mod tests {
    use message::{
        JointArming, JointCause, JointLink, JointMachines, JointMode, JointMotion, JointPower, JointState,
    };

    use super::*;

    #[test]
    fn locked_joints_are_listed_with_causes_and_lock_count() {
        let machines = JointMachines {
            link: JointLink::Answering,
            power: JointPower::Off,
            arming: JointArming::Locked,
            arming_cause: JointCause::Blocked,
            motion: JointMotion::Idle,
        };
        let state = |joint| JointState::unread(joint, JointMode::Limp, JointCause::Blocked);
        let armed = JointMachines {
            arming: JointArming::Armed,
            arming_cause: JointCause::None,
            motion: JointMotion::Track,
            ..machines
        };
        let mut joints = Joints { locks: 9, ..Joints::default() };
        joints.set([state(0).with_machines(armed), state(1).with_machines(machines)].into_iter());
        let mut state_store = StateStore::default();
        arming(&mut state_store, &["neck".to_owned(), "elbow".to_owned()], &joints, false);
        let shown: Value = serde_json::from_str(&state_store.since(0).unwrap()).unwrap();
        let cell = &shown["cells"]["arming"];
        assert_eq!((&cell["armed"], &cell["locks"], &cell["stopped"]), (&json!(1), &json!(9), &json!(false)));
        assert_eq!(cell["locked"][0]["joints"], json!(["elbow"]));
        assert_eq!(cell["locked"][0]["meaning"], JointCause::Blocked.meaning());
        assert_eq!(cell["disarmed"], json!([]));
    }
}

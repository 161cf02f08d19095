//! Two incompatible machines.

use crate::machine::{Machine, wait_until};
use crate::{Side, alone, free_port, keys_or_skip};

#[test]
fn differently_configured_machines_refuse_each_other_with_the_remedy() {
    let _alone = alone();
    let Some(keys) = keys_or_skip("DNS:localhost") else { return };
    let port = free_port();
    let away =
        Side::remote(&format!("quic/localhost:{port}")).keyed(keys.path(), "remote").with("partners", "2");
    let away = Machine::ready(None, "link-two", &away.changes());
    let robot = Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(keys.path(), "robot");
    let robot = Machine::ready(None, "link-alone", &robot.changes());
    let both = [&away, &robot];
    let refused = |machine: &Machine| machine.metric("leo_link_refused_total");
    // Both keep trying, and refuse each other's messages.
    assert!(
        wait_until(|| both.iter().all(|machine| refused(machine) > 20.0)),
        "{}\n{}",
        away.said(),
        robot.said()
    );
    for machine in both {
        let said = machine.said();
        let errors: Vec<&str> =
            said.lines().filter(|line| line.contains("ERROR") && line.contains("[belief]")).collect();
        let [error] = errors.as_slice() else { panic!("it is said once: {said}") };
        assert!(error.contains("`partners`") && error.contains("`depth`"), "{error}");
        let fares = machine.metrics();
        assert!(fares.contains_key("leo_link_up"), "{fares:?}");
        assert_eq!(machine.count("leo_link_up"), 0);
        assert_eq!(machine.count("leo_link_received_frames_total"), 0);
    }
}

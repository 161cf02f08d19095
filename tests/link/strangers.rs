//! Who is not heard.

use crate::machine::{Machine, wait_until};
use crate::{Side, alone, free_port, keys_or_skip};

#[test]
fn strangers_and_other_robots_are_not_heard() {
    let _alone = alone();
    let [Some(ours), Some(theirs)] = ["DNS:localhost"; 2].map(keys_or_skip) else { return };
    let port = free_port();
    let alone = |side: Side| side.with("off_board", "[]");
    let connect = format!("quic/localhost:{port}");
    // One whose keys another authority signed; one of another robot; and the right one, last.
    let stranger = alone(Side::away(&connect).keyed(theirs.path(), "away"));
    let other = alone(Side::away(&connect).keyed(ours.path(), "away")).with("robot", "\"other\"");
    let right = alone(Side::away(&connect).keyed(ours.path(), "away"));
    let robot = alone(Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(ours.path(), "robot"));
    let robot = Machine::ready(None, "link-one", &robot.changes());
    let stranger = Machine::ready(None, "link-stranger", &stranger.changes());
    let other = Machine::ready(None, "link-other", &other.changes());
    let right = Machine::ready(None, "link-right", &right.changes());
    let received = |machine: &Machine| machine.metric("leo_link_received_frames_total");
    assert!(wait_until(|| received(&right) > 500.0), "{}\n{}", right.said(), robot.said());
    for silent in [&stranger, &other] {
        let fares = silent.metrics();
        assert!(fares.contains_key("leo_link_heard"), "{fares:?}");
        assert_eq!((silent.metric("leo_link_heard"), received(silent)), (0.0, 0.0), "{}", silent.said());
    }
}

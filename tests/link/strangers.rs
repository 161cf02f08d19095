//! Foreign machines and other robots are not connected.

use crate::machine::{Machine, wait_until};
use crate::{Side, alone, free_port, keys_or_skip};

#[test]
fn unknown_peers_and_other_robots_are_refused() {
    let _alone = alone();
    let [Some(ours), Some(theirs)] = ["DNS:localhost"; 2].map(keys_or_skip) else { return };
    let port = free_port();
    let alone = |side: Side| side.with("remote_processes", "[]");
    let connect = format!("quic/localhost:{port}");
    // One with keys of another authority, one of another robot, and finally the right one.
    let stranger = alone(Side::remote(&connect).keyed(theirs.path(), "remote"));
    let other = alone(Side::remote(&connect).keyed(ours.path(), "remote")).with("robot", "\"other\"");
    let right = alone(Side::remote(&connect).keyed(ours.path(), "remote"));
    let robot = alone(Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(ours.path(), "robot"));
    let robot = Machine::ready(None, "link-one", &robot.changes());
    let stranger = Machine::ready(None, "link-stranger", &stranger.changes());
    let other = Machine::ready(None, "link-other", &other.changes());
    let right = Machine::ready(None, "link-right", &right.changes());
    let received = |machine: &Machine| machine.metric("leo_link_received_frames_total");
    assert!(wait_until(|| received(&right) > 500.0), "{}\n{}", right.said(), robot.said());
    for silent in [&stranger, &other] {
        let fares = silent.metrics();
        assert!(fares.contains_key("leo_link_up"), "{fares:?}");
        assert_eq!((silent.metric("leo_link_up"), received(silent)), (0.0, 0.0), "{}", silent.said());
    }
    // Both sides report the reason, the certificate and the advice. The other authority has the same name.
    let issuer = "its issuer has the name of the authority of this machine";
    for (machine, parts) in [
        (
            &stranger,
            [&format!("the certificate of {connect} (CN=robot, issued by"), issuer, "package/link_keys.sh"],
        ),
        (
            &robot,
            [
                "127.0.0.1 refuses the certificate of this machine (",
                "robot.pem): its issuer",
                "package/link_keys.sh",
            ],
        ),
        (
            &other,
            [
                &format!("no connection with {connect}"),
                "its link belongs to another robot",
                "the same `robot` in [link]",
            ],
        ),
        (
            &robot,
            [
                "no connection with 127.0.0.1",
                "its link belongs to another robot",
                "the same `robot` in [link]",
            ],
        ),
    ] {
        let says = || machine.said().lines().any(|line| parts.iter().all(|part| line.contains(part)));
        assert!(wait_until(says), "{parts:?}\n{}", machine.said());
    }
}

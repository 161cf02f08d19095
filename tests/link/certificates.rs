//! Results of certificates in both roles, with a peer of another implementation and the robot's log.

use crate::machine::{Machine, wait_until};
use crate::peer::{OF_ROBOT, Peer, TO_ROBOT, number, word};
use crate::{Side, alone, free_port, keys_or_skip};

/// The result of a certificate.
#[derive(Clone, Copy)]
enum Gets {
    /// Accepted.
    In,
    /// The peer gets a TLS alert and the robot logs this sentence.
    Alert(u64, &'static str),
}
use Gets::{Alert, In};

const EXPIRED: &str = "(CN=expired, issued by CN=the authority of a link of Leo) is refused: it expired on ";
const EARLY: &str =
    "(CN=early, issued by CN=the authority of a link of Leo) is refused: it is not valid before ";
const SELF_SIGNED: &str =
    "(CN=self-signed, issued by CN=self-signed) is refused: it is self-signed. Sign a new one";
const SELF_MADE: &str =
    "(CN=self-made, issued by CN=self-made) is refused: it is the certificate of an authority";
const STRANGER: &str = "(CN=stranger, issued by CN=another authority) is refused: its issuer is not the authority of \
                        this machine (";
const NAMESAKE: &str = "(CN=namesake, issued by CN=the authority of a link of Leo) is refused: its issuer has the name \
                        of the authority of this machine (";
const AUTHORITY: &str = "(CN=the authority of a link of Leo, issued by CN=the authority of a link of Leo) is refused: \
                         it is the certificate of an authority, not of a machine";
const SERVER: &str = "(CN=server, issued by CN=the authority of a link of Leo) is refused: its extendedKeyUsage does \
                      not allow this side";
const CLIENT: &str = "(CN=client, issued by CN=the authority of a link of Leo) is refused: its extendedKeyUsage does \
                      not allow this side";
const OTHER_NAME: &str = "(CN=other-name, issued by CN=the authority of a link of Leo) is refused: it is for \
                          DnsName(\"elsewhere.example\"), and `connect` of [link] expects localhost";
const NONE: &str = "127.0.0.1 sent no certificate. A link needs one from the authority of this machine (";

/// For each certificate of a peer: the result when the peer connects, and when the robot connects.
const TABLE: [(&str, Gets, Option<Gets>); 13] = [
    ("right", In, Some(In)),
    ("expired", Alert(45, EXPIRED), Some(Alert(45, EXPIRED))),
    ("early", Alert(45, EARLY), Some(Alert(45, EARLY))),
    ("self-signed", Alert(48, SELF_SIGNED), Some(Alert(48, SELF_SIGNED))),
    ("self-made", Alert(46, SELF_MADE), Some(Alert(46, SELF_MADE))),
    ("stranger", Alert(48, STRANGER), Some(Alert(48, STRANGER))),
    ("namesake", Alert(51, NAMESAKE), Some(Alert(51, NAMESAKE))),
    ("authority", Alert(46, AUTHORITY), Some(Alert(46, AUTHORITY))),
    ("server", Alert(43, SERVER), Some(In)),
    ("client", In, Some(Alert(43, CLIENT))),
    ("any", In, Some(In)),
    // A client's name is not checked.
    ("other-name", In, Some(Alert(42, OTHER_NAME))),
    // A server without a certificate is impossible.
    ("none", Alert(116, NONE), None),
];

/// Whether the log has this sentence, with advice.
fn says(robot: &Machine, sentence: &str) -> bool {
    robot.said().lines().any(|line| line.contains(sentence) && line.contains("package/link_keys.sh"))
}

fn assert_gets(robot: &Machine, name: &str, gets: Gets, line: &serde_json::Value) {
    match gets {
        In => assert_eq!(word(line, "came"), "talked to", "{name}: {line}\n{}", robot.said()),
        Alert(alert, sentence) => {
            assert_eq!((word(line, "came"), number(line, "alert")), ("ended", Some(alert)), "{name}: {line}");
            assert!(wait_until(|| says(robot, sentence)), "{name}: {sentence}\n{}", robot.said());
        }
    }
}

#[test]
fn each_certificate_of_a_foreign_peer_gives_the_results_of_the_table() {
    let _alone = alone();
    let (Some(keys), Some(peer)) = (keys_or_skip("DNS:localhost"), Peer::or_skip()) else { return };
    let folder = keys.path().to_str().expect("a name");
    peer.run(&["sign", folder]);

    // The peers that the robot connects to.
    let awaiting: Vec<&str> =
        TABLE.iter().filter(|(_, _, there)| there.is_some()).map(|(name, ..)| *name).collect();
    let mut servers = peer.start(&[&["serve", OF_ROBOT, folder], &awaiting[..]].concat());
    let ports = awaiting.iter().map(|_| number(&servers.line().expect("a port"), "port").expect("a port"));
    let everywhere: Vec<String> = ports.map(|port| format!("\"quic/localhost:{port}\"")).collect();

    let port = free_port();
    let robot = Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(keys.path(), "robot");
    let robot = robot.with("connect", &format!("[{}]", everywhere.join(", "))).with("remote_processes", "[]");
    let robot = Machine::ready(None, "link-table", &robot.changes());
    let mut left = awaiting;
    while !left.is_empty() {
        let line = servers.line().expect("it says what comes");
        let name = word(&line, "name");
        let Some((name, _, Some(gets))) = TABLE.iter().find(|(of, ..)| *of == name) else { panic!("{line}") };
        // The robot connects repeatedly, and reports each once.
        left.retain(|of| of != name);
        assert_gets(&robot, name, *gets, &line);
    }
    drop(servers);

    // The peers that connect to the robot, one by one.
    let (port, names) = (port.to_string(), TABLE.map(|(name, ..)| name));
    let came = peer.run(&[&["connect", &port, TO_ROBOT, folder], &names[..]].concat());
    assert_eq!(came.len(), TABLE.len());
    for ((name, gets, _), line) in TABLE.iter().zip(&came) {
        assert_gets(&robot, name, *gets, line);
    }
}

#[test]
fn a_peer_of_another_protocol_or_robot_is_refused_before_any_certificate() {
    let _alone = alone();
    let (Some(keys), Some(peer)) = (keys_or_skip("DNS:localhost"), Peer::or_skip()) else { return };
    let folder = keys.path().to_str().expect("a name");
    let port = free_port();
    let robot = Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(keys.path(), "robot");
    let robot = Machine::ready(None, "link-protocol", &robot.with("remote_processes", "[]").changes());
    let port = port.to_string();
    for (protocol, is_let_in) in
        [("", false), ("h3", false), ("leo-link/other/remote", false), (OF_ROBOT, false), (TO_ROBOT, true)]
    {
        let came = peer.run(&["connect", &port, protocol, folder, "remote"]);
        let line = came.first().expect("what came");
        let alert = (word(line, "came") == "ended").then(|| number(line, "alert").expect("an alert"));
        // `no_application_protocol` (RFC 7301): it is sent instead of the server's first message.
        assert_eq!(alert, (!is_let_in).then_some(120), "{protocol}: {line}");
    }
    let sentence =
        "no connection with 127.0.0.1: its link belongs to another robot, or has the same side as this one";
    assert!(wait_until(|| robot.said().contains(sentence)), "{}", robot.said());
}

//! Who is let in, and whom a machine connects to.

use std::io::{BufRead as _, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use crate::machine::{Machine, PATIENCE, wait_until};
use crate::{Side, alone, free_port, keys};

#[test]
fn strangers_and_other_robots_are_not_heard() {
    let _alone = alone();
    let (ours, theirs) = (keys("DNS:localhost"), keys("DNS:localhost"));
    let port = free_port();
    let alone = |side: Side| side.with("off_board", "[]");
    let connect = format!("tls/localhost:{port}");
    // One whose keys another authority signed; one of another robot; and the right one, last.
    let stranger = alone(Side::away(&connect).keyed(theirs.path(), "away"));
    let other = alone(Side::away(&connect).keyed(ours.path(), "away")).with("robot", "\"other\"");
    let right = alone(Side::away(&connect).keyed(ours.path(), "away"));
    let robot = alone(Side::robot(&format!("tls/127.0.0.1:{port}")).keyed(ours.path(), "robot"));
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

/// A certificate that somebody shows.
#[derive(Clone, Copy, Debug)]
struct Shown {
    /// What is told of it when something is wrong.
    what: &'static str,
    /// Its files, without their endings; empty for none.
    file: &'static str,
    /// Whether a machine that is connected to lets its owner in.
    is_let_in: bool,
    /// Whether a machine that connects takes its owner for the one that it looks for.
    is_believed: bool,
}

/// All of one authority but the stranger's. Machines are looked for as `localhost`.
const SHOWN: [Shown; 8] = [
    Shown { what: "as the script makes it", file: "robot", is_let_in: true, is_believed: true },
    Shown { what: "another authority's", file: "stranger", is_let_in: false, is_believed: false },
    Shown { what: "expired", file: "expired", is_let_in: false, is_believed: false },
    Shown { what: "the authority's own", file: "authority", is_let_in: false, is_believed: false },
    Shown { what: "for servers alone", file: "server", is_let_in: false, is_believed: true },
    Shown { what: "for clients alone", file: "client", is_let_in: true, is_believed: false },
    Shown { what: "for no purpose in particular", file: "any", is_let_in: true, is_believed: true },
    // Nobody looks for the one who comes: only whom one goes to must bear the name.
    Shown { what: "with another name", file: "away", is_let_in: true, is_believed: false },
];

/// Has the authority of a folder sign a certificate for `localhost` with these extensions, good for so many days.
fn sign(folder: &Path, name: &str, extensions: &str, days: &str) {
    let extensions = format!("subjectAltName=DNS:localhost\n{extensions}");
    std::fs::write(folder.join("extensions"), extensions).expect("writes");
    let (pem, private) = (format!("{name}.pem"), format!("{name}.key"));
    let request = format!(
        "req -new -newkey ec -pkeyopt ec_paramgen_curve:P-256 -noenc -subj /CN=some -keyout {private} -out request"
    );
    let signed = format!(
        "x509 -req -in request -CA authority.pem -CAkey authority.key -days {days} -extfile extensions -out {pem}"
    );
    for arguments in [request, signed] {
        let made = Command::new("openssl")
            .args(arguments.split(' '))
            .current_dir(folder)
            .output()
            .expect("openssl is there");
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    }
}

/// An `openssl` that talks to a machine; ends when dropped.
struct Openssl {
    child: Child,
    lines: Receiver<String>,
}

impl Openssl {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        // Each line as it comes: openssl keeps them to itself for as long as it is connected.
        let mut child = Command::new("stdbuf")
            .args(["-oL", "openssl"])
            .args(arguments)
            .current_dir(folder)
            // It ends with its input.
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("openssl and stdbuf are there");
        let (to, lines) = channel();
        let streams: [Box<dyn Read + Send>; 2] =
            [Box::new(child.stdout.take().expect("piped")), Box::new(child.stderr.take().expect("piped"))];
        for stream in streams {
            let to = to.clone();
            thread::spawn(move || {
                for line in BufReader::new(stream).lines().map_while(Result::ok) {
                    let _unread = to.send(line);
                }
            });
        }
        Self { child, lines }
    }

    /// The first line with one of these words; `None` where it ends without, or none comes for too long.
    fn hear(&self, words: &[&str]) -> Option<String> {
        let lines = std::iter::from_fn(|| self.lines.recv_timeout(PATIENCE).ok());
        let end = clock::now() + PATIENCE;
        let mut lines = lines.take_while(|_| clock::now() < end);
        lines.find(|line| words.iter().any(|word| line.contains(word)))
    }
}

impl Drop for Openssl {
    fn drop(&mut self) {
        let _dead = self.child.kill().and_then(|()| self.child.wait());
    }
}

/// What a machine says that refuses a certificate, to whoever showed it or none.
const REFUSED: &str = "alert";

#[test]
fn a_certificate_lets_in_whom_the_authority_meant_it_for_and_nobody_else() {
    let _alone = alone();
    let (ours, theirs) = (keys("DNS:localhost"), keys("DNS:localhost"));
    let folder = ours.path();
    sign(folder, "expired", "extendedKeyUsage=serverAuth,clientAuth", "-1");
    sign(folder, "server", "extendedKeyUsage=serverAuth", "9");
    sign(folder, "client", "extendedKeyUsage=clientAuth", "9");
    sign(folder, "any", "", "9");
    for ending in ["pem", "key"] {
        let from = theirs.path().join(format!("robot.{ending}"));
        std::fs::copy(from, folder.join(format!("stranger.{ending}"))).expect("copies");
    }

    // One robot that is connected to, and that connects to everybody itself.
    let port = free_port();
    let servers: Vec<(Shown, u16)> = SHOWN.iter().map(|shown| (*shown, free_port())).collect();
    let running: Vec<Openssl> = servers
        .iter()
        .map(|(Shown { file, .. }, port)| {
            let (pem, key) = (format!("{file}.pem"), format!("{file}.key"));
            let at = port.to_string();
            let arguments = [
                "s_server",
                "-accept",
                &at,
                "-cert",
                &pem,
                "-key",
                &key,
                "-CAfile",
                "authority.pem",
                "-Verify",
                "1",
            ];
            Openssl::start(folder, &arguments)
        })
        .collect();
    let endpoints: Vec<String> =
        servers.iter().map(|(_, port)| format!("\"tls/localhost:{port}\"")).collect();
    let robot = Side::robot(&format!("tls/127.0.0.1:{port}"))
        .keyed(folder, "robot")
        .with("off_board", "[]")
        .with("connect", &format!("[{}]", endpoints.join(", ")));
    let robot = Machine::ready(None, "link-door", &robot.changes());

    for ((Shown { what, is_believed, .. }, _), server) in servers.iter().zip(running) {
        let heard = server.hear(&[REFUSED, "CIPHER is"]).expect("it goes on until it is connected to");
        assert_eq!(!heard.contains(REFUSED), *is_believed, "{what}: {heard}\n{}", robot.said());
    }
    let at = format!("127.0.0.1:{port}");
    for Shown { what, file, is_let_in, .. } in SHOWN {
        let (pem, key) = (format!("{file}.pem"), format!("{file}.key"));
        let client = ["s_client", "-connect", &at, "-CAfile", "authority.pem", "-cert", &pem, "-key", &key];
        let heard = Openssl::start(folder, &client).hear(&[REFUSED, "New Session Ticket arrived"]);
        let heard = heard.expect("it is told either");
        assert_eq!(!heard.contains(REFUSED), is_let_in, "{what}: {heard}");
    }
    // Who shows none is told what is missing.
    let nobody = Openssl::start(folder, &["s_client", "-connect", &at, "-CAfile", "authority.pem"]);
    let heard = nobody.hear(&[REFUSED, "New Session Ticket arrived"]).expect("it is told either");
    assert!(heard.contains("certificate required"), "{heard}");
    // To be let in is not to be heard: none of them said a word of a link.
    assert!(robot.metrics().contains_key("leo_link_heard"));
    assert_eq!(robot.count("leo_link_hearings_total"), 0, "{}", robot.said());
}

use std::net::{Ipv4Addr, UdpSocket};
use std::rc::Rc;

use clock::Duration;
use config::Robot;
use config::leo::Side;
use quinn::ConnectionError;
use tokio::time::timeout;

use self::certificates::{client, everybody_or_skip, free_port, within};
use super::peers::Peers;
use super::*;
use crate::slots::MAX_UNRESERVED;
use crate::wire::Heartbeat;

pub(super) mod certificates;

/// The network's ends of the two queues.
type Ends = (mpsc::Receiver<(MessageKind, Vec<u8>)>, crossbeam::channel::Sender<Message>);

impl Net {
    /// A network without a thread.
    pub(crate) fn by_hand() -> (Self, Ends) {
        let (to, outgoing) = mpsc::channel(OUTGOING);
        let (incoming, from) = bounded(INCOMING);
        (Self { to: Some(to), from, thread: None }, (outgoing, incoming))
    }
}

/// Generous: the machine may be loaded.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Two machines of one robot: the first listens on a port, the second connects to it.
struct Pair {
    keys: tempfile::TempDir,
    port: u16,
}

impl Pair {
    fn or_skip() -> Option<Self> {
        everybody_or_skip().map(|keys| Self { keys, port: free_port() })
    }

    fn link(&self, side: Side, name: &str) -> Link {
        let mut link = Robot::load(None).unwrap().leo.link;
        link.side = side;
        let file = |ending: &str| self.keys.path().join(format!("{name}.{ending}"));
        (link.certificate, link.private_key) = (file("pem"), file("key"));
        link.ca_certificate = self.keys.path().join("authority.pem");
        link
    }

    fn robot(&self) -> Net {
        let mut link = self.link(Side::Robot, "robot");
        link.listen = vec![format!("quic/127.0.0.1:{}", self.port).try_into().unwrap()];
        Net::start(&link, compatibility()).unwrap()
    }

    fn away(&self, change: impl FnOnce(&mut Link)) -> Net {
        let mut link = self.link(Side::Remote, "remote");
        link.connect = vec![format!("quic/localhost:{}", self.port).try_into().unwrap()];
        change(&mut link);
        Net::start(&link, compatibility()).unwrap()
    }
}

pub(super) fn compatibility() -> Compatibility {
    Compatibility::of(&Robot::load(None).unwrap(), 2)
}

/// The bytes of a heartbeat of an epoch.
fn pulse(epoch: u64) -> Vec<u8> {
    let pulse = Heartbeat {
        epoch,
        sent_ns: 0,
        asked_ns: 0,
        heard_ns: 0,
        acked_epoch: 0,
        newest: 0,
        wanted: 0,
        latched_subscribers: 0,
    };
    pulse.to_bytes(compatibility())
}

fn wait<T>(mut what: impl FnMut() -> Option<T>) -> T {
    let end = clock::now() + MAX_WAIT;
    loop {
        if let Some(it) = what() {
            return it;
        }
        assert!(clock::now() < end, "it does not come");
        clock::sleep_until(clock::now() + Duration::from_millis(2));
    }
}

/// Repeats a heartbeat until the other end receives it; returns that message.
fn greet(from: &Net, to: &Net, word: &[u8]) -> Message {
    wait(|| {
        from.send(MessageKind::Heartbeat, word.to_vec());
        std::iter::from_fn(|| to.receive()).find(|message| message.bytes == word)
    })
}

#[test]
fn bundles_come_whole_and_in_order_both_ways_and_pulses_beside_them() {
    let Some(pair) = Pair::or_skip() else { return };
    let (robot, away) = (pair.robot(), pair.away(|_| {}));
    greet(&robot, &away, &pulse(1));
    for (from, to) in [(&away, &robot), (&robot, &away)] {
        assert_eq!(greet(from, to, &pulse(1)).sort, MessageKind::Heartbeat);
        // Larger than the flow-control window of one moment.
        let bundle = |number: u8| vec![number; 300_000 + usize::from(number)];
        let mut next = 0;
        for wanted in 0..40 {
            let came = wait(|| {
                // As the link does: a message is lost if there is no room.
                while next < 40 && next < wanted + 4 && from.has_room() {
                    from.send(MessageKind::Batch, bundle(next));
                    next += 1;
                }
                std::iter::from_fn(|| to.receive()).find(|message| message.sort == MessageKind::Batch)
            });
            assert_eq!(came.bytes, bundle(wanted), "{wanted}");
        }
    }
}

#[test]
fn a_restarted_peer_is_found() {
    let Some(pair) = Pair::or_skip() else { return };
    let away = pair.away(|_| {});
    for epoch in [b"one", b"two"] {
        let robot = pair.robot();
        greet(&robot, &away, epoch);
        greet(&away, &robot, epoch);
        drop(robot);
        // The port is free as soon as the process has left.
        UdpSocket::bind(("127.0.0.1", pair.port)).unwrap();
    }
    assert!(!away.is_over());
}

#[test]
fn a_closing_peer_announces_its_end() {
    let Some(pair) = Pair::or_skip() else { return };
    let robot = pair.robot();
    within(async {
        let endpoint = client(pair.keys.path(), Some("remote"));
        let at = (Ipv4Addr::LOCALHOST, pair.port).into();
        let connection = endpoint.connect(at, "localhost").unwrap().await.unwrap();
        // The robot sends until the connection is set up.
        while timeout(Duration::from_millis(20), connection.read_datagram()).await.is_err() {
            robot.send(MessageKind::Heartbeat, b"hello".to_vec());
        }
        drop(robot);
        let ended = connection.closed().await;
        assert!(matches!(ended, ConnectionError::ApplicationClosed(_)), "{ended}");
    });
}

#[test]
fn before_compatibility_is_known_only_pulses_are_accepted() {
    let Some(pair) = Pair::or_skip() else { return };
    let robot = pair.robot();
    within(async {
        let endpoint = client(pair.keys.path(), Some("remote"));
        let at = (Ipv4Addr::LOCALHOST, pair.port).into();
        let connection = endpoint.connect(at, "localhost").unwrap().await.unwrap();
        let say = |bytes: Vec<u8>| connection.send_datagram(bytes.into()).unwrap();
        let is_up = |bytes: &[u8]| std::iter::from_fn(|| robot.receive()).any(|came| came.bytes == bytes);
        let strange = {
            let other = Compatibility { layouts: !compatibility().layouts, ..compatibility() };
            let numbers = pulse(1).len();
            let mut bytes = other.numbers().map(u64::to_le_bytes).concat();
            bytes.splice(..0, pulse(1)[..8].iter().copied());
            bytes.resize(numbers, 0);
            bytes
        };
        let mut stream = Box::pin(connection.open_uni());
        for word in [b"hello".to_vec(), strange] {
            while !is_up(&word) {
                say(word.clone());
                let opened = timeout(Duration::from_millis(20), &mut stream).await;
                assert!(opened.is_err(), "a stream is open before that");
            }
        }
        let opened = loop {
            say(pulse(1));
            if let Ok(opened) = timeout(Duration::from_millis(20), &mut stream).await {
                break opened;
            }
        };
        let bundle = b"more";
        let mut stream = opened.unwrap();
        stream.write_all(&[&4_u32.to_le_bytes()[..], bundle].concat()).await.unwrap();
        while !is_up(bundle) {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        // A second stream is refused.
        let second = timeout(Duration::from_millis(200), connection.open_uni()).await;
        assert!(second.is_err(), "a second stream is open");
    });
}

#[test]
fn another_robot_and_a_peer_of_the_same_side_are_refused() {
    let Some(pair) = Pair::or_skip() else { return };
    let robot = pair.robot();
    let other = pair.away(|link| link.robot = "other".to_owned().try_into().unwrap());
    let twin = pair.away(|link| link.side = Side::Robot);
    let right = pair.away(|_| {});
    let strangers = [other, twin];
    // Longer than any of them takes to connect.
    for _again in 0..20 {
        strangers.iter().for_each(|stranger| stranger.send(MessageKind::Heartbeat, b"strange".to_vec()));
        assert_ne!(greet(&right, &robot, b"right").bytes, b"strange");
        robot.send(MessageKind::Heartbeat, b"secret".to_vec());
        clock::sleep_until(clock::now() + Duration::from_millis(50));
        assert!(strangers.iter().all(|stranger| stranger.receive().is_none()));
    }
}

#[test]
fn only_an_accepted_certificate_reserves_slots_for_its_address() {
    let Some(pair) = Pair::or_skip() else { return };
    let keys = Keys::read(&pair.link(Side::Robot, "robot")).unwrap();
    let (reports, _thread) = Reports::start(keys.files.clone(), |_| {}).unwrap();
    let (incoming, _received) = bounded(INCOMING);
    let peers = Rc::new(Peers::new(keys, compatibility(), reports, &[], incoming));
    let address = format!("quic/127.0.0.1:{}", pair.port).try_into().unwrap();
    within(LocalSet::new().run_until(async move {
        let listening = Rc::clone(&peers);
        let _listening = tokio::task::spawn_local(async move { listening.listen(&address).await });
        let is_reserved = || {
            let slot = peers.slots.take(clock::now(), Ipv4Addr::LOCALHOST.into(), MAX_UNRESERVED);
            slot.is_some()
        };
        let connect = async |name| {
            let endpoint = client(pair.keys.path(), name);
            let at = (Ipv4Addr::LOCALHOST, pair.port).into();
            (endpoint.connect(at, "localhost").unwrap().await, endpoint)
        };
        for name in [None, Some("stranger"), Some("expired"), Some("server")] {
            // In TLS 1.3 the client learns that its certificate was refused only after it is connected.
            if let (Ok(connection), _endpoint) = connect(name).await {
                connection.closed().await;
            }
            assert!(!is_reserved(), "{name:?}");
        }
        let (connection, _endpoint) = connect(Some("remote")).await;
        let connection = connection.unwrap();
        while !is_reserved() {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        connection.close(0_u32.into(), b"");
        assert!(is_reserved(), "also without a connection");
    }));
}

//! The network: bytes to the other machine and from it, over zenoh, on a thread of its own.

use std::path::Path;
use std::thread::JoinHandle;

use clock::{Duration, Instant};
use config::leo::{Endpoint, Link, Side};
use crossbeam::channel::{Receiver, Sender, TryRecvError, TrySendError, bounded};
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;
use zenoh::{Config, Session, Wait as _};

/// Messages that wait for the network, and for the loop.
const OUTGOING: usize = 4;
const INCOMING: usize = 256;
/// Whoever is silent for so long is connected to anew, in milliseconds: well before TCP gives up.
const LEASE_MS: u64 = 3000;
/// Larger messages are refused before they are in memory.
const MESSAGE_MOST: u64 = 16 * 1024 * 1024;
/// Where the network cannot be used, it is tried again this often.
const AGAIN_AFTER: Duration = Duration::from_secs(2);
/// How often the thread looks whether it shall end while it waits.
const LOOK: Duration = Duration::from_millis(50);

/// What a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sort {
    /// A pulse: goes first.
    Pulse,
    /// A bundle of frames.
    Bundle,
}

/// A message that came.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) sort: Sort,
    pub(crate) at: Instant,
    pub(crate) bytes: Vec<u8>,
}

/// The network as the loop has it: neither sending nor receiving waits.
#[derive(Debug)]
pub(crate) struct Net {
    to: Sender<(Sort, Vec<u8>)>,
    from: Receiver<Message>,
    thread: JoinHandle<()>,
}

impl Net {
    /// Begins to connect, and goes on by itself.
    pub(crate) fn start(link: &Link) -> Result<Self, String> {
        let config = configuration(link)?;
        let (here, there) = match link.side {
            Side::Away => ("away", "robot"),
            Side::Off | Side::Robot => ("robot", "away"),
        };
        let key = |side: &str, what: &str| format!("leo/{}/{side}/{what}", link.robot.as_str());
        let keys = Keys {
            to: [key(here, "pulse"), key(here, "frames")],
            from: [key(there, "pulse"), key(there, "frames")],
        };
        let (to, outgoing) = bounded(OUTGOING);
        let (incoming, from) = bounded(INCOMING);
        let run = move || {
            let carry = |session: Session| {
                let carried = carry(&session, &keys, &incoming, &outgoing);
                // Its port is free for the next one.
                let _closed = session.close().wait();
                carried
            };
            keep(|| open(&config, &outgoing), carry, || pause(&outgoing));
        };
        let thread = std::thread::Builder::new().name("link-net".to_owned()).spawn(run);
        Ok(Self { to, from, thread: thread.map_err(|error| error.to_string())? })
    }

    /// Whether nothing goes out and comes in any more, for good: its thread is gone.
    pub(crate) fn is_over(&self) -> bool {
        self.thread.is_finished()
    }

    /// Whether a message could be handed over now.
    pub(crate) fn has_room(&self) -> bool {
        !self.to.is_full()
    }

    /// Hands over a message. Where the network is busy it is dropped, as if it were lost on the way.
    pub(crate) fn send(&self, sort: Sort, bytes: Vec<u8>) {
        match self.to.try_send((sort, bytes)) {
            Ok(()) | Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
        }
    }

    /// A message that came.
    pub(crate) fn receive(&self) -> Option<Message> {
        self.from.try_recv().ok()
    }
}

/// What is said under which name: pulse, frames.
struct Keys {
    to: [String; 2],
    from: [String; 2],
}

/// Carries messages over one session after the other, for as long as somebody wants one: what breaks is
/// opened anew.
fn keep<S, E: std::fmt::Display>(
    mut open: impl FnMut() -> Option<S>,
    mut carry: impl FnMut(S) -> Result<(), E>,
    mut pause: impl FnMut() -> bool,
) {
    let mut said = String::new();
    while let Some(session) = open() {
        let Err(error) = carry(session) else { return };
        let error = error.to_string();
        if said != error {
            tracing::warn!("the link's connection broke, and is opened anew: {error}");
            said = error;
        }
        if !pause() {
            return;
        }
    }
}

/// Waits before the network is tried again; whether anybody still wants it.
fn pause(outgoing: &Receiver<(Sort, Vec<u8>)>) -> bool {
    let again_at = clock::now() + AGAIN_AFTER;
    while clock::now() < again_at {
        // What is meant for a network that is not there is dropped.
        if outgoing.try_recv() == Err(TryRecvError::Disconnected) {
            return false;
        }
        clock::sleep_until(clock::now() + LOOK);
    }
    true
}

/// Opens a session, however long that takes; `None` when nobody wants one any more.
fn open(config: &Config, outgoing: &Receiver<(Sort, Vec<u8>)>) -> Option<Session> {
    let mut said = String::new();
    loop {
        match zenoh::open(config.clone()).wait() {
            Ok(session) => return Some(session),
            Err(error) => {
                let error = error.to_string();
                if said != error {
                    tracing::warn!("the link waits for the network: {error}");
                    said = error;
                }
            }
        }
        if !pause(outgoing) {
            return None;
        }
    }
}

/// Carries messages until nobody sends any more.
fn carry(
    session: &Session,
    keys: &Keys,
    incoming: &Sender<Message>,
    outgoing: &Receiver<(Sort, Vec<u8>)>,
) -> zenoh::Result<()> {
    let [pulses, frames] = &keys.from;
    let _pulses = listen(session, pulses, Sort::Pulse, incoming)?;
    let _frames = listen(session, frames, Sort::Bundle, incoming)?;
    let [pulses, frames] = &keys.to;
    let pulses = speaker(session, pulses, Priority::RealTime)?;
    let frames = speaker(session, frames, Priority::Data)?;
    while let Ok((sort, bytes)) = outgoing.recv() {
        let speaker = match sort {
            Sort::Pulse => &pulses,
            Sort::Bundle => &frames,
        };
        speaker.put(ZBytes::from(bytes)).wait()?;
    }
    Ok(())
}

fn listen<'a>(
    session: &'a Session,
    key: &'a str,
    sort: Sort,
    incoming: &Sender<Message>,
) -> zenoh::Result<impl Sized + use<'a>> {
    let incoming = incoming.clone();
    session
        .declare_subscriber(key)
        .allowed_origin(Locality::Remote)
        .callback(move |sample| {
            let message = Message { sort, at: clock::now(), bytes: sample.payload().to_bytes().into_owned() };
            // A loop that is behind loses messages, as a network does.
            match incoming.try_send(message) {
                Ok(()) | Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
            }
        })
        .wait()
}

fn speaker<'a>(session: &'a Session, key: &'a str, priority: Priority) -> zenoh::Result<Publisher<'a>> {
    session
        .declare_publisher(key)
        .allowed_destination(Locality::Remote)
        .congestion_control(CongestionControl::Drop)
        .priority(priority)
        .express(true)
        .wait()
}

/// The network's configuration: these endpoints alone, nobody is looked for, nobody is introduced.
fn configuration(link: &Link) -> Result<Config, String> {
    let mut config = Config::default();
    let mut set = |key: &str, value: &str| {
        config.insert_json5(key, value).map_err(|error| format!("the link's `{key}` = {value}: {error}"))
    };
    set("mode", "\"peer\"")?;
    set("scouting/multicast/enabled", "false")?;
    set("scouting/gossip/enabled", "false")?;
    set("adminspace/enabled", "false")?;
    set("listen/endpoints", &list(&link.listen))?;
    set("connect/endpoints", &list(&link.connect))?;
    set("connect/retry", "{ period_init_ms: 250, period_max_ms: 1000, period_increase_factor: 2 }")?;
    set("transport/unicast/max_sessions", "8")?;
    set("transport/link/protocols", if link.is_encrypted() { "[\"quic\", \"tcp\"]" } else { "[\"tcp\"]" })?;
    set("transport/link/tx/lease", &LEASE_MS.to_string())?;
    set("transport/link/rx/max_message_size", &MESSAGE_MOST.to_string())?;
    if link.is_encrypted() {
        let mut key = |name: &str, file: &Path| set(&format!("transport/link/tls/{name}"), &quoted(file)?);
        key("root_ca_certificate", &link.authority)?;
        key("listen_certificate", &link.certificate)?;
        key("connect_certificate", &link.certificate)?;
        key("listen_private_key", &link.private_key)?;
        key("connect_private_key", &link.private_key)?;
        // QUIC's TLS is configured as that of TLS over TCP. Who connects shows a certificate too, and who is connected to has the name that was asked for.
        set("transport/link/tls/enable_mtls", "true")?;
        set("transport/link/tls/verify_name_on_connect", "true")?;
        set("transport/link/tls/close_link_on_expiration", "true")?;
    }
    Ok(config)
}

/// Endpoints hold no letters that would have to be escaped.
fn list(endpoints: &[Endpoint]) -> String {
    let quoted: Vec<String> = endpoints.iter().map(|endpoint| format!("\"{}\"", endpoint.as_str())).collect();
    format!("[{}]", quoted.join(", "))
}

fn quoted(file: &Path) -> Result<String, String> {
    let text = file.to_str().ok_or_else(|| format!("{}: the path of a key must be UTF-8", file.display()))?;
    Ok(format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"")))
}

/// Where what is sent comes out in a test, and where what comes is put in.
#[cfg(test)]
pub(crate) type Ends = (Receiver<(Sort, Vec<u8>)>, Sender<Message>);

#[cfg(test)]
impl Net {
    /// A network that tests carry.
    pub(crate) fn by_hand() -> (Self, Ends) {
        let (to, outgoing) = bounded(OUTGOING);
        let (incoming, from) = bounded(INCOMING);
        (Self { to, from, thread: std::thread::spawn(|| {}) }, (outgoing, incoming))
    }
}

#[cfg(test)]
mod certificates;
#[cfg(test)]
mod tests;

//! Those who are connected: found, awaited, talked to.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::rc::Rc;
use std::time::Duration;

use bytes::Bytes;
use config::leo::Endpoint as Address;
use quinn::{Connection, ConnectionError, Endpoint, VarInt};
use rustls::pki_types::UnixTime;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::keys::{Keys, has_expired};
use super::{Message, OUTGOING, Sort};

/// Who cannot be connected to is tried again after so long, and later and later ...
const AGAIN_FIRST: Duration = Duration::from_millis(250);
/// ... up to this.
const AGAIN_MOST: Duration = Duration::from_secs(2);
/// How many may be connected at once to where this machine is awaited.
const CONNECTED_MOST: usize = 8;
/// Larger messages are refused before they are in memory, in bytes.
const MESSAGE_MOST: u32 = 16 * 1024 * 1024;
/// How often it is looked whether a certificate has expired.
const LOOK: Duration = Duration::from_secs(10);
/// How long those whom one leaves may take to hear so.
const LEAVE: Duration = Duration::from_millis(200);
/// How much is said of what goes wrong: strangers fill no journal.
const SAID_MOST: usize = 64;
/// Nothing is wrong.
const WELL: VarInt = VarInt::from_u32(0);
/// What came is no message.
const NONSENSE: VarInt = VarInt::from_u32(1);
/// The certificate that was shown has expired.
const EXPIRED: VarInt = VarInt::from_u32(2);

type Failed = Box<dyn std::error::Error>;

/// Those who are connected.
struct Peers {
    keys: Keys,
    incoming: crossbeam::channel::Sender<Message>,
    connected: RefCell<BTreeMap<usize, Peer>>,
    /// What went wrong, and was said.
    said: RefCell<BTreeSet<String>>,
}

struct Peer {
    connection: Connection,
    endpoint: Endpoint,
    bundles: mpsc::Sender<Bytes>,
}

/// Carries messages until nobody sends any more.
pub(super) async fn carry(
    keys: Keys,
    listen: Vec<Address>,
    connect: Vec<Address>,
    incoming: crossbeam::channel::Sender<Message>,
    mut outgoing: mpsc::Receiver<(Sort, Vec<u8>)>,
) {
    let peers = Rc::new(Peers { keys, incoming, connected: RefCell::default(), said: RefCell::default() });
    let mut tasks = JoinSet::new();
    for address in listen {
        let peers = Rc::clone(&peers);
        tasks.spawn_local(async move { peers.listen(&address).await });
    }
    for address in connect {
        let peers = Rc::clone(&peers);
        tasks.spawn_local(async move { peers.look_for(&address).await });
    }
    while let Some((sort, bytes)) = outgoing.recv().await {
        peers.send(sort, &bytes.into());
    }
    let left = peers.connected.take();
    left.values().for_each(|peer| peer.connection.close(WELL, b""));
    tasks.shutdown().await;
    let heard = async {
        for peer in left.values() {
            peer.endpoint.wait_idle().await;
        }
    };
    // Who does not hear it in time finds out.
    let _late = timeout(LEAVE, heard).await;
}

impl Peers {
    /// Says it to everybody. What nobody can take now is lost on the way.
    fn send(&self, sort: Sort, bytes: &Bytes) {
        for Peer { connection, bundles, .. } in self.connected.borrow().values() {
            match sort {
                Sort::Pulse => {
                    let _lost = connection.send_datagram(bytes.clone());
                }
                Sort::Bundle => {
                    let _lost = bundles.try_send(bytes.clone());
                }
            }
        }
    }

    /// Lets in who comes, for ever.
    async fn listen(self: Rc<Self>, address: &Address) {
        loop {
            if let Err(error) = Rc::clone(&self).let_in(address).await {
                self.warn(format!("the link cannot be connected to at {}: {error}", address.as_str()));
            }
            sleep(AGAIN_MOST).await;
        }
    }

    async fn let_in(self: Rc<Self>, address: &Address) -> Result<(), Failed> {
        let at = found(address).await?.into_iter().next().ok_or("the name has no address")?;
        let endpoint = Endpoint::server(self.keys.server.clone(), at)?;
        let mut guests = JoinSet::new();
        while let Some(comes) = endpoint.accept().await {
            while guests.try_join_next().is_some() {}
            if self.connected.borrow().len() >= CONNECTED_MOST {
                comes.refuse();
                continue;
            }
            let (peers, endpoint) = (Rc::clone(&self), endpoint.clone());
            guests.spawn_local(async move {
                let from = comes.remote_address().ip();
                let Ok(comes) = comes.accept() else { return };
                match comes.await {
                    Ok(connection) => peers.talk(endpoint, connection).await,
                    Err(error) => {
                        peers.warn(format!("somebody at {from} is not let in to the link: {error}"));
                    }
                }
            });
        }
        Ok(())
    }

    /// Connects, and connects again, for ever.
    async fn look_for(self: Rc<Self>, address: &Address) {
        let mut again_after = AGAIN_FIRST;
        loop {
            match self.reach(address).await {
                Ok((endpoint, connection)) => {
                    self.talk(endpoint, connection).await;
                    again_after = AGAIN_FIRST;
                }
                Err(error) => self.warn(format!("the link does not reach {}: {error}", address.as_str())),
            }
            sleep(again_after).await;
            again_after = (again_after * 2).min(AGAIN_MOST);
        }
    }

    /// Connects to the first address of a name that answers.
    async fn reach(&self, address: &Address) -> Result<(Endpoint, Connection), Failed> {
        let mut failed: Failed = "the name has no address".into();
        for at in found(address).await? {
            match self.connect(address, at).await {
                Ok(reached) => return Ok(reached),
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }

    async fn connect(&self, address: &Address, at: SocketAddr) -> Result<(Endpoint, Connection), Failed> {
        let from: SocketAddr =
            if at.is_ipv4() { (Ipv4Addr::UNSPECIFIED, 0).into() } else { (Ipv6Addr::UNSPECIFIED, 0).into() };
        let endpoint = Endpoint::client(from)?;
        let connecting = endpoint.connect_with(self.keys.client.clone(), at, address.host())?;
        let connection = connecting.await?;
        Ok((endpoint, connection))
    }

    /// Talks to somebody until one of both has enough, or nothing is heard any more.
    async fn talk(&self, endpoint: Endpoint, connection: Connection) {
        let (bundles, waiting) = mpsc::channel(OUTGOING);
        let number = connection.stable_id();
        self.connected
            .borrow_mut()
            .insert(number, Peer { connection: connection.clone(), endpoint, bundles });
        let (why, said) = tokio::select! {
            ended = say_bundles(&connection, waiting) => (WELL, ended),
            ended = self.hear_bundles(&connection) => (NONSENSE, ended),
            ended = self.hear_pulses(&connection) => (WELL, ended),
            ended = expire(&connection) => (EXPIRED, ended),
        };
        self.connected.borrow_mut().remove(&number);
        connection.close(why, b"");
        let (there, error) = (connection.remote_address().ip(), said.err().map(|error| error.to_string()));
        match connection.close_reason() {
            // Who connects hears of what is wrong with his own certificate only when he is connected.
            Some(ConnectionError::ConnectionClosed(alert)) => {
                self.warn(format!("the link is sent away by {there}: {alert}"));
            }
            _ => tracing::debug!(%there, error, "a connection of the link ended"),
        }
    }

    async fn hear_bundles(&self, connection: &Connection) -> Result<(), Failed> {
        let mut stream = connection.accept_uni().await?;
        loop {
            let mut length = [0; 4];
            stream.read_exact(&mut length).await?;
            let length = u32::from_le_bytes(length);
            if length > MESSAGE_MOST {
                return Err(format!("a message of {length} bytes is none of a link").into());
            }
            let mut bytes = vec![0; usize::try_from(length)?];
            stream.read_exact(&mut bytes).await?;
            self.heard(Sort::Bundle, bytes);
        }
    }

    async fn hear_pulses(&self, connection: &Connection) -> Result<(), Failed> {
        loop {
            let bytes = connection.read_datagram().await?;
            self.heard(Sort::Pulse, bytes.into());
        }
    }

    /// A loop that is behind loses messages, as a network does.
    fn heard(&self, sort: Sort, bytes: Vec<u8>) {
        let _lost = self.incoming.try_send(Message { sort, at: clock::now(), bytes });
    }

    /// Says what is wrong, once.
    fn warn(&self, what: String) {
        let mut said = self.said.borrow_mut();
        if said.len() < SAID_MOST && !said.contains(&what) {
            tracing::warn!("{what}");
            said.insert(what);
        }
    }
}

/// The addresses of a name, as they are now.
async fn found(address: &Address) -> Result<Vec<SocketAddr>, Failed> {
    Ok(tokio::net::lookup_host(address.host_and_port()).await?.collect())
}

async fn say_bundles(connection: &Connection, mut waiting: mpsc::Receiver<Bytes>) -> Result<(), Failed> {
    let mut stream = connection.open_uni().await?;
    while let Some(bundle) = waiting.recv().await {
        let length = u32::try_from(bundle.len())?.to_le_bytes();
        stream.write_all(&length).await?;
        stream.write_chunk(bundle).await?;
    }
    Ok(())
}

/// Ends when a certificate that was shown does.
async fn expire(connection: &Connection) -> Result<(), Failed> {
    while !has_expired(connection, UnixTime::now()) {
        sleep(LOOK).await;
    }
    Err("its certificate has expired".into())
}

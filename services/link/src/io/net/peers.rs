//! Peers: connects, reconnects, and exchanges messages with every connected peer.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::rc::Rc;
use std::time::Duration;

use bytes::Bytes;
use config::leo::Endpoint as Address;
use quinn::{Connecting, Connection, ConnectionError, Endpoint, VarInt};
use rustls::pki_types::UnixTime;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::handshakes::{HANDSHAKE_TIMEOUT, HandshakeSlots};
use super::keys::{Keys, accept_bundles, has_expired};
use super::refusal::{EXPIRED, KeyFiles};
use super::reports::{Report, Reports};
use super::verifier::RefusalRecord;
use super::{Message, MessageKind, OUTGOING};
use crate::compatibility::Compatibility;
use crate::wire::Heartbeat;

/// First delay before another connection attempt; it doubles after each failure ...
const AGAIN_FIRST: Duration = Duration::from_millis(250);
/// ... up to this.
pub(super) const MAX_RECONNECT_DELAY: Duration = Duration::from_secs(2);
/// Maximum message size in bytes; larger ones are refused before they are in memory.
const MAX_MESSAGE_BYTES: u32 = 16 * 1024 * 1024;
/// Period of the expiry check of certificates.
const LOOK: Duration = Duration::from_secs(10);
/// How long a leaving process waits until its peers have received the close.
const LEAVE: Duration = Duration::from_millis(200);
/// Close code: no error.
const WELL: VarInt = VarInt::from_u32(0);
/// Close code: malformed message.
const NONSENSE: VarInt = VarInt::from_u32(1);

pub(super) type Failed = Box<dyn std::error::Error>;

/// The connected peers.
pub(super) struct Peers {
    pub(super) keys: Keys,
    compatibility: Compatibility,
    incoming: crossbeam::channel::Sender<Message>,
    pub(super) connected: RefCell<BTreeMap<usize, Peer>>,
    /// Slots of incoming handshakes. They are reserved for addresses whose certificate was accepted, in either
    /// role, and for the addresses in `connect`.
    pub(super) slots: HandshakeSlots,
    pub(super) reports: Reports,
}

pub(super) struct Peer {
    connection: Connection,
    endpoint: Endpoint,
    bundles: mpsc::Sender<Bytes>,
}

/// Carries messages until the sender of `outgoing` is dropped.
pub(super) async fn carry(
    keys: Keys,
    compatibility: Compatibility,
    reports: Reports,
    listen: Vec<Address>,
    connect: Vec<Address>,
    incoming: crossbeam::channel::Sender<Message>,
    mut outgoing: mpsc::Receiver<(MessageKind, Vec<u8>)>,
) {
    let peers = Rc::new(Peers::new(keys, compatibility, reports, &connect, incoming));
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
    // A peer that misses the close notices by its idle time-out.
    let _late = timeout(LEAVE, heard).await;
}

impl Peers {
    /// No peer yet. The slots are reserved for the IP addresses in `connect`.
    pub(super) fn new(
        keys: Keys,
        compatibility: Compatibility,
        reports: Reports,
        connect: &[Address],
        incoming: crossbeam::channel::Sender<Message>,
    ) -> Self {
        let (connected, slots) = (RefCell::default(), HandshakeSlots::reserved_for(connect));
        Self { keys, compatibility, incoming, connected, slots, reports }
    }

    /// Sends a message to every peer; it is dropped where the queue is full.
    fn send(&self, sort: MessageKind, bytes: &Bytes) {
        for Peer { connection, bundles, .. } in self.connected.borrow().values() {
            match sort {
                MessageKind::Heartbeat => {
                    let _lost = connection.send_datagram(bytes.clone());
                }
                MessageKind::Batch => {
                    let _lost = bundles.try_send(bytes.clone());
                }
            }
        }
    }

    /// Connects and reconnects until the task is cancelled.
    async fn look_for(self: Rc<Self>, address: &Address) {
        let mut again_after = AGAIN_FIRST;
        loop {
            match self.reach(address).await {
                Ok((endpoint, connection, record)) => {
                    self.slots.reserve(connection.remote_address().ip());
                    self.exchange_messages(address.as_str(), endpoint, connection, &record).await;
                    again_after = AGAIN_FIRST;
                }
                Err(report) => self.reports.send(report),
            }
            sleep(again_after).await;
            again_after = (again_after * 2).min(MAX_RECONNECT_DELAY);
        }
    }

    /// Connects to the first address of a name that answers; the report is about the last one.
    async fn reach(&self, address: &Address) -> Result<(Endpoint, Connection, RefusalRecord), Report> {
        let fails =
            |error: Failed| Report::Fault(format!("no connection with {}: {error}", address.as_str()));
        let peer = || address.as_str().to_owned();
        let mut failed = fails("the name has no address".into());
        for at in found(address).await.map_err(fails)? {
            let (endpoint, connecting, record) = self.connect(address, at).map_err(fails)?;
            match timeout(HANDSHAKE_TIMEOUT, connecting).await {
                Ok(Ok(connection)) => return Ok((endpoint, connection, record)),
                Ok(Err(ended)) => failed = Report::Ended { peer: peer(), record, ended },
                Err(_elapsed) => failed = Report::HandshakeTimeout { peer: peer() },
            }
        }
        Err(failed)
    }

    fn connect(
        &self,
        address: &Address,
        at: SocketAddr,
    ) -> Result<(Endpoint, Connecting, RefusalRecord), Failed> {
        let from: SocketAddr =
            if at.is_ipv4() { (Ipv4Addr::UNSPECIFIED, 0).into() } else { (Ipv6Addr::UNSPECIFIED, 0).into() };
        let endpoint = Endpoint::client(from)?;
        let (config, record) = self.keys.for_outgoing()?;
        let connecting = endpoint.connect_with(config, at, address.host())?;
        Ok((endpoint, connecting, record))
    }

    /// Exchanges messages until either side closes the connection or it times out.
    pub(super) async fn exchange_messages(
        &self,
        peer: &str,
        endpoint: Endpoint,
        connection: Connection,
        record: &RefusalRecord,
    ) {
        let (bundles, waiting) = mpsc::channel(OUTGOING);
        let number = connection.stable_id();
        self.connected
            .borrow_mut()
            .insert(number, Peer { connection: connection.clone(), endpoint, bundles });
        let (why, said) = tokio::select! {
            ended = send_batches(&connection, waiting) => (WELL, ended),
            ended = self.receive_batches(&connection) => (NONSENSE, ended),
            ended = self.receive_heartbeats(&connection) => (WELL, ended),
            ended = expire(&connection) => (EXPIRED, ended),
        };
        self.connected.borrow_mut().remove(&number);
        connection.close(why, b"");
        match connection.close_reason() {
            // In TLS 1.3 the client learns that its certificate was refused only after it is connected.
            Some(ended @ (ConnectionError::ConnectionClosed(_) | ConnectionError::ApplicationClosed(_)))
                if KeyFiles::is_refusal(&ended) =>
            {
                self.reports.send(Report::Ended { peer: peer.to_owned(), record: record.clone(), ended });
            }
            _ if why == EXPIRED => self.reports.send(Report::Expired { peer: peer.to_owned() }),
            _ => {
                let error = said.err().map(|error| error.to_string());
                tracing::debug!(peer, error, "a connection of the link ended");
            }
        }
    }

    async fn receive_batches(&self, connection: &Connection) -> Result<(), Failed> {
        let mut stream = connection.accept_uni().await?;
        loop {
            let mut length = [0; 4];
            stream.read_exact(&mut length).await?;
            let length = u32::from_le_bytes(length);
            if length > MAX_MESSAGE_BYTES {
                return Err(format!(
                    "the peer sent a message of {length} bytes, which is not a link message"
                )
                .into());
            }
            let mut bytes = vec![0; usize::try_from(length)?];
            stream.read_exact(&mut bytes).await?;
            self.heard(MessageKind::Batch, bytes);
        }
    }

    async fn receive_heartbeats(&self, connection: &Connection) -> Result<(), Failed> {
        let mut is_open = false;
        loop {
            let bytes = connection.read_datagram().await?;
            // Batches are accepted only after a valid heartbeat has proven the peer compatible.
            if !is_open && Heartbeat::decode(&bytes, self.compatibility).is_ok() {
                accept_bundles(connection);
                is_open = true;
            }
            self.heard(MessageKind::Heartbeat, bytes.into());
        }
    }

    /// Queues a message for the main loop; if the loop is behind, the message is lost, as on a network.
    fn heard(&self, sort: MessageKind, bytes: Vec<u8>) {
        let _lost = self.incoming.try_send(Message { sort, at: clock::now(), bytes });
    }
}

/// Resolves a name.
pub(super) async fn found(address: &Address) -> Result<Vec<SocketAddr>, Failed> {
    Ok(tokio::net::lookup_host(address.host_and_port()).await?.collect())
}

async fn send_batches(connection: &Connection, mut waiting: mpsc::Receiver<Bytes>) -> Result<(), Failed> {
    let mut stream = connection.open_uni().await?;
    while let Some(bundle) = waiting.recv().await {
        let length = u32::try_from(bundle.len())?.to_le_bytes();
        stream.write_all(&length).await?;
        stream.write_chunk(bundle).await?;
    }
    Ok(())
}

/// Completes when the peer's certificate has expired.
async fn expire(connection: &Connection) -> Result<(), Failed> {
    while !has_expired(connection, UnixTime::now()) {
        sleep(LOOK).await;
    }
    Err("its certificate has expired".into())
}

//! Incoming connections: address validation, certificate verification, then messages.

use std::rc::Rc;
use std::time::Duration;

use config::leo::Endpoint as Address;
use quinn::{Connecting, ConnectionError, Endpoint, Incoming, VarInt};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::handshakes::{HANDSHAKE_TIMEOUT, HandshakeSlot};
use super::peers::{Failed, MAX_RECONNECT_DELAY, Peers, found};
use super::reports::Report;
use super::verifier::RefusalRecord;

/// Maximum connections with a verified certificate.
const MAX_CONNECTED: usize = 8;
/// How long QUIC keeps a closed connection: three probe time-outs (RFC 9000, 10.2), computed for an
/// unmeasured round trip.
const CLOSING: Duration = Duration::from_secs(1);
/// Application close code: too many connections.
const FULL: VarInt = VarInt::from_u32(3);

impl Peers {
    /// Accepts connections until the task is cancelled.
    pub(super) async fn listen(self: Rc<Self>, address: &Address) {
        loop {
            if let Err(error) = Rc::clone(&self).let_in(address).await {
                let fault = format!("the link cannot be connected to at {}: {error}", address.as_str());
                self.reports.send(Report::Fault(fault));
            }
            sleep(MAX_RECONNECT_DELAY).await;
        }
    }

    async fn let_in(self: Rc<Self>, address: &Address) -> Result<(), Failed> {
        let at = found(address).await?.into_iter().next().ok_or("the name has no address")?;
        let endpoint = Endpoint::server(self.keys.server.clone(), at)?;
        let mut tasks = JoinSet::new();
        while let Some(incoming) = endpoint.accept().await {
            while tasks.try_join_next().is_some() {}
            if let Some((connecting, record, slot)) = self.begin_handshake(&endpoint, incoming) {
                let (peers, endpoint) = (Rc::clone(&self), endpoint.clone());
                tasks
                    .spawn_local(async move { peers.authenticate(endpoint, connecting, record, slot).await });
            }
        }
        Ok(())
    }

    /// Begins the handshake with a validated address if a slot is free.
    ///
    /// An address that is not validated gets a Retry packet (RFC 9000, 8.1.2), which is smaller than the
    /// client's first packet. Nothing is stored or signed for it.
    fn begin_handshake(
        &self,
        endpoint: &Endpoint,
        incoming: Incoming,
    ) -> Option<(Connecting, RefusalRecord, HandshakeSlot)> {
        if !incoming.remote_address_validated() {
            // If Retry is impossible, dropping the connection refuses it.
            let _refused = incoming.retry();
            return None;
        }
        if self.connected.borrow().len() >= MAX_CONNECTED {
            incoming.refuse();
            return None;
        }
        let address = incoming.remote_address().ip();
        let Some(slot) = self.slots.take(clock::now(), address, endpoint.open_connections()) else {
            // The peer repeats its packet and may get a slot then.
            incoming.ignore();
            return None;
        };
        let (config, record) = match self.keys.for_incoming() {
            Ok(made) => made,
            Err(error) => {
                let fault = format!("the link accepts no connection: {error}");
                self.reports.send(Report::Fault(fault));
                return None;
            }
        };
        match incoming.accept_with(config) {
            Ok(connecting) => Some((connecting, record, slot)),
            Err(ended) => {
                self.reports.send(Report::Ended { peer: address.to_string(), record, ended });
                None
            }
        }
    }

    /// Waits for the verified certificate of a peer, then exchanges messages with it.
    async fn authenticate(
        &self,
        endpoint: Endpoint,
        connecting: Connecting,
        record: RefusalRecord,
        slot: HandshakeSlot,
    ) {
        let address = connecting.remote_address().ip();
        let from = address.to_string();
        let ended = tokio::select! {
            ended = timeout(HANDSHAKE_TIMEOUT, connecting) => ended,
            () = slot.evicted() => Ok(Err(ConnectionError::LocallyClosed)),
        };
        match ended {
            Ok(Ok(connection)) => {
                drop(slot);
                self.slots.reserve(address);
                if self.connected.borrow().len() < MAX_CONNECTED {
                    self.exchange_messages(&from, endpoint, connection, &record).await;
                } else {
                    connection.close(FULL, b"");
                }
                return;
            }
            Ok(Err(ConnectionError::LocallyClosed)) => {
                tracing::debug!(from, "an unfinished handshake of the link was dropped for a newer one");
            }
            Ok(Err(ended)) => self.reports.send(Report::Ended { peer: from, record, ended }),
            Err(_elapsed) => self.reports.send(Report::HandshakeTimeout { peer: from }),
        }
        // QUIC keeps a failed connection for this long to answer late packets. The slot stays reserved until
        // then.
        slot.finish();
        sleep(CLOSING).await;
        drop(slot);
    }
}

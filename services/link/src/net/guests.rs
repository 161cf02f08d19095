//! Those who connect to this machine: each proves its address, then shows its certificate, then is talked to.

use std::rc::Rc;
use std::time::Duration;

use config::leo::Endpoint as Address;
use quinn::{Connecting, Endpoint, Incoming, VarInt};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::judge::Verdict;
use super::peers::{AGAIN_MOST, Failed, HANDSHAKE_TIMEOUT, Peers, found, too_slow};
use super::places::{MAX_CONNECTIONS, Place, Places};

/// How many may be connected at once to where this machine is awaited.
const CONNECTED_MOST: usize = 8;
/// A connection that is given up is remembered for so long, to answer what still comes (RFC 9000, 10.2).
const CLOSING: Duration = Duration::from_secs(3);
/// As many machines are connected as may be.
const FULL: VarInt = VarInt::from_u32(3);

impl Peers {
    /// Lets in who comes, for ever.
    pub(super) async fn listen(self: Rc<Self>, address: &Address) {
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
        let places = Places::default();
        let mut guests = JoinSet::new();
        while let Some(comes) = endpoint.accept().await {
            while guests.try_join_next().is_some() {}
            if let Some((connecting, verdict, place)) = self.begin(&endpoint, &places, comes) {
                let (peers, endpoint) = (Rc::clone(&self), endpoint.clone());
                guests.spawn_local(async move { peers.meet(endpoint, connecting, verdict, place).await });
            }
        }
        Ok(())
    }

    /// Begins the handshake with a machine whose address is proven, where there is a place for it.
    ///
    /// Until then nothing of it is kept, and no signature is made: whoever sends from an address that is not its own
    /// gets a packet back that is smaller than its own (Retry: RFC 9000, 8.1.2).
    fn begin(
        &self,
        endpoint: &Endpoint,
        places: &Places,
        comes: Incoming,
    ) -> Option<(Connecting, Verdict, Place)> {
        if !comes.remote_address_validated() {
            // What cannot be answered so is refused where it is dropped.
            let _refused = comes.retry();
            return None;
        }
        if self.connected.borrow().len() >= CONNECTED_MOST {
            comes.refuse();
            return None;
        }
        let is_full = endpoint.open_connections() >= MAX_CONNECTIONS;
        let place = if is_full { None } else { places.take(comes.remote_address().ip()) };
        let Some(place) = place else {
            // Its packet comes again, and may find a place then.
            comes.ignore();
            return None;
        };
        let (config, verdict) = match self.keys.for_incoming() {
            Ok(made) => made,
            Err(error) => {
                self.warn(format!("the link lets nobody in: {error}"));
                return None;
            }
        };
        let from = comes.remote_address().ip().to_string();
        match comes.accept_with(config) {
            Ok(connecting) => Some((connecting, verdict, place)),
            Err(ended) => {
                self.warn(self.keys.files.explain(&from, &verdict, &ended));
                None
            }
        }
    }

    /// Awaits the certificate of a machine, and talks to it where it is accepted.
    async fn meet(&self, endpoint: Endpoint, connecting: Connecting, verdict: Verdict, place: Place) {
        let from = connecting.remote_address().ip().to_string();
        match timeout(HANDSHAKE_TIMEOUT, connecting).await {
            Ok(Ok(connection)) => {
                drop(place);
                if self.connected.borrow().len() < CONNECTED_MOST {
                    self.talk(&from, endpoint, connection, &verdict).await;
                } else {
                    connection.close(FULL, b"");
                }
                return;
            }
            Ok(Err(ended)) => self.warn(self.keys.files.explain(&from, &verdict, &ended)),
            Err(_elapsed) => self.warn(too_slow(&from)),
        }
        // It has its place for as long as anything of it is in memory.
        sleep(CLOSING).await;
        drop(place);
    }
}

//! Handshakes in progress: connections whose certificate is not verified yet.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::rc::Rc;
use std::time::Duration;

use clock::Instant;
use config::leo::Endpoint;
use tokio::sync::Notify;

use crate::slots::{MAX_RESERVED, MAX_UNRESERVED, SlotTable};

/// Time-out of a handshake: some round trips, with losses.
pub(super) const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);

/// The slots of all endpoints of this process.
#[derive(Clone, Debug, Default)]
pub(crate) struct HandshakeSlots(Rc<RefCell<Handshakes>>);

#[derive(Debug, Default)]
struct Handshakes {
    table: SlotTable,
    /// Signals of the evictions, by slot.
    evictions: BTreeMap<u64, Rc<Notify>>,
}

/// A slot of an address; dropping it frees the slot.
#[derive(Debug)]
pub(crate) struct HandshakeSlot {
    slots: HandshakeSlots,
    number: u64,
    evicted: Rc<Notify>,
}

impl HandshakeSlots {
    /// Free slots, reserved for the IP addresses among those of the configuration.
    ///
    /// A name gets no reservation before a certificate is accepted: its lookup is not authenticated.
    pub(crate) fn reserved_for(configured: &[Endpoint]) -> Self {
        let slots = Self::default();
        configured.iter().filter_map(|at| at.host().parse().ok()).for_each(|at| slots.reserve(at));
        slots
    }

    /// Takes a slot for a connection from a validated address; `None` if the address can have none.
    ///
    /// `connections` is the number of connections of the endpoint: in handshake, verified, and closing. A slow
    /// peer can keep a closing connection in memory for longer than its slot.
    ///
    /// The handshake that [`SlotTable::take`] evicts gets a signal. An unfinished handshake would otherwise
    /// keep its slot for seconds.
    pub(crate) fn take(&self, now: Instant, address: IpAddr, connections: usize) -> Option<HandshakeSlot> {
        let mut handshakes = self.0.borrow_mut();
        let is_reserved = handshakes.table.is_reserved(address);
        if connections >= MAX_UNRESERVED + if is_reserved { MAX_RESERVED } else { 0 } {
            return None;
        }
        let taken = handshakes.table.take(now, address)?;
        if let Some(evicted) = taken.evicted.and_then(|number| handshakes.evictions.get(&number)) {
            evicted.notify_one();
        }
        let evicted = Rc::new(Notify::new());
        handshakes.evictions.insert(taken.number, Rc::clone(&evicted));
        Some(HandshakeSlot { slots: self.clone(), number: taken.number, evicted })
    }

    /// Reserves slots for an address: see [`SlotTable::reserve`].
    pub(crate) fn reserve(&self, address: IpAddr) {
        self.0.borrow_mut().table.reserve(address);
    }
}

impl HandshakeSlot {
    /// Completes when the handshake is evicted.
    pub(crate) async fn evicted(&self) {
        self.evicted.notified().await;
    }

    /// Marks the handshake as finished while its connection is still in memory.
    pub(crate) fn finish(&self) {
        self.slots.0.borrow_mut().table.finish(self.number);
    }
}

impl Drop for HandshakeSlot {
    fn drop(&mut self) {
        let mut handshakes = self.slots.0.borrow_mut();
        handshakes.table.free(self.number);
        handshakes.evictions.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    const MACHINE: IpAddr = IpAddr::V4(Ipv4Addr::new(192, 0, 2, 1));

    fn at_ms(ms: u64) -> Instant {
        Instant::from_nanos(1_000_000_000 + ms * 1_000_000)
    }

    #[tokio::test]
    async fn an_evicted_handshake_gets_a_signal_and_keeps_its_slot_until_dropped() {
        let slots = HandshakeSlots::default();
        let mut open: Vec<HandshakeSlot> = (0..99).map_while(|_| slots.take(at_ms(0), MACHINE, 0)).collect();
        let before = open.len();
        open.push(slots.take(at_ms(250), MACHINE, 0).unwrap());
        let oldest = open.remove(0);
        oldest.evicted().await;
        oldest.finish();
        drop(oldest);
        assert_eq!(open.len(), before);
        open.push(slots.take(at_ms(250), MACHINE, 0).unwrap());
        open.remove(0).evicted().await;
        drop(open);
        assert!(slots.0.borrow().evictions.is_empty(), "no signal of a free slot is kept");
    }

    #[test]
    fn an_ip_address_of_the_configuration_is_reserved_from_the_start() {
        let configured = ["quic/192.0.2.1:7447", "quic/[2001:db8::1]:7447", "quic/leo.local:7447"];
        let slots = HandshakeSlots::reserved_for(&configured.map(|at| at.to_owned().try_into().unwrap()));
        let is_reserved = |at: &str| slots.take(at_ms(0), at.parse().unwrap(), MAX_UNRESERVED).is_some();
        assert_eq!(["192.0.2.1", "2001:db8::2", "192.0.2.2"].map(is_reserved), [true, true, false]);
    }

    #[test]
    fn connections_of_others_do_not_block_an_address_with_a_reservation() {
        let slots = HandshakeSlots::default();
        assert!(slots.take(at_ms(0), MACHINE, MAX_UNRESERVED - 1).is_some());
        assert!(slots.take(at_ms(0), MACHINE, MAX_UNRESERVED).is_none());
        slots.reserve(MACHINE);
        assert!(slots.take(at_ms(0), MACHINE, MAX_UNRESERVED).is_some());
        assert!(slots.take(at_ms(0), MACHINE, MAX_UNRESERVED + MAX_RESERVED).is_none());
    }
}

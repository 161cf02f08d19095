//! Slots for handshakes: connections whose certificate is not verified yet.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::net::{IpAddr, Ipv6Addr};
use std::rc::Rc;

use clock::{Duration, Instant};
use invariant::require;
use tokio::sync::Notify;

/// Maximum connections of an endpoint: in handshake, verified, and closing.
pub(crate) const MAX_CONNECTIONS: usize = 256;
/// Maximum of unverified connections per address, closing ones included.
const MAX_PER_ADDRESS: usize = 32;
/// Maximum of handshakes in progress per address. One more evicts the oldest, if that is older than
/// `UNDISTURBED`.
const MAX_OPEN_PER_ADDRESS: usize = 8;
/// Minimum time before a handshake can be evicted. A legitimate one takes a few round trips.
const UNDISTURBED: Duration = Duration::from_millis(250);

/// The slots in use, by address.
#[derive(Clone, Debug, Default)]
pub(crate) struct HandshakeSlots(Rc<RefCell<BTreeMap<IpAddr, Taken>>>);

/// The slots used by one address.
#[derive(Debug, Default)]
struct Taken {
    /// Handshakes in progress with their start times, oldest first.
    open: VecDeque<(Instant, Rc<Notify>)>,
    closing: usize,
}

/// A slot of an address; dropping it frees the slot.
#[derive(Debug)]
pub(crate) struct HandshakeSlot {
    slots: HandshakeSlots,
    address: IpAddr,
    evicted: Rc<Notify>,
}

impl HandshakeSlots {
    /// Reserves a slot for a connection from a validated address; `None` if the address has none left.
    ///
    /// The oldest handshake of the address is evicted once it had its time. An unfinished handshake would
    /// otherwise keep its slot for seconds.
    pub(crate) fn take(&self, now: Instant, address: IpAddr) -> Option<HandshakeSlot> {
        let address = network(address);
        let mut all = self.0.borrow_mut();
        let taken = all.entry(address).or_default();
        if taken.open.len() + taken.closing >= MAX_PER_ADDRESS {
            return None;
        }
        if taken.open.len() >= MAX_OPEN_PER_ADDRESS {
            let (_, oldest) = taken.open.front().filter(|(since, _)| now.since(*since) >= UNDISTURBED)?;
            oldest.notify_one();
            taken.open.pop_front();
            taken.closing += 1;
        }
        let evicted = Rc::new(Notify::new());
        taken.open.push_back((now, Rc::clone(&evicted)));
        Some(HandshakeSlot { slots: self.clone(), address, evicted })
    }
}

impl Taken {
    /// Removes a slot from the handshakes in progress; returns whether it was one.
    fn end(&mut self, slot: &Rc<Notify>) -> bool {
        let place = self.open.iter().position(|(_, open)| Rc::ptr_eq(open, slot));
        place.is_some_and(|place| self.open.remove(place).is_some())
    }
}

impl HandshakeSlot {
    /// Completes when the handshake is evicted.
    pub(crate) async fn evicted(&self) {
        self.evicted.notified().await;
    }

    /// Marks the handshake as finished while its connection is still in memory.
    pub(crate) fn close(&self) {
        if let Some(taken) = self.slots.0.borrow_mut().get_mut(&self.address)
            && taken.end(&self.evicted)
        {
            taken.closing += 1;
        }
    }
}

impl Drop for HandshakeSlot {
    fn drop(&mut self) {
        let mut all = self.slots.0.borrow_mut();
        let taken = all.get_mut(&self.address);
        let Some(taken) = require!(taken, "the address of a slot is known") else { return };
        if !taken.end(&self.evicted) {
            let others = taken.closing.checked_sub(1);
            taken.closing = require!(others, "a slot is open, or its connection is closing").unwrap_or(0);
        }
        if taken.open.is_empty() && taken.closing == 0 {
            all.remove(&self.address);
        }
    }
}

/// The unit of the limits: an IPv4 address or an IPv6 /64 network, since a host owns all addresses of its
/// /64.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) => {
            let [a, b, c, d, ..] = address.segments();
            Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).into()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> IpAddr {
        text.parse().unwrap()
    }

    fn at(ms: u64) -> Instant {
        Instant::from_nanos(1_000_000_000 + ms * 1_000_000)
    }

    #[test]
    fn an_address_has_some_slots_and_takes_none_of_another() {
        let slots = HandshakeSlots::default();
        let take = |ms, of| slots.take(at(ms), address(of));
        let mut taken: Vec<HandshakeSlot> = (0..99).map_while(|_| take(0, "192.0.2.1")).collect();
        assert_eq!(taken.len(), MAX_OPEN_PER_ADDRESS);
        // The same address as a dual-stack socket reports it.
        assert!(take(249, "192.0.2.1").is_none() && take(249, "::ffff:192.0.2.1").is_none());
        assert!(take(249, "192.0.2.2").is_some());
        // Evictions do not exceed the total per address.
        taken.extend((1..99).map_while(|turn| take(1000 * turn, "192.0.2.1")));
        assert_eq!(taken.len(), MAX_PER_ADDRESS);
        taken.pop();
        assert!(take(999_000, "192.0.2.1").is_some());
        drop(taken);
        assert!(slots.0.borrow().is_empty(), "nothing is kept of an address without a slot");
    }

    #[tokio::test]
    async fn the_oldest_handshake_of_an_address_makes_way_and_keeps_its_slot_until_it_is_gone() {
        let slots = HandshakeSlots::default();
        let take = |ms| slots.take(at(ms), address("192.0.2.1")).unwrap();
        let mut open: VecDeque<HandshakeSlot> = (0..MAX_OPEN_PER_ADDRESS).map(|_| take(0)).collect();
        let count = || {
            let all = slots.0.borrow();
            let taken = all.get(&address("192.0.2.1")).unwrap();
            (taken.open.len(), taken.closing)
        };
        assert_eq!(count(), (MAX_OPEN_PER_ADDRESS, 0));
        let newest = take(250);
        let oldest = open.pop_front().unwrap();
        oldest.evicted().await;
        assert_eq!(count(), (MAX_OPEN_PER_ADDRESS, 1));
        // The eviction is signalled once and counted once.
        oldest.close();
        assert_eq!(count(), (MAX_OPEN_PER_ADDRESS, 1));
        drop(oldest);
        assert_eq!(count(), (MAX_OPEN_PER_ADDRESS, 0));
        // A handshake that fails by itself is closing, too.
        newest.close();
        assert_eq!(count(), (MAX_OPEN_PER_ADDRESS - 1, 1));
        drop(newest);
        assert_eq!(count(), (MAX_OPEN_PER_ADDRESS - 1, 0));
    }

    #[test]
    fn the_addresses_of_one_host_are_one() {
        let slots = HandshakeSlots::default();
        let of_host = |host: usize| slots.take(at(0), address(&format!("2001:db8:0:1::{host:x}")));
        let taken: Vec<Option<HandshakeSlot>> = (0..MAX_OPEN_PER_ADDRESS).map(of_host).collect();
        assert!(taken.iter().all(Option::is_some) && of_host(99).is_none());
        assert!(slots.take(at(0), address("2001:db8:0:2::1")).is_some());
    }
}

//! Slots for handshakes: connections whose certificate is not verified yet.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr};
use std::rc::Rc;

/// Connections that an endpoint holds at most: in handshakes, verified, and closing.
pub(crate) const MAX_CONNECTIONS: usize = 256;
/// Handshakes of one address at most.
const MAX_PER_ADDRESS: usize = 8;

/// The slots that are taken, by address.
#[derive(Clone, Debug, Default)]
pub(crate) struct HandshakeSlots(Rc<RefCell<BTreeMap<IpAddr, usize>>>);

/// A slot of an address. Dropping it gives it back.
#[derive(Debug)]
pub(crate) struct HandshakeSlot {
    slots: HandshakeSlots,
    address: IpAddr,
}

impl HandshakeSlots {
    /// A slot for a connection from an address that is proven, where that address has one left.
    pub(crate) fn take(&self, address: IpAddr) -> Option<HandshakeSlot> {
        let address = network(address);
        let mut taken = self.0.borrow_mut();
        let of_address = taken.entry(address).or_default();
        if *of_address >= MAX_PER_ADDRESS {
            return None;
        }
        *of_address += 1;
        Some(HandshakeSlot { slots: self.clone(), address })
    }
}

impl Drop for HandshakeSlot {
    fn drop(&mut self) {
        let mut taken = self.slots.0.borrow_mut();
        if let Some(of_address) = taken.get_mut(&self.address) {
            *of_address = of_address.saturating_sub(1);
            if *of_address == 0 {
                taken.remove(&self.address);
            }
        }
    }
}

/// What counts as one address: of IPv6 the network, since a host has all addresses of its own /64.
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

    #[test]
    fn an_address_has_some_places_and_takes_none_of_another() {
        let slots = HandshakeSlots::default();
        let mut taken: Vec<HandshakeSlot> =
            (0..MAX_PER_ADDRESS).map_while(|_| slots.take(address("192.0.2.1"))).collect();
        assert_eq!(taken.len(), MAX_PER_ADDRESS);
        assert!(slots.take(address("192.0.2.1")).is_none());
        // The same address, as a socket of both families tells it.
        assert!(slots.take(address("::ffff:192.0.2.1")).is_none());
        assert!(slots.take(address("192.0.2.2")).is_some());
        taken.pop();
        assert!(slots.take(address("192.0.2.1")).is_some());
        drop(taken);
        assert!(slots.0.borrow().is_empty(), "nothing is kept of an address without a slot");
    }

    #[test]
    fn the_addresses_of_one_host_are_one() {
        let slots = HandshakeSlots::default();
        let of_host = |host: usize| slots.take(address(&format!("2001:db8:0:1::{host:x}")));
        let taken: Vec<Option<HandshakeSlot>> = (0..MAX_PER_ADDRESS).map(of_host).collect();
        assert!(taken.iter().all(Option::is_some) && of_host(99).is_none());
        assert!(slots.take(address("2001:db8:0:2::1")).is_some());
    }
}

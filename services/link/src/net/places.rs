//! The places of connections whose certificate is not verified yet.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv6Addr};
use std::rc::Rc;

/// Connections that an endpoint holds at most, the verified ones and those that are being closed included.
pub(crate) const MAX_CONNECTIONS: usize = 256;
/// Of these, those of one address whose certificate is not verified.
const MAX_PER_ADDRESS: usize = 8;

/// The places that are taken, by address.
#[derive(Clone, Debug, Default)]
pub(crate) struct Places(Rc<RefCell<BTreeMap<IpAddr, usize>>>);

/// A place of an address. Dropping it gives it back.
#[derive(Debug)]
pub(crate) struct Place {
    places: Places,
    address: IpAddr,
}

impl Places {
    /// A place for a connection from an address that is proven, where that address has one left.
    pub(crate) fn take(&self, address: IpAddr) -> Option<Place> {
        let address = network(address);
        let mut taken = self.0.borrow_mut();
        let of_address = taken.entry(address).or_default();
        if *of_address >= MAX_PER_ADDRESS {
            return None;
        }
        *of_address += 1;
        Some(Place { places: self.clone(), address })
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.0.borrow_mut();
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
        let places = Places::default();
        let mut taken: Vec<Place> =
            (0..MAX_PER_ADDRESS).map_while(|_| places.take(address("192.0.2.1"))).collect();
        assert_eq!(taken.len(), MAX_PER_ADDRESS);
        assert!(places.take(address("192.0.2.1")).is_none());
        // The same address, as a socket of both families tells it.
        assert!(places.take(address("::ffff:192.0.2.1")).is_none());
        assert!(places.take(address("192.0.2.2")).is_some());
        taken.pop();
        assert!(places.take(address("192.0.2.1")).is_some());
        drop(taken);
        assert!(places.0.borrow().is_empty(), "nothing is kept of an address without a place");
    }

    #[test]
    fn the_addresses_of_one_host_are_one() {
        let places = Places::default();
        let of_host = |host: usize| places.take(address(&format!("2001:db8:0:1::{host:x}")));
        let taken: Vec<Option<Place>> = (0..MAX_PER_ADDRESS).map(of_host).collect();
        assert!(taken.iter().all(Option::is_some) && of_host(99).is_none());
        assert!(places.take(address("2001:db8:0:2::1")).is_some());
    }
}

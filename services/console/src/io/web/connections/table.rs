//! The table of open connections and its eviction policy. No I/O.

use core::net::{IpAddr, Ipv6Addr};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clock::{Duration, Instant};
use tokio::task::AbortHandle;

/// Minimum age of an evicted connection. It gives a slow browser time for its request head. It also bounds the rate
/// at which a flood opens connections, so that the accept queue stays short.
const MIN_AGE: Duration = Duration::from_millis(100);
/// Prefix length of an IPv6 network: one machine owns all addresses of a /64.
const NETWORK_BITS: u32 = 64;

/// The use of a connection so far. Each class has its own limits and is evicted separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    /// No request with the token yet.
    Unknown,
    /// A request that raises the emergency stop.
    Stopping,
    /// A request with the token.
    Authorised,
}

impl Class {
    /// Maximum number of connections of this class: in total, and per address.
    const fn max(self) -> (usize, usize) {
        match self {
            Self::Unknown => (512, 256),
            Self::Stopping => (32, 8),
            Self::Authorised => (64, 64),
        }
    }
}

/// All connections.
#[derive(Debug, Default)]
pub(crate) struct Table(Mutex<Entries>);

#[derive(Debug, Default)]
struct Entries {
    last: u64,
    evicted: u64,
    /// By number: older connections have lower numbers.
    open: BTreeMap<u64, Entry>,
}

#[derive(Debug)]
struct Entry {
    class: Class,
    address: IpAddr,
    since: Instant,
    served: Option<AbortHandle>,
}

/// The handle of a connection; dropping it removes the entry.
#[derive(Debug)]
pub(crate) struct Connection {
    table: Arc<Table>,
    number: u64,
    pub(crate) address: IpAddr,
}

impl Table {
    fn entries(&self) -> MutexGuard<'_, Entries> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How long a new connection of an address must wait until one is old enough to be evicted; `None` if it need not.
    pub(super) fn wait_for_room(&self, address: IpAddr, now: Instant) -> Option<Duration> {
        let entries = self.entries();
        let oldest = entries.to_evict(Class::Unknown, network(address))?;
        let age = now.since(entries.open.get(&oldest)?.since);
        (age < MIN_AGE).then(|| MIN_AGE - age)
    }

    /// Adds a connection. If its address is at its limit, evicts the oldest of that address. Otherwise, if the class is
    /// full, evicts the oldest of the address with the most connections.
    pub(crate) fn enter(self: &Arc<Self>, address: IpAddr, now: Instant) -> Arc<Connection> {
        let mut entries = self.entries();
        let address = network(address);
        entries.evict_one(Class::Unknown, address);
        entries.last += 1;
        let number = entries.last;
        entries.open.insert(number, Entry { class: Class::Unknown, address, since: now, served: None });
        Arc::new(Connection { table: Arc::clone(self), number, address })
    }

    /// Number of connections so far.
    #[cfg(test)]
    pub(crate) fn entered(&self) -> u64 {
        self.entries().last
    }

    /// Number of evicted connections.
    pub(crate) fn evicted(&self) -> u64 {
        self.entries().evicted
    }
}

impl Entries {
    /// The connection that must be evicted for a further one of this class and address, if any.
    fn to_evict(&self, class: Class, address: IpAddr) -> Option<u64> {
        let (max, max_of_address) = class.max();
        let of_class = || self.open.iter().filter(move |(_, entry)| entry.class == class);
        let oldest_of = |address: IpAddr| {
            of_class().find(|(_, entry)| entry.address == address).map(|(number, _)| *number)
        };
        if of_class().filter(|(_, entry)| entry.address == address).count() >= max_of_address {
            return oldest_of(address);
        }
        if of_class().count() < max {
            return None;
        }
        let mut counts = BTreeMap::<IpAddr, usize>::new();
        of_class().for_each(|(_, entry)| *counts.entry(entry.address).or_default() += 1);
        oldest_of(counts.into_iter().max_by_key(|(_, count)| *count)?.0)
    }

    fn evict_one(&mut self, class: Class, address: IpAddr) {
        while let Some(number) = self.to_evict(class, address) {
            self.evicted += 1;
            if let Some(served) = self.open.remove(&number).and_then(|entry| entry.served) {
                served.abort();
            }
        }
    }
}

impl Connection {
    /// Sets the task that serves the connection; eviction aborts it.
    pub(super) fn ends_with(&self, served: AbortHandle) {
        match self.table.entries().open.get_mut(&self.number) {
            Some(entry) => entry.served = Some(served),
            None => served.abort(),
        }
    }

    /// Marks the time from which the connection is served.
    pub(super) fn begins(&self, now: Instant) {
        if let Some(entry) = self.table.entries().open.get_mut(&self.number) {
            entry.since = now;
        }
    }

    /// Changes the class of the connection.
    pub(crate) fn set_class(&self, class: Class) {
        let mut entries = self.table.entries();
        let known = entries.open.get(&self.number).map(|entry| entry.class);
        // A connection that used the token stays authorised.
        if known.is_none_or(|known| [class, Class::Authorised].contains(&known)) {
            return;
        }
        entries.evict_one(class, self.address);
        if let Some(entry) = entries.open.get_mut(&self.number) {
            entry.class = class;
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        let _gone = self.table.entries().open.remove(&self.number);
    }
}

/// The address, or for IPv6 its network prefix.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => IpAddr::V4(address),
        IpAddr::V6(address) => {
            let mask = u128::MAX << (u128::BITS - NETWORK_BITS);
            IpAddr::V6(Ipv6Addr::from_bits(address.to_bits() & mask))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Instant {
        Instant::EPOCH + Duration::from_millis(ms)
    }

    fn address(last: u8) -> IpAddr {
        IpAddr::from([127, 0, 0, last])
    }

    /// The numbers of the connections of a class.
    fn of(table: &Table, class: Class) -> Vec<u64> {
        let entries = table.entries();
        let of_class = entries.open.iter().filter(|(_, entry)| entry.class == class);
        of_class.map(|(number, _)| *number).collect()
    }

    #[test]
    fn an_address_at_its_limit_evicts_only_its_own_connections() {
        let table = Arc::new(Table::default());
        let other = table.enter(address(2), at(0));
        let flood: Vec<_> = (0..500).map(|_| table.enter(address(1), at(1))).collect();
        let left = of(&table, Class::Unknown);
        assert_eq!((left.len(), left[0], table.evicted()), (257, other.number, 244));
        assert_eq!(left.last(), Some(&flood[499].number));
        drop(flood);
        assert_eq!(of(&table, Class::Unknown), [other.number]);
    }

    #[test]
    fn a_full_table_evicts_from_the_address_with_most_connections() {
        let table = Arc::new(Table::default());
        let flood: Vec<_> = (0..250).map(|_| table.enter(address(1), at(0))).collect();
        let others = (0..200).flat_map(|last| [2, 3].map(|net| IpAddr::from([127, 0, net, last])));
        let others: Vec<_> = others.map(|address| table.enter(address, at(0))).collect();
        let left = of(&table, Class::Unknown);
        assert_eq!(left.len(), 512);
        assert!(others.iter().all(|other| left.contains(&other.number)));
        assert_eq!(flood.iter().filter(|one| left.contains(&one.number)).count(), 112);
    }

    #[test]
    fn authorised_and_stopping_connections_are_not_evicted_by_unknown_ones() {
        let table = Arc::new(Table::default());
        let known = table.enter(address(1), at(0));
        known.set_class(Class::Authorised);
        known.set_class(Class::Stopping);
        let stops = table.enter(address(1), at(0));
        stops.set_class(Class::Stopping);
        let flood: Vec<_> = (0..500).map(|_| table.enter(address(1), at(0))).collect();
        assert_eq!(of(&table, Class::Authorised), [known.number]);
        assert_eq!(of(&table, Class::Stopping), [stops.number]);
        for one in flood.iter().rev() {
            one.set_class(Class::Authorised);
        }
        assert_eq!(of(&table, Class::Authorised).len(), 64, "they are bounded too");
    }

    #[test]
    fn no_connection_is_evicted_before_its_minimum_age() {
        let table = Arc::new(Table::default());
        let _flood: Vec<_> = (0..256).map(|_| table.enter(address(1), at(100))).collect();
        assert_eq!(table.wait_for_room(address(2), at(100)), None);
        assert_eq!(table.wait_for_room(address(1), at(130)), Some(Duration::from_millis(70)));
        assert_eq!(table.wait_for_room(address(1), at(200)), None);
    }

    #[test]
    fn all_addresses_of_a_network_are_one() {
        let of = |text: &str| network(text.parse().unwrap());
        assert_eq!(of("2001:db8::1"), of("2001:db8::ffff:1"));
        assert_ne!(of("2001:db8::1"), of("2001:db8:0:1::1"));
        assert_eq!(of("::ffff:127.0.0.1"), of("127.0.0.1"));
        assert_ne!(of("127.0.0.1"), of("127.0.0.2"));
    }
}

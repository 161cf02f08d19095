//! Slots for handshakes: limits, reservations, and which handshake makes way for a new one.

use core::net::{IpAddr, Ipv6Addr};
use std::collections::{BTreeMap, VecDeque};

use clock::{Duration, Instant};
use invariant::{invariant, require};

/// Maximum of slots of all addresses without a reservation, closing connections included.
pub(crate) const MAX_UNRESERVED: usize = 256;
/// Maximum of handshakes in progress of these addresses. One more evicts the oldest of them, if that is older
/// than `UNDISTURBED`. The rest of the slots is for the evicted connections, which close.
const MAX_IN_PROGRESS_UNRESERVED: usize = MAX_UNRESERVED / 2;
/// Maximum of slots per address, closing connections included.
const MAX_PER_ADDRESS: usize = 32;
/// Maximum of handshakes in progress per address. One more evicts the oldest of the address, if that is older
/// than `UNDISTURBED`.
const MAX_IN_PROGRESS_PER_ADDRESS: usize = 8;
/// Minimum time before a handshake can be evicted. A legitimate one takes a few round trips.
const UNDISTURBED: Duration = Duration::from_millis(250);
/// Maximum of addresses with a reservation.
const MAX_RESERVATIONS: usize = 8;
/// Maximum of slots of these addresses. They are additional to `MAX_UNRESERVED`, and enough for all of them.
pub(crate) const MAX_RESERVED: usize = MAX_RESERVATIONS * MAX_PER_ADDRESS;

/// The slots in use, and the addresses with a reservation.
///
/// Other addresses can neither occupy nor evict the slots of an address with a reservation.
#[derive(Debug, Default)]
pub(crate) struct SlotTable {
    /// By number; older slots have lower numbers.
    slots: BTreeMap<u64, Slot>,
    next: u64,
    /// The most recently reserved one is the last.
    reservations: VecDeque<IpAddr>,
}

#[derive(Clone, Copy, Debug)]
struct Slot {
    address: IpAddr,
    since: Instant,
    /// Whether the handshake is in progress; otherwise its connection closes.
    is_in_progress: bool,
    is_reserved: bool,
}

/// A slot that was taken, and the evicted handshake that has to close for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TakenSlot {
    pub(crate) number: u64,
    pub(crate) evicted: Option<u64>,
}

impl SlotTable {
    /// Takes a slot for a validated address; `None` if none is free and no handshake may be evicted.
    pub(crate) fn take(&mut self, now: Instant, address: IpAddr) -> Option<TakenSlot> {
        let address = network(address);
        let is_reserved = self.reservations.contains(&address);
        let is_its = |slot: &Slot| slot.address == address;
        let is_full = !is_reserved && self.count(|slot| !slot.is_reserved) >= MAX_UNRESERVED;
        if is_full || self.count(is_its) >= MAX_PER_ADDRESS {
            return None;
        }
        let evicted = if self.count(|slot| slot.is_in_progress && is_its(slot)) >= MAX_IN_PROGRESS_PER_ADDRESS
        {
            Some(self.evictable(now, is_its)?)
        } else if !is_reserved
            && self.count(|slot| slot.is_in_progress && !slot.is_reserved) >= MAX_IN_PROGRESS_UNRESERVED
        {
            Some(self.evictable(now, |slot| !slot.is_reserved)?)
        } else {
            None
        };
        if let Some(evicted) = evicted {
            self.finish(evicted);
        }
        let number = self.next;
        self.next += 1;
        self.slots.insert(number, Slot { address, since: now, is_in_progress: true, is_reserved });
        Some(TakenSlot { number, evicted })
    }

    /// Marks a handshake as finished while its connection is still in memory.
    pub(crate) fn finish(&mut self, number: u64) {
        if let Some(slot) = require!(self.slots.get_mut(&number), "a finished handshake has a slot") {
            slot.is_in_progress = false;
        }
    }

    /// Frees a slot.
    pub(crate) fn free(&mut self, number: u64) {
        invariant!(self.slots.remove(&number).is_some(), "a slot that is freed was taken");
    }

    /// Reserves slots for an address from now on.
    ///
    /// If the list is full, the new address replaces the least recently reserved one without a reserved slot in use.
    /// If all have one in use, nothing changes: the slots in use stay within `MAX_RESERVED`.
    pub(crate) fn reserve(&mut self, address: IpAddr) {
        let address = network(address);
        let is_unused = |reserved: &IpAddr| {
            !self.slots.values().any(|slot| slot.is_reserved && slot.address == *reserved)
        };
        let displaced = match self.reservations.iter().position(|reserved| *reserved == address) {
            None if self.reservations.len() >= MAX_RESERVATIONS => {
                let Some(unused) = self.reservations.iter().position(is_unused) else { return };
                Some(unused)
            }
            place => place,
        };
        if let Some(place) = displaced {
            self.reservations.remove(place);
        }
        self.reservations.push_back(address);
    }

    /// Whether an address has a reservation.
    pub(crate) fn is_reserved(&self, address: IpAddr) -> bool {
        self.reservations.contains(&network(address))
    }

    /// The oldest of these handshakes, if it is at least [`UNDISTURBED`] old.
    fn evictable(&self, now: Instant, is_one: impl Fn(&Slot) -> bool) -> Option<u64> {
        let (number, oldest) = self.slots.iter().find(|(_, slot)| slot.is_in_progress && is_one(slot))?;
        (now.since(oldest.since) >= UNDISTURBED).then_some(*number)
    }

    fn count(&self, is_one: impl Fn(&Slot) -> bool) -> usize {
        self.slots.values().filter(|slot| is_one(slot)).count()
    }
}

/// The unit of the limits: an IPv4 address or an IPv6 /64 network, since a host owns all addresses of its
/// /64.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() >> 64 << 64).into(),
    }
}

#[cfg(test)]
mod tests;

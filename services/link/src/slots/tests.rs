use core::net::Ipv4Addr;

use proptest::prelude::*;

use super::*;

fn address(text: &str) -> IpAddr {
    text.parse().unwrap()
}

fn numbered(number: u8) -> IpAddr {
    Ipv4Addr::new(192, 0, 2, number).into()
}

fn at(ms: u64) -> Instant {
    Instant::from_nanos(1_000_000_000 + ms * 1_000_000)
}

/// Takes slots for an address until none is left, with a pause between two that allows evictions.
fn fill(table: &mut SlotTable, now_ms: &mut u64, of: IpAddr) -> Vec<u64> {
    let mut taken = Vec::new();
    while let Some(slot) = table.take(at(*now_ms), of) {
        taken.push(slot.number);
        *now_ms += 250;
    }
    taken
}

#[test]
fn an_address_gets_its_own_slots_and_takes_none_of_another() {
    let mut table = SlotTable::default();
    let mut taken: Vec<u64> =
        (0..99).map_while(|_| table.take(at(0), numbered(1))).map(|slot| slot.number).collect();
    assert_eq!(taken.len(), MAX_IN_PROGRESS_PER_ADDRESS);
    // The same address as a dual-stack socket reports it.
    assert_eq!([numbered(1), address("::ffff:192.0.2.1")].map(|of| table.take(at(249), of)), [None; 2]);
    let other = table.take(at(249), numbered(2)).unwrap();
    // Evictions do not exceed the total per address.
    taken.extend(fill(&mut table, &mut 1000, numbered(1)));
    assert_eq!(taken.len(), MAX_PER_ADDRESS);
    table.free(taken.pop().unwrap());
    assert!(table.take(at(999_000), numbered(1)).is_some());
    assert!(table.slots.get(&other.number).is_some_and(|slot| slot.is_in_progress));
}

#[test]
fn the_addresses_of_one_host_are_one() {
    let mut table = SlotTable::default();
    let mut of_host = |host: usize| table.take(at(0), address(&format!("2001:db8:0:1::{host:x}")));
    assert!((0..MAX_IN_PROGRESS_PER_ADDRESS).all(|host| of_host(host).is_some()) && of_host(99).is_none());
    assert!(table.take(at(0), address("2001:db8:0:2::1")).is_some());
    table.reserve(address("2001:db8:0:1::1"));
    assert!(table.is_reserved(address("2001:db8:0:1::2")) && !table.is_reserved(address("2001:db8:0:2::1")));
}

#[test]
fn a_new_address_evicts_the_oldest_handshake_of_any_other() {
    let mut table = SlotTable::default();
    let mut addresses = (0..=255).map(numbered);
    let first = table.take(at(0), addresses.next().unwrap()).unwrap().number;
    for _ in 1..MAX_IN_PROGRESS_UNRESERVED {
        table.take(at(1), addresses.next().unwrap()).unwrap();
    }
    let new = addresses.next().unwrap();
    assert_eq!(table.take(at(249), new), None, "each handshake has its time");
    assert_eq!(table.take(at(250), new).unwrap().evicted, Some(first));
    assert_eq!(table.take(at(250), new), None, "the next one has not had its time");
    assert_eq!(table.take(at(251), new).unwrap().evicted, Some(first + 1));
}

#[test]
fn a_reserved_address_gets_all_its_slots_in_a_full_table() {
    let mut table = SlotTable::default();
    table.reserve(numbered(0));
    let mut now_ms = 0;
    let others: usize = (1..=255).map(|number| fill(&mut table, &mut now_ms, numbered(number)).len()).sum();
    assert_eq!(others, MAX_UNRESERVED);
    assert_eq!(table.take(at(now_ms), address("198.51.100.1")), None);
    assert_eq!(fill(&mut table, &mut now_ms, numbered(0)).len(), MAX_PER_ADDRESS);
}

#[test]
fn the_most_recent_reservations_are_kept_and_none_in_use_is_displaced() {
    let mut table = SlotTable::default();
    table.reserve(numbered(0));
    let in_use = table.take(at(0), numbered(0)).unwrap().number;
    (1..=9).for_each(|number| table.reserve(numbered(number)));
    assert_eq!(table.reservations, [0, 3, 4, 5, 6, 7, 8, 9].map(numbered));
    table.free(in_use);
    // The same again is the most recent one, and takes no second place.
    table.reserve(numbered(3));
    table.reserve(numbered(10));
    assert_eq!(table.reservations, [4, 5, 6, 7, 8, 9, 3, 10].map(numbered));
    let of_each = (0..=255).filter(|number| table.take(at(0), numbered(*number)).is_some());
    assert!(of_each.count() > MAX_RESERVATIONS);
    table.reserve(numbered(11));
    assert_eq!(table.reservations, [4, 5, 6, 7, 8, 9, 3, 10].map(numbered), "all are in use");
}

/// An event of the table.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// An address tries so often to take a slot.
    Take {
        of: u8,
        times: u8,
    },
    /// Consecutive addresses try once each.
    Flood {
        from: u8,
        addresses: u8,
    },
    /// A certificate of an address is accepted.
    Reserve(u8),
    /// The slots in use from a place on are closed, or freed.
    Close {
        place: usize,
        count: usize,
    },
    Free {
        place: usize,
        count: usize,
    },
    Wait {
        ms: u64,
    },
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        4 => (0..24_u8, 1..40_u8).prop_map(|(of, times)| Event::Take { of, times }),
        4 => (any::<u8>(), 1..200_u8).prop_map(|(from, addresses)| Event::Flood { from, addresses }),
        1 => (0..24_u8).prop_map(Event::Reserve),
        1 => (0..600_usize, 1..100_usize).prop_map(|(place, count)| Event::Close { place, count }),
        1 => (0..600_usize, 1..100_usize).prop_map(|(place, count)| Event::Free { place, count }),
        4 => (1..400_u64).prop_map(|ms| Event::Wait { ms }),
    ]
}

/// Takes a slot and checks the result.
fn take(table: &mut SlotTable, now_ms: u64, of: IpAddr) -> Result<(), TestCaseError> {
    let its: Vec<Slot> = table.slots.values().filter(|slot| slot.address == of).copied().collect();
    let oldest = its.iter().find(|slot| slot.is_in_progress).map(|slot| slot.since);
    let is_crowded = its.iter().filter(|slot| slot.is_in_progress).count() >= MAX_IN_PROGRESS_PER_ADDRESS;
    let has_had_its_time = oldest.is_some_and(|since| at(now_ms).since(since) >= UNDISTURBED);
    let is_within = its.len() < MAX_PER_ADDRESS && (!is_crowded || has_had_its_time);
    let is_reserved = table.is_reserved(of);
    let before = table.slots.clone();
    let taken = table.take(at(now_ms), of);
    if is_reserved {
        prop_assert_eq!(taken.is_some(), is_within, "an address with a reservation");
    } else {
        prop_assert!(taken.is_none() || is_within, "an address without one");
    }
    if let Some(evicted) = taken.and_then(|taken| taken.evicted).and_then(|number| before.get(&number)) {
        prop_assert!(
            evicted.is_in_progress && (evicted.address == of || !(is_reserved || evicted.is_reserved))
        );
    }
    Ok(())
}

proptest! {
    #[test]
    fn a_reserved_address_always_gets_its_slots_and_the_total_is_bounded(
        events in proptest::collection::vec(event(), 1..120),
    ) {
        let (mut table, mut now_ms) = (SlotTable::default(), 0);
        for event in events {
            let some = |place: usize, count: usize, table: &SlotTable| -> Vec<u64> {
                table.slots.keys().skip(place).take(count).copied().collect()
            };
            match event {
                Event::Take { of, times } => {
                    (0..times).try_for_each(|_| take(&mut table, now_ms, numbered(of)))?;
                }
                Event::Flood { from, addresses } => (0..addresses)
                    .try_for_each(|number| take(&mut table, now_ms, numbered(from.wrapping_add(number))))?,
                Event::Reserve(number) => table.reserve(numbered(number)),
                Event::Close { place, count } => {
                    some(place, count, &table).into_iter().for_each(|number| table.finish(number));
                }
                Event::Free { place, count } => {
                    some(place, count, &table).into_iter().for_each(|number| table.free(number));
                }
                Event::Wait { ms } => now_ms += ms,
            }
            let reserved = table.count(|slot| slot.is_reserved);
            prop_assert!(table.slots.len() - reserved <= MAX_UNRESERVED && reserved <= MAX_RESERVED);
            prop_assert!(table.count(|slot| slot.is_in_progress && !slot.is_reserved) <= MAX_IN_PROGRESS_UNRESERVED);
            prop_assert!(table.reservations.len() <= MAX_RESERVATIONS);
        }
    }
}

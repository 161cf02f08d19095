use std::collections::BTreeSet;

use clock::{Duration, Instant};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

use super::injection::FAULT_KINDS;
use super::{FaultKind, FaultSpec};

/// The ID used for echoes: the broadcast ID, which no servo has.
pub(super) const HOST: u8 = 0xFE;

/// Counters of injected faults, per kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaultCounts([u64; FAULT_KINDS]);

impl FaultCounts {
    /// The count of one kind.
    #[must_use]
    pub fn of(&self, kind: FaultKind) -> u64 {
        self.0.get(kind as usize).copied().unwrap_or(0)
    }

    /// Every kind with its count.
    pub fn iter(&self) -> impl Iterator<Item = (FaultKind, u64)> {
        FaultKind::ALL.into_iter().zip(self.0)
    }

    pub(super) fn add(&mut self, kind: FaultKind) {
        self.0.get_mut(kind as usize).into_iter().for_each(|count| *count += 1);
    }
}

/// Decides which faults occur on a bus, and when. It is deterministic in the seed, the faults, the instructions and
/// their times.
///
/// Every fault has its own random stream, so an additional fault does not change the others.
#[derive(Clone, Debug, Default)]
pub struct Injector {
    bus: String,
    seed: u64,
    pub(super) active: Vec<Active>,
    /// The faults injected so far.
    pub injected: FaultCounts,
}

#[derive(Clone, Debug)]
pub(super) struct Active {
    injection: FaultSpec,
    since: Instant,
    random: ChaCha8Rng,
    /// Whether a one-time fault has occurred.
    done: bool,
    /// The servos that a once-per-servo fault has affected.
    affected: BTreeSet<u8>,
}

impl Active {
    fn is_active_at(&self, now: Instant) -> bool {
        self.injection.is_active_at(now.since(self.since))
    }

    fn end(&self) -> Option<Instant> {
        let lasts = self.injection.lasts()?;
        Some(self.since + self.injection.begins() + lasts)
    }
}

impl Injector {
    /// An injector without faults.
    #[must_use]
    pub fn new(bus: &str, seed: u64) -> Self {
        Self { bus: bus.to_owned(), seed, ..Self::default() }
    }

    /// Replaces the enabled faults; faults that were already enabled keep their state.
    pub fn set(&mut self, now: Instant, injections: &[FaultSpec]) {
        let mut before = std::mem::take(&mut self.active);
        for injection in injections.iter().filter(|injection| injection.is_on(&self.bus)) {
            let running = before.iter().position(|active| active.injection == *injection);
            let active = running.map(|place| before.remove(place));
            let active = active.unwrap_or_else(|| self.begin(now, injection));
            self.active.push(active);
        }
    }

    fn begin(&self, now: Instant, injection: &FaultSpec) -> Active {
        let same = self.active.iter().filter(|active| active.injection == *injection).count();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(hash(&format!("{injection} {} {same}", self.bus)));
        Active { injection: injection.clone(), since: now, random, done: false, affected: BTreeSet::new() }
    }

    /// Decides whether a fault of this kind affects a reply or an instruction now, and counts it. The caller applies
    /// the fault.
    pub(super) fn triggers(&mut self, kind: FaultKind, now: Instant, id: u8) -> Option<Strike> {
        let mut strike = None;
        for active in &mut self.active {
            let injection = &active.injection;
            let by_event = kind.is_event() && injection.chance.is_none();
            if injection.kind != kind
                || by_event
                || !injection.is_to(id)
                || !active.is_active_at(now)
                || active.done
            {
                continue;
            }
            if triggers(&mut active.random, injection.chance) {
                active.done = injection.at.is_some();
                let (by, is, random) = (injection.by, injection.is, active.random.next_u64());
                strike = strike.or(Some(Strike { by, is, random }));
            }
        }
        if strike.is_some() {
            self.injected.add(kind);
        }
        strike
    }

    /// Whether a lasting fault is active now.
    pub(super) fn is_active(&self, kind: FaultKind, now: Instant, id: u8) -> bool {
        self.held(kind, now, id).next().is_some()
    }

    /// The optional number of a lasting fault that is active now; `None` if none is.
    pub(super) fn active_number(&self, kind: FaultKind, now: Instant, id: u8) -> Option<Option<u16>> {
        self.held(kind, now, id).next().map(|active| active.injection.is)
    }

    /// The end of a lasting fault of the whole bus that is active now; `None` if none is.
    pub(super) fn active_until(&self, kind: FaultKind, now: Instant) -> Option<Instant> {
        let held = self.held(kind, now, HOST);
        held.map(|active| active.end().unwrap_or(Instant::from_nanos(u64::MAX))).max()
    }

    /// The faults of a kind that are active now at this ID; a fault of the whole bus is active at every ID.
    fn held(&self, kind: FaultKind, now: Instant, id: u8) -> impl Iterator<Item = &Active> {
        let is_held = move |active: &&Active| {
            active.injection.kind == kind && active.injection.is_to(id) && active.is_active_at(now)
        };
        self.active.iter().filter(is_held)
    }

    /// The events of a servo that are due and not yet delivered, each with its end.
    pub(super) fn events(&mut self, now: Instant, id: u8) -> Vec<(FaultKind, Instant)> {
        let mut events = Vec::new();
        for active in &mut self.active {
            let injection = &active.injection;
            let once = injection.kind.is_event() && injection.chance.is_none();
            // An event is delivered even if its duration is over.
            let begun = now.since(active.since) >= injection.begins();
            if once && begun && injection.is_to(id) && active.affected.insert(id) {
                events.push((injection.kind, active.end().unwrap_or(now)));
                self.injected.add(injection.kind);
            }
        }
        events
    }
}

/// The parameters of a fault that occurs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strike {
    pub(super) by: Option<Duration>,
    pub(super) is: Option<u16>,
    random: u64,
}

impl Strike {
    /// A pseudo-random number below `max`, which is above zero; it changes with each call.
    pub(super) fn below(&mut self, max: usize) -> usize {
        let max = u64::try_from(max.max(1)).unwrap_or(u64::MAX);
        let number = self.random % max;
        self.random = self.random.rotate_right(17).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        usize::try_from(number).unwrap_or(0)
    }

    /// Flips a bit.
    pub(super) fn flip(&mut self, bytes: &mut [u8]) {
        let bit = self.below(8 * bytes.len());
        if let Some(byte) = bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    }
}

fn triggers(random: &mut ChaCha8Rng, chance: Option<f64>) -> bool {
    let Some(chance) = chance else { return true };
    let draw = quantity::number::float(random.next_u64() >> 11) / quantity::number::float(1 << 53);
    draw < chance
}

/// FNV-1a: stable across machines and versions.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

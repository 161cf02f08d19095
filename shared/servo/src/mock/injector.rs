use std::collections::BTreeSet;

use clock::{Duration, Instant};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

use super::injection::KINDS;
use super::{Injection, Kind};

/// How often each kind of fault happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Injected([u64; KINDS]);

impl Injected {
    /// How often a kind happened.
    #[must_use]
    pub fn of(&self, kind: Kind) -> u64 {
        self.iter().find_map(|(each, count)| (each == kind).then_some(count)).unwrap_or(0)
    }

    /// Every kind and how often it happened.
    pub fn iter(&self) -> impl Iterator<Item = (Kind, u64)> {
        Kind::ALL.into_iter().zip(self.0)
    }

    fn add(&mut self, kind: Kind) {
        if let Some((_, count)) = Kind::ALL.iter().zip(&mut self.0).find(|(each, _)| **each == kind) {
            *count += 1;
        }
    }
}

/// Decides which faults happen on one bus, and when: the same ones for the same seed, the same
/// faults and the same instructions at the same instants.
///
/// Every fault has a random stream of its own, so that one more does not change the others.
#[derive(Clone, Debug)]
pub struct Injector {
    bus: String,
    seed: u64,
    active: Vec<Active>,
    injected: Injected,
}

#[derive(Clone, Debug)]
struct Active {
    injection: Injection,
    since: Instant,
    random: ChaCha8Rng,
    /// Whether it happened, where it happens once.
    done: bool,
    /// The servos to which it happened, where it happens to each once.
    struck: BTreeSet<u8>,
}

impl Active {
    fn is_due(&self, now: Instant) -> bool {
        self.injection.is_due(now.since(self.since))
    }
}

impl Injector {
    /// Puts nothing in.
    #[must_use]
    pub fn new(bus: &str, seed: u64) -> Self {
        Self { bus: bus.to_owned(), seed, active: Vec::new(), injected: Injected::default() }
    }

    /// Switches faults on and all others off; those that are on already go on as they are.
    pub fn set(&mut self, now: Instant, injections: &[Injection]) {
        let mut before = std::mem::take(&mut self.active);
        for injection in injections.iter().filter(|injection| injection.is_on(&self.bus)) {
            let running = before.iter().position(|active| active.injection == *injection);
            let active = running.map(|place| before.remove(place));
            let active = active.unwrap_or_else(|| self.begin(now, injection));
            self.active.push(active);
        }
    }

    fn begin(&self, now: Instant, injection: &Injection) -> Active {
        let same = self.active.iter().filter(|active| active.injection == *injection).count();
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(hash(&format!("{injection} {} {same}", self.bus)));
        Active { injection: injection.clone(), since: now, random, done: false, struck: BTreeSet::new() }
    }

    /// Whether nothing is switched on.
    pub(super) const fn is_idle(&self) -> bool {
        self.active.is_empty()
    }

    /// What happened so far.
    #[must_use]
    pub const fn injected(&self) -> Injected {
        self.injected
    }

    /// Whether a fault of a kind happens to an answer or an instruction now, and random numbers for how.
    /// Whoever asks does it.
    pub(super) fn strikes(&mut self, kind: Kind, now: Instant, id: u8) -> Option<Strike> {
        let mut strike = None;
        for active in &mut self.active {
            let injection = &active.injection;
            let by_event = kind.is_event() && injection.chance.is_none();
            if injection.kind != kind
                || by_event
                || !injection.is_to(id)
                || !active.is_due(now)
                || active.done
            {
                continue;
            }
            if strikes(&mut active.random, injection.chance) {
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

    /// Whether something that lasts is the case now.
    pub(super) fn holds(&self, kind: Kind, now: Instant, id: u8) -> bool {
        let of = |active: &&Active| active.injection.kind == kind && active.injection.is_to(id);
        self.active.iter().filter(of).any(|active| active.is_due(now))
    }

    /// What is said of something that lasts and is the case now: its number, where one is said.
    pub(super) fn held_number(&self, kind: Kind, now: Instant, id: u8) -> Option<Option<u16>> {
        let of = |active: &&Active| active.injection.kind == kind && active.injection.is_to(id);
        self.active.iter().filter(of).find(|active| active.is_due(now)).map(|active| active.injection.is)
    }

    /// Whether something that lasts, and happens to a whole bus, is the case now: until when.
    pub(super) fn held_until(&self, kind: Kind, now: Instant) -> Option<Instant> {
        let held = self.active.iter().filter(|active| active.injection.kind == kind && active.is_due(now));
        held.map(|active| active.end().unwrap_or(Instant::from_nanos(u64::MAX))).max()
    }

    /// Counts something that began to last.
    pub(super) fn count(&mut self, kind: Kind) {
        self.injected.add(kind);
    }

    /// The faults that happen to a servo itself at a moment that has come, each once, and until
    /// when they last.
    pub(super) fn events(&mut self, now: Instant, id: u8) -> Vec<(Kind, Instant)> {
        let mut events = Vec::new();
        for active in &mut self.active {
            let injection = &active.injection;
            let once = injection.kind.is_event() && injection.chance.is_none();
            // It happened even if nobody looked while it lasted.
            let begun = now.since(active.since) >= injection.begins();
            if once && begun && injection.is_to(id) && active.struck.insert(id) {
                events.push((injection.kind, active.end().unwrap_or(now)));
                self.injected.add(injection.kind);
            }
        }
        events
    }
}

impl Active {
    fn end(&self) -> Option<Instant> {
        let lasts = self.injection.lasts()?;
        Some(self.since + self.injection.begins() + lasts)
    }
}

/// A fault that happens.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strike {
    pub(super) by: Option<Duration>,
    pub(super) is: Option<u16>,
    random: u64,
}

impl Strike {
    /// A number below `most`, which is above zero: each time another.
    pub(super) fn below(&mut self, most: usize) -> usize {
        let most = u64::try_from(most.max(1)).unwrap_or(u64::MAX);
        let number = self.random % most;
        self.random = self.random.rotate_right(17).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        usize::try_from(number).unwrap_or(0)
    }
}

fn strikes(random: &mut ChaCha8Rng, chance: Option<f64>) -> bool {
    let Some(chance) = chance else { return true };
    let draw = quantity::number::float(random.next_u64() >> 11) / quantity::number::float(1 << 53);
    draw < chance
}

/// FNV-1a: the same on every machine and in every version.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

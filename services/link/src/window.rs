//! Window of batches in flight.

use std::collections::VecDeque;

use clock::{Duration, Instant};
use invariant::require;
use quantity::number::{float_of_count, floor_usize};

/// Minimum window in bytes: a batch or two.
const MIN_WINDOW_BYTES: usize = 48 * 1024;
/// Maximum window in bytes.
const MAX_WINDOW_BYTES: usize = 8 * 1024 * 1024;
/// Acceptable queueing delay beyond the shortest round trip.
const QUEUEING: Duration = Duration::from_millis(60);
/// Number of recent round trips for the minimum, so that a longer path is accepted in the end.
const REMEMBERED: usize = 400;
/// Growth of the window as a divisor of the acknowledged bytes, and the factor by which it shrinks.
const GROWS_PART: usize = 4;
const STAYS: f64 = 0.7;
/// Loss time-out: this many times the longest recent round trip, and its minimum.
const LOSS_TIMEOUT_ROUND_TRIPS: u32 = 4;
const MIN_LOSS_TIMEOUT: Duration = Duration::from_millis(500);

/// Congestion window of batches in flight.
///
/// It follows the delay, as LEDBAT does (RFC 6817): it grows while queues are empty and shrinks when they
/// fill. So a slow network carries fewer frames instead of older ones.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    room: usize,
    under_way: VecDeque<UnderWay>,
    bytes: usize,
    round_trips: VecDeque<Duration>,
    shrunk_at: Option<Instant>,
}

#[derive(Clone, Copy, Debug)]
struct UnderWay {
    number: u64,
    bytes: usize,
    sent_at: Instant,
}

impl Window {
    pub(crate) fn new() -> Self {
        Self {
            room: 8 * MIN_WINDOW_BYTES,
            under_way: VecDeque::new(),
            bytes: 0,
            round_trips: VecDeque::new(),
            shrunk_at: None,
        }
    }

    /// Whether another batch may be sent.
    pub(crate) fn has_room(&self) -> bool {
        self.bytes < self.room
    }

    pub(crate) fn sent(&mut self, now: Instant, number: u64, bytes: usize) {
        self.bytes += bytes;
        self.under_way.push_back(UnderWay { number, bytes, sent_at: now });
    }

    /// Acknowledges a batch. Earlier ones have arrived too or are lost.
    pub(crate) fn came(&mut self, now: Instant, number: u64) {
        // An unused window gives no evidence for a larger one.
        let is_used = self.bytes.saturating_mul(3) >= self.room.saturating_mul(2);
        let (mut newest, mut came) = (None, 0);
        while let Some(&first) = self.under_way.front() {
            if first.number > number {
                break;
            }
            self.under_way.pop_front();
            let others = self.bytes.checked_sub(first.bytes);
            self.bytes = require!(others, "the sum contains each batch under way").unwrap_or(0);
            newest = Some(first);
            came += first.bytes;
        }
        let Some(newest) = newest else { return };
        let round_trip = now.since(newest.sent_at);
        self.round_trips.push_back(round_trip);
        if self.round_trips.len() > REMEMBERED {
            self.round_trips.pop_front();
        }
        if round_trip > self.shortest() + QUEUEING {
            // At most once in a round trip: batches in flight were sent before the window shrank.
            if self.shrunk_at.is_none_or(|at| newest.sent_at >= at) {
                self.shrunk_at = Some(now);
                self.room = floor_usize(float_of_count(self.room) * STAYS).max(MIN_WINDOW_BYTES);
            }
        } else if is_used {
            self.room = (self.room + came / GROWS_PART).min(MAX_WINDOW_BYTES);
        }
    }

    /// Resets the window after the loss time-out; returns whether anything was lost.
    pub(crate) fn give_up(&mut self, now: Instant) -> bool {
        let longest = self.round_trips.iter().max().copied().unwrap_or_default();
        let loss_timeout =
            (longest * LOSS_TIMEOUT_ROUND_TRIPS).clamp(MIN_LOSS_TIMEOUT, Duration::from_secs(5));
        let is_lost = self.under_way.back().is_some_and(|last| now.since(last.sent_at) > loss_timeout);
        if is_lost {
            self.clear();
        }
        is_lost
    }

    /// Resets the window: the peer is gone or replaced.
    pub(crate) fn clear(&mut self) {
        *self = Self { room: MIN_WINDOW_BYTES, ..Self::new() };
    }

    fn shortest(&self) -> Duration {
        self.round_trips.iter().min().copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUNDLE: usize = 32 * 1024;

    fn at(ms: u64) -> Instant {
        Instant::from_nanos(1_000_000_000 + ms * 1_000_000)
    }

    /// Simulates a network with a round trip of `way_ms` and a rate of `per_ms` bytes per millisecond. The
    /// sender has a batch every 5 ms. Returns how many arrived in the last second of ten, and their greatest
    /// age in milliseconds.
    fn play(way_ms: u64, per_ms: usize) -> (usize, u64) {
        let mut window = Window::new();
        let mut queue = VecDeque::<(u64, u64, usize)>::new();
        let mut answers = VecDeque::<(u64, u64, u64)>::new();
        let (mut number, mut came, mut age) = (0, 0, 0);
        for ms in 0..10_000 {
            if ms % 5 == 0 && window.has_room() {
                number += 1;
                window.sent(at(ms), number, BUNDLE);
                queue.push_back((number, ms, BUNDLE));
            }
            let mut carries = per_ms;
            while carries > 0 && !queue.is_empty() {
                let (number, sent, left) = queue.front_mut().unwrap();
                let now = carries.min(*left);
                (*left, carries) = (*left - now, carries - now);
                if *left == 0 {
                    answers.push_back((*number, *sent, ms + way_ms));
                    queue.pop_front();
                }
            }
            while answers.front().is_some_and(|(.., due)| *due <= ms) {
                let (number, sent, _) = answers.pop_front().unwrap();
                window.came(at(ms), number);
                if ms > 9_000 {
                    came += 1;
                    age = age.max(ms - sent);
                }
            }
        }
        (came, age)
    }

    #[test]
    fn a_fast_network_carries_every_bundle() {
        let (came, age) = play(1, 100_000);
        assert!(came >= 195, "{came} of 200");
        assert!(age <= 5, "{age} ms");
    }

    #[test]
    fn a_far_network_carries_every_bundle_in_the_end() {
        let (came, age) = play(400, 100_000);
        assert!(came >= 150, "{came} of 200");
        assert!(age <= 480, "{age} ms");
    }

    #[test]
    fn a_slow_network_carries_fewer_and_not_older_ones() {
        let (came, age) = play(10, 1_000);
        assert!((15..=32).contains(&came), "{came}; the network carries 30");
        assert!(age < 400, "{age} ms");
    }

    #[test]
    fn a_batch_without_acknowledgement_is_dropped_in_the_end() {
        let mut window = Window::new();
        let mut number = 0;
        while window.has_room() {
            number += 1;
            window.sent(at(0), number, BUNDLE);
        }
        assert!(!window.give_up(at(400)));
        assert!(window.give_up(at(600)));
        assert!(window.has_room());
        assert!(!window.give_up(at(9_000)));
    }
}

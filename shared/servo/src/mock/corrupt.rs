//! Injects faults into the replies of servos.

use std::ops::Range;

use clock::{Duration, Instant};

use crate::crc::crc;
use crate::frame::SUFFIX;

use super::injection::FaultKind;
use super::{Injector, Replies, Reply};

/// Default delay of a late reply.
const LATE: Duration = Duration::from_millis(10);
/// Maximum number of noise bytes.
const MAX_NOISE_BYTES: usize = 8;
/// Position of the length field.
const LENGTH: Range<usize> = 5..7;

/// Applies faults to the replies from `first` on. Delayed replies move to `late`, with the instant at which they
/// arrive.
pub(super) fn corrupt(
    injector: &mut Injector,
    now: Instant,
    answers: &mut Replies,
    first: usize,
    late: &mut Vec<(Instant, Reply)>,
) {
    if injector.active.is_empty() {
        return;
    }
    swap(injector, now, answers.list.get_mut(first..).unwrap_or_default());
    let mut place = first;
    while let Some(answer) = answers.list.get_mut(place) {
        let id = answer.id;
        corrupt_reply(injector, now, answer);
        if injector.triggers(FaultKind::Duplicate, now, id).is_some() {
            let again = answer.clone();
            answers.list.insert(place, again);
            place += 1;
        }
        if let Some(strike) = injector.triggers(FaultKind::Late, now, id) {
            late.push((now + strike.by.unwrap_or(LATE), answers.list.remove(place)));
        } else {
            place += 1;
        }
    }
}

fn swap(injector: &mut Injector, now: Instant, answers: &mut [Reply]) {
    let mut first = 0;
    while let Some([one, other]) = answers.get_mut(first..first + 2) {
        first += 1;
        if injector.triggers(FaultKind::Swap, now, one.id).is_some() {
            std::mem::swap(one, other);
            first += 1;
        }
    }
}

fn corrupt_reply(injector: &mut Injector, now: Instant, answer: &mut Reply) {
    let id = answer.id;
    if let Some(mut strike) = injector.triggers(FaultKind::Flip, now, id) {
        strike.flip(&mut answer.bytes);
    }
    if answer.has_header()
        && let Some(mut strike) = injector.triggers(FaultKind::Length, now, id)
    {
        let by = strike.below(255);
        falsify_length(&mut answer.bytes, strike.is, by);
    }
    if let Some(mut strike) = injector.triggers(FaultKind::Truncate, now, id) {
        answer.bytes.truncate(strike.below(answer.bytes.len()));
    }
    if let Some(mut strike) = injector.triggers(FaultKind::Noise, now, id) {
        for _ in 0..=strike.below(MAX_NOISE_BYTES) {
            answer.bytes.insert(0, strike.below(256).to_le_bytes()[0]);
        }
    }
}

/// Falsifies the length field, by the given value or offset. The CRC is recomputed, so the error looks like that of a
/// faulty servo, not of the wire.
fn falsify_length(bytes: &mut [u8], is: Option<u16>, by: usize) {
    if let Some([low, high]) = bytes.get_mut(LENGTH) {
        let other = [low.wrapping_add(1 + by.to_le_bytes()[0]), *high];
        [*low, *high] = is.map_or(other, u16::to_le_bytes);
    }
    let end = bytes.len().saturating_sub(SUFFIX);
    let sum = crc(bytes.get(..end).unwrap_or_default()).to_le_bytes();
    if let Some(place) = bytes.get_mut(end..) {
        place.copy_from_slice(&sum);
    }
}

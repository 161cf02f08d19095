//! Injects faults into the replies of servos.

use std::ops::Range;

use clock::{Duration, Instant};

use crate::crc::crc;
use crate::frame::SUFFIX;

use super::injection::Kind;
use super::{Answer, Answers, Injector};

/// Default delay of a late reply.
const LATE: Duration = Duration::from_millis(10);
/// Maximum number of noise bytes.
const NOISE_MOST: usize = 8;
/// Position of the length field.
const LENGTH: Range<usize> = 5..7;

/// Applies faults to the replies from `first` on. Delayed replies move to `late`, with the instant at which they
/// arrive.
pub(super) fn spoil(
    injector: &mut Injector,
    now: Instant,
    answers: &mut Answers,
    first: usize,
    late: &mut Vec<(Instant, Answer)>,
) {
    if injector.is_idle() {
        return;
    }
    swap(injector, now, answers.get_mut().get_mut(first..).unwrap_or_default());
    let mut place = first;
    while let Some(answer) = answers.get_mut().get_mut(place) {
        let id = answer.id;
        garble(injector, now, answer);
        if injector.strikes(Kind::Duplicate, now, id).is_some() {
            let again = answer.clone();
            answers.get_mut().insert(place, again);
            place += 1;
        }
        if let Some(strike) = injector.strikes(Kind::Late, now, id) {
            late.push((now + strike.by.unwrap_or(LATE), answers.get_mut().remove(place)));
        } else {
            place += 1;
        }
    }
}

fn swap(injector: &mut Injector, now: Instant, answers: &mut [Answer]) {
    let mut first = 0;
    while let Some([one, other]) = answers.get_mut(first..first + 2) {
        first += 1;
        if injector.strikes(Kind::Swap, now, one.id).is_some() {
            std::mem::swap(one, other);
            first += 1;
        }
    }
}

fn garble(injector: &mut Injector, now: Instant, answer: &mut Answer) {
    let id = answer.id;
    if let Some(mut strike) = injector.strikes(Kind::Flip, now, id) {
        let bit = strike.below(8 * answer.bytes.len());
        if let Some(byte) = answer.bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    }
    if answer.has_header()
        && let Some(mut strike) = injector.strikes(Kind::Length, now, id)
    {
        let by = strike.below(255);
        lie(&mut answer.bytes, strike.is, by);
    }
    if let Some(mut strike) = injector.strikes(Kind::Truncate, now, id) {
        answer.bytes.truncate(strike.below(answer.bytes.len()));
    }
    if let Some(mut strike) = injector.strikes(Kind::Noise, now, id) {
        for _ in 0..=strike.below(NOISE_MOST) {
            answer.bytes.insert(0, strike.below(256).to_le_bytes()[0]);
        }
    }
}

/// Falsifies the length field, by the given value or offset. The CRC is recomputed, so the error looks like that of a
/// faulty servo, not of the wire.
fn lie(bytes: &mut [u8], is: Option<u16>, by: usize) {
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

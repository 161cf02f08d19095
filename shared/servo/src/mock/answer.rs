use clock::{Duration, Instant};

use crate::crc::crc;
use crate::frame::{HEADER, SUFFIX};

use super::{Injector, Kind};

/// How late an answer is where nothing is said.
const LATE: Duration = Duration::from_millis(10);
/// Bytes of noise at most.
const NOISE_MOST: usize = 8;
/// Where the low byte of the length stands.
const LENGTH_LOW: usize = 5;

/// What one servo says, or the host's echo.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Who says it; 254 where it is an echo.
    pub id: u8,
    /// How long it waits once the line is free.
    pub wait: Duration,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl Answer {
    /// What is on the wire when another servo says something at once, `shift` bytes later: a low
    /// level wins.
    pub(super) fn collide(&mut self, other: &Self, shift: usize) {
        self.bytes.resize(self.bytes.len().max(other.bytes.len() + shift), 0xFF);
        for (byte, other) in self.bytes.iter_mut().skip(shift).zip(&other.bytes) {
            *byte &= other;
        }
    }

    /// Whether a frame begins here: a later part of a fast reply has no header.
    fn has_header(&self) -> bool {
        self.bytes.starts_with(&HEADER)
    }
}

/// Puts faults into what servos say; answers that come late go to `late`, with the instant before
/// which they do not come.
pub(super) fn spoil(
    injector: &mut Injector,
    now: Instant,
    answers: &mut Vec<Answer>,
    late: &mut Vec<(Instant, Answer)>,
) {
    swap(injector, now, answers);
    let mut spoiled = Vec::with_capacity(answers.len());
    for mut answer in answers.drain(..) {
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
            lie(&mut answer.bytes, strike.below(255));
        }
        if let Some(mut strike) = injector.strikes(Kind::Truncate, now, id) {
            answer.bytes.truncate(strike.below(answer.bytes.len()));
        }
        if let Some(mut strike) = injector.strikes(Kind::Noise, now, id) {
            let noise = (0..=strike.below(NOISE_MOST)).map(|_| strike.below(256).to_le_bytes()[0]);
            answer.bytes = noise.collect::<Vec<_>>().into_iter().chain(answer.bytes).collect();
        }
        if injector.strikes(Kind::Duplicate, now, id).is_some() {
            spoiled.push(answer.clone());
        }
        match injector.strikes(Kind::Late, now, id) {
            Some(strike) => late.push((now + strike.by.unwrap_or(LATE), answer)),
            None => spoiled.push(answer),
        }
    }
    *answers = spoiled;
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

/// Makes the length say something else; the check sum is right for it, as from a servo that is
/// confused and not from a wire that is.
fn lie(bytes: &mut [u8], by: usize) {
    let other = 1 + by.to_le_bytes()[0];
    if let Some(length) = bytes.get_mut(LENGTH_LOW) {
        *length = length.wrapping_add(other);
    }
    let end = bytes.len().saturating_sub(SUFFIX);
    let sum = crc(bytes.get(..end).unwrap_or_default()).to_le_bytes();
    if let Some(place) = bytes.get_mut(end..) {
        place.copy_from_slice(&sum);
    }
}

//! Faults put into what servos hear.

use std::borrow::Cow;

use clock::Instant;

use crate::frame::HEADER;

use super::Injector;
use super::injection::Kind;
use super::line::HOST;

/// The instructions in what the host says. Where one begins is a header, and nowhere within it; what
/// stands before the first is the rest of one that came in pieces.
pub(super) fn instructions(mut bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let next = bytes.windows(HEADER.len()).skip(1).position(|window| window == HEADER);
        let (one, others) = bytes.split_at_checked(next.map_or(bytes.len(), |place| place + 1))?;
        bytes = others;
        (!one.is_empty()).then_some(one)
    })
}

/// What arrives at the servos of an instruction, if it does.
pub(super) fn arriving<'a>(injector: &mut Injector, now: Instant, said: &'a [u8]) -> Option<Cow<'a, [u8]>> {
    if !said.starts_with(&HEADER) {
        return Some(said.into());
    }
    if injector.strikes(Kind::DropInstruction, now, HOST).is_some() {
        return None;
    }
    let Some(mut strike) = injector.strikes(Kind::FlipInstruction, now, HOST) else {
        return Some(said.into());
    };
    let mut heard = said.to_vec();
    let bit = strike.below(8 * heard.len());
    if let Some(byte) = heard.get_mut(bit / 8) {
        *byte ^= 1 << (bit % 8);
    }
    Some(heard.into())
}

//! Injects faults into the instructions that servos receive.

use std::borrow::Cow;

use clock::Instant;

use crate::frame::HEADER;

use super::Injector;
use super::injection::FaultKind;
use super::injector::HOST;

/// Splits the host's bytes into instructions. Each header starts an instruction; bytes before the first header belong
/// to an instruction that arrived in pieces.
pub(super) fn instructions(mut bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let next = bytes.windows(HEADER.len()).skip(1).position(|window| window == HEADER);
        let (one, others) = bytes.split_at_checked(next.map_or(bytes.len(), |place| place + 1))?;
        bytes = others;
        (!one.is_empty()).then_some(one)
    })
}

/// The bytes of an instruction as they arrive at the servos; `None` if the instruction is lost.
pub(super) fn deliver<'a>(injector: &mut Injector, now: Instant, said: &'a [u8]) -> Option<Cow<'a, [u8]>> {
    if !said.starts_with(&HEADER) {
        return Some(said.into());
    }
    if injector.triggers(FaultKind::DropInstruction, now, HOST).is_some() {
        return None;
    }
    let Some(mut strike) = injector.triggers(FaultKind::FlipInstruction, now, HOST) else {
        return Some(said.into());
    };
    let mut heard = said.to_vec();
    strike.flip(&mut heard);
    Some(heard.into())
}

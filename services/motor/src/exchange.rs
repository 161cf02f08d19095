//! Carries out one request on one line, part by part. Each part is answered before the next is sent.

use arrayvec::ArrayVec;
use clock::{Duration, Instant};
use invariant::{invariant, require};
use serial::LineLostError;
use servo::table::TORQUE_ENABLE;
use servo::{Address, FastReply, Id, Instruction, Parser, Reading, Status};

use crate::job::CONDITION;
use crate::reply_timeout::ReplyTimeout;
use crate::request::{Answer, MAX_SERVOS, Part, PartKind};
use crate::{Replies, Request};

/// Consecutive exchanges without any answer, after which no read is repeated within an exchange.
const MAX_SILENT_EXCHANGES: u32 = 3;
/// How often torque off is sent at once.
const CUTS: u32 = 3;
/// Servos of a chain lost by one wrong check sum: the servo with the sum, and the next, which is verified by it.
const SUM_COSTS: usize = 2;
/// Longest instruction to one servo, or to all servos of a bus, in bytes.
const INSTRUCTION: usize = 2 * MAX_SERVOS + 32;

/// Byte transport of a servo bus.
pub trait Port {
    /// Discards received bytes, and sends. Waits for space in the send buffer for at most `within`.
    ///
    /// # Errors
    ///
    /// The line is lost.
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<Sent, LineLostError>;

    /// Waits for bytes for at most `within`, and not beyond `until`.
    ///
    /// # Errors
    ///
    /// The line is lost.
    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError>;

    /// Closes a line that was lost. With bytes that the adapter does not accept this can take half a minute. So the
    /// replies must be handed over first.
    fn close_lost(&mut self) {}
}

/// Result of sending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// When the first byte went out, or shortly before.
    pub at: Instant,
    /// Received bytes that were discarded because they came too late.
    pub late: usize,
}

/// Result of receiving.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// Bytes received; 0 after a timeout.
    pub count: usize,
    /// When the bytes were available.
    pub at: Instant,
}

/// Master of one bus: carries out requests.
#[derive(Clone, Debug)]
pub struct Master {
    parser: Parser,
    chain: FastReply,
    baud: u32,
    reply_timeout: ReplyTimeout,
    /// Consecutive exchanges without any answer.
    silent_exchanges: u32,
}

/// Answers to one part of a request.
struct PartAnswers {
    /// Which servos answered, by their position in the part.
    answered: [bool; MAX_SERVOS],
    /// Whether a reply timeout occurred. Otherwise every expected answer arrived, valid or corrupt.
    is_silent: bool,
}

impl PartAnswers {
    fn missing<'a>(&'a self, part: &'a Part) -> impl Iterator<Item = u8> + 'a {
        part.ids().iter().zip(&self.answered).filter(|(_, heard)| !**heard).map(|(id, _)| *id)
    }
}

impl Master {
    /// Creates the master of a line of `baud` bits per second. A servo may be silent for `reply_timeout.0` beyond the time
    /// on the wire, and for up to `reply_timeout.1` if answers come that late.
    #[must_use]
    pub fn new(baud: u32, reply_timeout: (Duration, Duration)) -> Self {
        Self {
            parser: Parser::new(),
            chain: FastReply::new(),
            baud,
            reply_timeout: ReplyTimeout::new(reply_timeout.0, reply_timeout.1),
            silent_exchanges: 0,
        }
    }

    /// Carries out a request: sends each part and collects its answers.
    ///
    /// On a reply timeout the remaining servos of the chain are read again without the silent one. The servos behind
    /// an answer that was cut short are read again too. If no timeout occurred, the servos with corrupt answers are
    /// read again. The condition of a servo that did not answer is not read. So one bad servo costs at most one reply
    /// timeout per exchange. Servos that report an alert are asked at once for their condition.
    pub fn exchange(&mut self, port: &mut impl Port, request: &Request, replies: &mut Replies) {
        replies.clear();
        // A line lost in the middle of an answer leaves a fragment in the parser.
        self.parser.clear();
        if let Err(lost) = self.converse(port, request, replies) {
            replies.lost = Some(lost);
        }
        self.silent_exchanges =
            if replies.answers.is_empty() { self.silent_exchanges.saturating_add(1) } else { 0 };
        self.reply_timeout.record(replies.late > 0, replies.slow);
    }

    /// Switches torque off on every servo of the bus, in any state.
    pub fn cut(&mut self, port: &mut impl Port) {
        let off = Instruction::Write { address: TORQUE_ENABLE.address, data: &[0] };
        let mut bytes = [0; INSTRUCTION];
        let length = require!(off.encode(Address::All, &mut bytes).ok(), "torque off fits").unwrap_or(0);
        let bytes = require!(bytes.get(..length), "{length} bytes were written").unwrap_or_default();
        for _ in 0..CUTS {
            // The next send opens a lost line again.
            let _sent = port.send(bytes, self.reply_timeout.now);
        }
    }

    fn converse(
        &mut self,
        port: &mut impl Port,
        request: &Request,
        replies: &mut Replies,
    ) -> Result<(), LineLostError> {
        let mut again = None;
        for (part, bytes) in request.parts() {
            if part.kind == PartKind::ReadCondition && !part.ids().iter().any(|id| replies.has_from(*id)) {
                // Its reply timeout has already occurred.
                continue;
            }
            let heard = self.ask(port, part, bytes, replies)?;
            if matches!(part.kind, PartKind::FastRead | PartKind::PlainRead)
                && again.is_none()
                && self.silent_exchanges < MAX_SILENT_EXCHANGES
            {
                // At most one timeout per exchange: the first missing servo is the one that timed out, so it is left
                // out. A servo whose answer was too short to decode the ones behind it may be silent the next time,
                // and is left out too.
                let is_cut = part.kind == PartKind::FastRead && heard.missing(part).count() > SUM_COSTS;
                let but = heard.is_silent || is_cut;
                again = Self::ask_again(part, &heard, usize::from(but));
                if let Some((again, bytes)) = &again {
                    let first_at = replies.part(part.kind).asked_at;
                    let heard = self.ask(port, again, bytes, replies);
                    // A late answer to the first read looks like one to the second, which has the same length. Only
                    // "sampled after the first read" is certain.
                    replies.record(PartKind::Reread, |part| part.asked_at = first_at);
                    heard?;
                }
            }
        }
        if let Some((part, bytes)) = alarm(replies) {
            self.ask(port, &part, &bytes, replies)?;
        }
        Ok(())
    }

    /// Read of the servos that did not answer, without the first `but` of them.
    fn ask_again(part: &Part, heard: &PartAnswers, but: usize) -> Option<Question> {
        let ids: ArrayVec<u8, MAX_SERVOS> = heard.missing(part).skip(but).take(MAX_SERVOS).collect();
        let length = require!(u16::try_from(part.data).ok(), "a read of {} bytes", part.data)?;
        question(PartKind::Reread, Reading::ITEM.address, length, &ids)
    }

    /// Sends a part and collects its answers.
    fn ask(
        &mut self,
        port: &mut impl Port,
        part: &Part,
        bytes: &[u8],
        replies: &mut Replies,
    ) -> Result<PartAnswers, LineLostError> {
        if part.kind == PartKind::FastRead {
            let length = require!(u16::try_from(part.data).ok(), "a read of {} bytes", part.data);
            let servos = part.ids().iter().filter_map(|id| Some((Id::new(*id)?, length?)));
            let fits = self.chain.expect(servos).is_ok();
            invariant!(fits, "the answers to a request for {} servos fit into one packet", part.ids().len());
        }
        let broken = broken(&self.parser);
        let before = self.parser.losses();
        // Once every servo has answered, only silence on the line is awaited.
        let quiet = part.time_to_answer(self.baud);
        let turn = quiet + self.reply_timeout.now;
        let rest = quiet + self.reply_timeout.min_timeout;
        let mut within = part.time_to_send(self.baud) + turn;
        let Sent { at, late } = port.send(bytes, within)?;
        replies.record(part.kind, |part| part.asked_at = at);
        replies.late += late;
        let mut heard = PartAnswers { answered: [false; MAX_SERVOS], is_silent: false };
        let mut missing = part.ids().len();
        // Each servo has one reply timeout: noise that trickles in must not hold the bus.
        let turns = u32::try_from(missing).unwrap_or(u32::MAX).saturating_add(1);
        let mut quiet_since = at + part.time_to_send(self.baud);
        let until = quiet_since + turns * turn;
        // Bounds the bytes of a babbling line: all answers twice, and an echo, are enough.
        let mut max_bytes = 2 * (part.sent + missing * (part.data + 16)) + 64;
        // Once as many bytes as expected have arrived, part of them were noise. The rest, delivered in pieces by the
        // adapter, follows soon.
        let mut awaited = part.bytes_of_answers();
        let mut has_all = false;
        let mut buffer = [0; 512];
        while missing > 0 && max_bytes > 0 {
            let Received { count, at: now } = port.receive(&mut buffer, within, until)?;
            if count == 0 {
                heard.is_silent = !has_all;
                break;
            }
            replies.slow = replies.slow.max(now.since(quiet_since).saturating_sub(quiet));
            quiet_since = now;
            max_bytes = max_bytes.saturating_sub(count);
            awaited = awaited.saturating_sub(count);
            replies.record(part.kind, |part| part.bytes += count);
            let received = require!(buffer.get(..count), "{count} bytes were received into the buffer");
            self.parser.push(received.unwrap_or_default());
            each_status(&mut self.parser, &mut self.chain, part.kind, |status| {
                let mut awaited = part.ids().iter().zip(&mut heard.answered);
                if let Some((_, heard)) = awaited.find(|(id, heard)| **id == status.id.get() && !**heard) {
                    missing -= 1;
                    *heard = true;
                }
                replies.add(part.kind, status);
            });
            has_all = self.all_spoke(part, missing, awaited, broken);
            within = match awaited {
                _ if has_all => quiet,
                0 => turn.min(rest),
                _ => turn,
            };
        }
        // The remaining bytes belong to no answer.
        self.parser.clear();
        let losses = self.parser.losses();
        let strays = losses.stray.saturating_sub(before.stray);
        replies.late += usize::try_from(strays).unwrap_or(usize::MAX);
        if part.kind == PartKind::Reread {
            // Bytes beyond the expected answers and an echo are answers to an earlier request.
            replies.late +=
                replies.part(PartKind::Reread).bytes.saturating_sub(part.bytes_of_answers() + part.sent);
        }
        replies.noisy |= losses.noise > before.noise || losses.overrun > before.overrun;
        replies.record(part.kind, |part| part.corrupt += broken_since(&self.parser, broken));
        Ok(heard)
    }

    /// Whether every servo has answered, validly or not. `missing` answers are still expected, `awaited` bytes have
    /// not arrived, and `broken_before` answers were corrupt before this part.
    fn all_spoke(&self, part: &Part, missing: usize, awaited: usize, broken_before: u64) -> bool {
        let broken = broken_since(&self.parser, broken_before);
        // If the last of several answers has begun, an earlier one was cut short. A single answer may still be
        // arriving.
        let is_cut = part.ids().len() > 1 && awaited < part.bytes_of_answer();
        if part.kind == PartKind::FastRead {
            return self.chain.is_over() || (is_cut && broken > 0);
        }
        // Noise may look like corrupt answers, so the number of bytes must match too.
        (is_cut || awaited == 0) && usize::try_from(broken).is_ok_and(|broken| broken >= missing)
    }
}

/// Passes each status of a part to `take`. Instructions echoed by the adapter are skipped.
fn each_status(
    parser: &mut Parser,
    chain: &mut FastReply,
    kind: PartKind,
    mut take: impl FnMut(&Status<'_>),
) {
    if kind == PartKind::FastRead {
        while let Some(status) = parser.next_part(chain) {
            take(&status);
        }
        return;
    }
    while let Some(frame) = parser.next_frame() {
        if let Some(status) = Status::parse(&frame) {
            take(&status);
        }
    }
}

/// Number of corrupt frames so far.
fn broken(parser: &Parser) -> u64 {
    let losses = parser.losses();
    losses.corrupt + losses.cut + losses.malformed
}

fn broken_since(parser: &Parser, before: u64) -> u32 {
    u32::try_from(broken(parser).saturating_sub(before)).unwrap_or(u32::MAX)
}

/// Read of the condition of all servos that reported an alert: an undervoltage affects a whole bus.
fn alarm(replies: &Replies) -> Option<Question> {
    let mut ids = ArrayVec::<u8, MAX_SERVOS>::new();
    for status in replies.answers.iter().map(Answer::status).filter(|status| status.alert) {
        let id = status.id.get();
        if !ids.contains(&id) && !ids.is_full() {
            ids.push(id);
        }
    }
    question(PartKind::AlertCondition, CONDITION.address, CONDITION.length, &ids)
}

/// A read that belongs to no request, and its bytes.
type Question = (Part, ArrayVec<u8, INSTRUCTION>);

/// A sync read of some servos; `None` if there are none.
fn question(kind: PartKind, address: u16, length: u16, ids: &[u8]) -> Option<Question> {
    let mut bytes = ArrayVec::from([0; INSTRUCTION]);
    if ids.is_empty() {
        return None;
    }
    let encoded = Instruction::SyncRead { address, length, ids }.encode(Address::All, &mut bytes);
    let sent = require!(encoded.ok(), "a read from {} servos fits", ids.len())?;
    bytes.truncate(sent);
    let servos = ids.iter().filter_map(|id| Id::new(*id));
    Some((Part::new(kind, sent, usize::from(length), servos), bytes))
}

#[cfg(test)]
mod tests;

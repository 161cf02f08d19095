//! One request over one line: part by part, each answered before the next.

use clock::{Duration, Instant};
use serial::Lost;
use servo::table::TORQUE_ENABLE;
use servo::{Address, FastReply, Id, Instruction, Parser, Reading, Status};

use crate::job::CONDITION;
use crate::patience::Patience;
use crate::request::{Part, SERVOS_MOST, Topic};
use crate::{Replies, Request};

/// Exchanges in a row to which nobody answers, after which nobody is asked again within one.
const MUTE_MOST: u32 = 3;
/// How often torque off is said at once.
const CUTS: u32 = 3;
/// Servos of a chain that a wrong sum costs: whose it is, and who is verified from it.
const SUM_COSTS: usize = 2;
/// Bytes of an instruction to one servo, or to all on a bus.
const INSTRUCTION: usize = 2 * SERVOS_MOST + 32;

/// A servo bus, as bytes.
pub trait Port {
    /// Throws away what waits to be read, and sends, waiting for room for at most `within`.
    ///
    /// # Errors
    ///
    /// The line is gone.
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<Sent, Lost>;

    /// Waits for bytes for at most `within`, and not beyond `until`.
    ///
    /// # Errors
    ///
    /// The line is gone.
    fn receive(&mut self, into: &mut [u8], within: Duration, until: Instant) -> Result<Received, Lost>;

    /// Closes what was lost. With bytes that an adapter does not take this may last for half a minute: whoever
    /// waits for replies shall have them before.
    fn close_lost(&mut self) {}
}

/// What sending came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// When the first byte went out, or shortly before.
    pub at: Instant,
    /// Bytes that waited to be read, and were thrown away: they came after their time.
    pub late: usize,
}

/// What receiving came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// Bytes that came: none where the time was over.
    pub count: usize,
    /// When they were there.
    pub at: Instant,
}

/// The master of one bus: carries out requests.
#[derive(Clone, Debug)]
pub struct Master {
    parser: Parser,
    chain: FastReply,
    baud: u32,
    patience: Patience,
    /// Exchanges in a row to which nobody answered.
    mute: u32,
}

/// What came of asking a part.
struct Heard {
    /// Who answered, by their place in it.
    who: [bool; SERVOS_MOST],
    /// Whether somebody's turn ran out: else all that was awaited came, well or broken.
    is_silent: bool,
}

impl Heard {
    fn missing(&self, part: &Part) -> usize {
        part.ids().iter().zip(&self.who).filter(|(_, heard)| !**heard).count()
    }
}

impl Master {
    /// The master of a line of `baud` bits per second, on which a servo may be silent for
    /// `patience.0` beyond the time on the wire, and for up to `patience.1` where answers come
    /// that late.
    #[must_use]
    pub fn new(baud: u32, patience: (Duration, Duration)) -> Self {
        Self {
            parser: Parser::new(),
            chain: FastReply::new(),
            baud,
            patience: Patience::new(patience.0, patience.1),
            mute: 0,
        }
    }

    /// Carries out a request: sends each part and collects its answers until all are there, or
    /// until the turn of a servo is over that does not answer. Then those behind it, who may have
    /// waited for it, are asked again without it; so are those behind one whose answer was cut short.
    /// Where nobody's turn ran out, those whose answers arrived broken are asked again, and who was not
    /// heard is not asked how it is. So one bad servo costs one turn at most. Servos that report an alert are
    /// asked at once how they are.
    pub fn exchange(&mut self, port: &mut impl Port, request: &Request, replies: &mut Replies) {
        replies.clear();
        // A line that was lost in the middle of an answer leaves a piece of it.
        self.parser.clear();
        if let Err(lost) = self.converse(port, request, replies) {
            replies.lose(lost);
        }
        self.mute = if replies.is_empty() { self.mute.saturating_add(1) } else { 0 };
        self.patience.note(replies.late > 0, replies.slow);
    }

    /// Switches every torque on the bus off, whatever else is the matter.
    pub fn cut(&mut self, port: &mut impl Port) {
        let off = Instruction::Write { address: TORQUE_ENABLE.address, data: &[0] };
        let mut bytes = [0; INSTRUCTION];
        let length = off.encode(Address::All, &mut bytes).unwrap_or(0);
        for _ in 0..CUTS {
            // A line that is gone is opened again by the next attempt.
            let _sent = port.send(bytes.get(..length).unwrap_or_default(), self.patience.get());
        }
    }

    fn converse(
        &mut self,
        port: &mut impl Port,
        request: &Request,
        replies: &mut Replies,
    ) -> Result<(), Lost> {
        let mut again = None;
        for (part, bytes) in request.parts() {
            if part.topic == Topic::Look && !part.ids().iter().any(|id| replies.has_from(*id)) {
                // Its turn ran out already.
                continue;
            }
            let heard = self.ask(port, part, bytes, replies)?;
            if matches!(part.topic, Topic::Chain | Topic::Each) && again.is_none() && self.mute < MUTE_MOST {
                // Where a turn ran out, one more shall not: the first who is missing is whom all waited for.
                // And who said too little for those behind him to be understood may say nothing next time.
                let is_cut = part.topic == Topic::Chain && heard.missing(part) > SUM_COSTS;
                let but = heard.is_silent || is_cut;
                again = self.ask_again(part, &heard, usize::from(but));
                if let Some((again, bytes)) = &again {
                    let first_at = replies.asked_at(part.topic);
                    let heard = self.ask(port, again, bytes.get(..again.sent).unwrap_or_default(), replies);
                    // A late answer to the first question looks like one to the second, which is of the
                    // same length: of neither is known more than that it was sampled after the first.
                    replies.asked(Topic::Again, first_at);
                    heard?;
                }
            }
        }
        if let Some((part, bytes)) = alarm(replies) {
            self.ask(port, &part, bytes.get(..part.sent).unwrap_or_default(), replies)?;
        }
        Ok(())
    }

    /// The question to those who were not heard, but for the first so many of them.
    fn ask_again(&self, part: &Part, heard: &Heard, but: usize) -> Option<(Part, [u8; INSTRUCTION])> {
        let missing = part.ids().iter().zip(&heard.who).filter(|(_, heard)| !**heard).map(|(id, _)| *id);
        let (mut ids, mut count) = ([0; SERVOS_MOST], 0);
        for (place, id) in ids.iter_mut().zip(missing.skip(but)) {
            *place = id;
            count += 1;
        }
        let length = u16::try_from(part.data).ok()?;
        question(Topic::Again, Reading::ITEM.address, length, ids.get(..count)?)
    }

    /// Sends a part and collects its answers.
    fn ask(
        &mut self,
        port: &mut impl Port,
        part: &Part,
        bytes: &[u8],
        replies: &mut Replies,
    ) -> Result<Heard, Lost> {
        let length = u16::try_from(part.data).unwrap_or(u16::MAX);
        if part.topic == Topic::Chain {
            let who = part.ids().iter().filter_map(|id| Id::new(*id));
            // As many as fit into a request fit into an answer.
            let _fits = self.chain.expect(who.map(|id| (id, length)));
        }
        let broken = broken(&self.parser);
        let before = self.parser.losses();
        // Where everybody has said something, it is only to be quiet before anything else is asked.
        let quiet = part.time_to_answer(self.baud);
        let turn = quiet + self.patience.get();
        let rest = quiet + self.patience.least();
        let mut within = part.time_to_send(self.baud) + turn;
        let Sent { at, late } = port.send(bytes, within)?;
        replies.asked(part.topic, at);
        replies.late += late;
        let mut heard = Heard { who: [false; SERVOS_MOST], is_silent: false };
        let mut missing = part.ids().len();
        // Each has its turn once: bytes of noise that trickle in, each a sign of life, must not hold the bus.
        let turns = u32::try_from(missing).unwrap_or(u32::MAX).saturating_add(1);
        let mut quiet_since = at + part.time_to_send(self.baud);
        let until = quiet_since + turns * turn;
        // A line that babbles must not hold the bus: all answers twice, and an echo, are enough.
        let mut most = 2 * (part.sent + missing * (part.data + 16)) + 64;
        // Once as many bytes came as were awaited, somebody's were noise: what is on its way still, in an
        // adapter that hands over piece by piece, comes soon.
        let mut awaited = part.bytes_of_answers();
        let mut has_all = false;
        let mut buffer = [0; 512];
        while missing > 0 && most > 0 {
            let Received { count, at: now } = port.receive(&mut buffer, within, until)?;
            if count == 0 {
                heard.is_silent = !has_all;
                break;
            }
            replies.slow = replies.slow.max(now.since(quiet_since).saturating_sub(quiet));
            quiet_since = now;
            most = most.saturating_sub(count);
            awaited = awaited.saturating_sub(count);
            replies.hear(part.topic, count);
            self.parser.push(buffer.get(..count).unwrap_or_default());
            each_status(&mut self.parser, &mut self.chain, part.topic, |status| {
                let mut awaited = part.ids().iter().zip(&mut heard.who);
                if let Some((_, heard)) = awaited.find(|(id, heard)| **id == status.id.get() && !**heard) {
                    missing -= 1;
                    *heard = true;
                }
                replies.add(part.topic, status);
            });
            has_all = self.all_spoke(part, missing, awaited, broken);
            within = match awaited {
                _ if has_all => quiet,
                0 => turn.min(rest),
                _ => turn,
            };
        }
        // What is left belongs to nobody.
        self.parser.clear();
        let losses = self.parser.losses();
        let strays = losses.stray.saturating_sub(before.stray);
        replies.late += usize::try_from(strays).unwrap_or(usize::MAX);
        if part.topic == Topic::Again {
            // More than what was asked for now, and an echo: answers to what was asked before.
            replies.late += replies.heard(Topic::Again).saturating_sub(part.bytes_of_answers() + part.sent);
        }
        replies.noisy |= losses.noise > before.noise;
        replies.spoil(part.topic, broken_since(&self.parser, broken));
        Ok(heard)
    }

    /// Whether everybody has said something, well or broken, where so many have not been heard, so many
    /// bytes are still awaited, and so many answers were broken before.
    fn all_spoke(&self, part: &Part, missing: usize, awaited: usize, broken_before: u64) -> bool {
        let broken = broken_since(&self.parser, broken_before);
        // Of several whose last answer has begun one was cut short; of one the rest may be on its way.
        let is_cut = part.ids().len() > 1 && awaited < part.bytes_of_answer();
        if part.topic == Topic::Chain {
            return self.chain.is_over() || (is_cut && broken > 0);
        }
        // Noise may look like broken answers: so many bytes must be there as well.
        (is_cut || awaited == 0) && usize::try_from(broken).is_ok_and(|broken| broken >= missing)
    }
}

/// Hands over every status about a topic that is there. An adapter that echoes gives
/// instructions back; those are none.
fn each_status(parser: &mut Parser, chain: &mut FastReply, topic: Topic, mut take: impl FnMut(&Status<'_>)) {
    if topic == Topic::Chain {
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

/// Frames that arrived broken so far.
fn broken(parser: &Parser) -> u64 {
    let losses = parser.losses();
    losses.corrupt + losses.cut + losses.malformed
}

fn broken_since(parser: &Parser, before: u64) -> u32 {
    u32::try_from(broken(parser).saturating_sub(before)).unwrap_or(u32::MAX)
}

/// The question to all servos that reported an alert: an undervoltage befalls a bus, not a servo.
fn alarm(replies: &Replies) -> Option<(Part, [u8; INSTRUCTION])> {
    let (mut ids, mut count) = ([0; SERVOS_MOST], 0);
    for status in replies.all().iter().map(crate::request::Answer::status).filter(|status| status.alert) {
        let id = status.id.get();
        let is_known = ids.iter().take(count).any(|known| *known == id);
        if !is_known && let Some(place) = ids.get_mut(count) {
            *place = id;
            count += 1;
        }
    }
    question(Topic::Alarm, CONDITION.address, CONDITION.length, ids.get(..count)?)
}

/// A question to some servos, of which each answers for itself (sync read); `None` to nobody.
fn question(topic: Topic, address: u16, length: u16, ids: &[u8]) -> Option<(Part, [u8; INSTRUCTION])> {
    let mut bytes = [0; INSTRUCTION];
    let sent = Instruction::SyncRead { address, length, ids }.encode(Address::All, &mut bytes).ok()?;
    let who = ids.iter().filter_map(|id| Id::new(*id));
    (!ids.is_empty()).then(|| (Part::new(topic, sent, usize::from(length), who), bytes))
}

#[cfg(test)]
mod tests;

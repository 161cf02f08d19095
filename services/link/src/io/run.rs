use std::collections::{BTreeMap, VecDeque};

use clock::{Duration, Instant};
use config::Robot;
use config::leo::{Link, Side};
use message::{Header, LinkHealth, Process};
use process::{Failure, Launch, Member, Progress};

use crate::Stream;
use crate::agreement::{Agreement, Disagreement};
use crate::instants::Instants;
use crate::io::net::{KeyError, Keys, Message, Net, Sort};
use crate::io::ports::{Springs, Taps};
use crate::talk::Talk;
use crate::wire::{Bundle, Frame, Nonsense, Pulse};

/// Write period of the health board.
const TELL_EVERY: Duration = Duration::from_millis(100);
/// Minimum interval between two frames of a reliable topic after a reconnect. Local readers poll at 20 Hz or
/// faster and have queues of a few frames.
const SAY_EVERY: Duration = Duration::from_millis(20);
/// Maximum number of frames that wait for it.
const UNSAID_MOST: usize = 8192;

/// Checks the keys of the link's configuration.
///
/// # Errors
///
/// [`KeyError`] if a file cannot be read or used.
pub fn check(link: &Link) -> Result<(), KeyError> {
    if link.side == Side::Off { Ok(()) } else { Keys::read(link).map(drop) }
}

/// Runs the link until the process is told to stop.
///
/// # Errors
///
/// The domain cannot be joined, the keys cannot be used, or the middleware failed. A failed network
/// connection is no error: it is retried.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), Failure> {
    let (leo, link) = (&robot.leo, &robot.leo.link);
    let mut member = Member::join(launch, Process::Link, &leo.buffers, &link.realtime)?;
    let perspectives = leo.belief.perspectives(launch.partners.unwrap_or(leo.belief.partners));
    let (here, there): (Vec<Stream>, Vec<Stream>) =
        Stream::all(perspectives).partition(|stream| link.runs_here(stream.writer()));
    let is_sent =
        |stream: &Stream| link.topics.is_empty() || link.topics.iter().any(|topic| *topic == stream.name().0);
    let here: Vec<Stream> = here.into_iter().filter(is_sent).collect();
    let mut carrier = Carrier {
        springs: Springs::open(&member, &there, robot)?,
        instants: there.iter().map(|&stream| (stream, Instants::of(stream))).collect(),
        late_after: link.late_after_ms.duration(),
        ..Carrier::new(Agreement::of(robot, perspectives), &here, clock::now())
    };
    let mut taps = Taps::open(&member, &here)?;
    let net = Net::start(link, carrier.agreement).map_err(Failure::own)?;
    let mut board = member.link_board()?;
    let mut tell_at = clock::now();
    member.begin(Some(link.link_rate_hz.period()))?;
    while let Some(now) = member.next_cycle()? {
        if net.is_over() {
            return Err(Failure::own("what carries the link's messages has ended"));
        }
        taps.take(&mut |stream, place, bytes| carrier.talk.push(now, stream, place, bytes))?;
        carrier.talk.joined += u64::from(carrier.springs.has_newcomers());
        carrier.hear(&net)?;
        if carrier.talk.take_newcomers() {
            // The writer sees this reader as the new subscriber and replays to it.
            let took = &mut |stream, place, bytes| carrier.talk.push(now, stream, place, bytes);
            if let Err(error) = taps.begin_anew(&member, took) {
                tracing::warn!(%error, "who begins to listen on the other machine is not told what was learned before");
            }
        }
        carrier.listen(now);
        carrier.speak(&net, clock::now());
        if now >= tell_at {
            tell_at = now + TELL_EVERY;
            board.write(&carrier.fares(now));
        }
        let health = member.health();
        health.drops = taps.drops();
        health.undelivered = carrier.springs.undelivered();
        health.refused = carrier.refused();
        member.end_cycle(Progress::More)?;
    }
    Ok(())
}

/// The state of the link on this machine: the session and the local publishers.
struct Carrier {
    talk: Talk,
    springs: Springs,
    instants: BTreeMap<Stream, Instants>,
    agreement: Agreement,
    late_after: Duration,
    /// Received reliable frames that are not published yet, each with the clock offset to add.
    unsaid: VecDeque<(Frame, i64)>,
    /// Earliest publishing time of the next reliable frame, by stream.
    say_at: BTreeMap<Stream, Instant>,
    health: LinkHealth,
    /// The last reported incompatibility of the peer.
    refusing: Option<Disagreement>,
    /// Whether a second peer was reported.
    is_crowded: bool,
}

impl Carrier {
    /// A link that sends these streams and publishes none yet.
    fn new(agreement: Agreement, here: &[Stream], now: Instant) -> Self {
        Self {
            talk: Talk::new(now.as_nanos(), here, now),
            springs: Springs::default(),
            instants: BTreeMap::new(),
            agreement,
            late_after: Duration::ZERO,
            unsaid: VecDeque::new(),
            say_at: BTreeMap::new(),
            health: LinkHealth::default(),
            refusing: None,
            is_crowded: false,
        }
    }

    /// Processes received messages and publishes new frames: reliable ones in order, then the newest of the
    /// others.
    fn hear(&mut self, net: &Net) -> Result<(), Failure> {
        let mut newest = BTreeMap::<Stream, (Frame, i64)>::new();
        while let Some(Message { sort, at, bytes }) = net.receive() {
            self.health.bytes_received += count(bytes.len());
            let understood = match sort {
                Sort::Pulse => Pulse::of_bytes(&bytes, self.agreement).map(|pulse| {
                    self.talk.hear_pulse(at, &pulse);
                    None
                }),
                Sort::Bundle => {
                    Bundle::of_bytes(&bytes, self.agreement).map(|bundle| self.talk.hear_bundle(at, bundle))
                }
            };
            let came = match understood {
                Ok(came) => came,
                Err(nonsense) => {
                    self.refuse(nonsense);
                    continue;
                }
            };
            let Some(came) = came else { continue };
            let Some((delay, ahead_ns)) = came.way else { continue };
            self.health.delay.record(clock::nanos(delay));
            self.unsaid.extend(came.new.said.into_iter().map(|frame| (frame, ahead_ns)));
            for frame in came.new.newest {
                newest.insert(frame.stream, (frame, ahead_ns));
            }
        }
        self.say()?;
        newest.into_values().try_for_each(|(frame, ahead_ns)| self.publish(&frame, ahead_ns))
    }

    /// Publishes pending reliable frames in order, rate-limited by stream.
    fn say(&mut self) -> Result<(), Failure> {
        let beyond = self.unsaid.len().saturating_sub(UNSAID_MOST);
        self.health.refused += count(self.unsaid.drain(..beyond).len());
        let now = clock::now();
        let waiting = std::mem::take(&mut self.unsaid);
        for (frame, ahead_ns) in waiting {
            if self.say_at.get(&frame.stream).is_some_and(|&say_at| now < say_at) {
                self.unsaid.push_back((frame, ahead_ns));
            } else {
                self.say_at.insert(frame.stream, now + SAY_EVERY);
                self.publish(&frame, ahead_ns)?;
            }
        }
        Ok(())
    }

    fn refuse(&mut self, nonsense: Nonsense) {
        self.health.refused += 1;
        if let Some(disagreement) = self.news(nonsense) {
            tracing::error!("{disagreement}");
        }
    }

    /// The incompatibility to report, once until the peer is connected again.
    fn news(&mut self, nonsense: Nonsense) -> Option<Disagreement> {
        let Nonsense::Disagreement(disagreement) = nonsense else { return None };
        (self.refusing.replace(disagreement) != Some(disagreement)).then_some(disagreement)
    }

    /// Publishes a frame after its timestamps are converted; `ahead_ns` is this clock minus the peer's.
    fn publish(&mut self, frame: &Frame, ahead_ns: i64) -> Result<(), Failure> {
        let Some(instants) = self.instants.get(&frame.stream) else {
            self.health.refused += 1;
            return Ok(());
        };
        let mut bytes = frame.bytes.to_vec();
        instants.shift(&mut bytes, ahead_ns);
        if frame.stream.is_command() && self.is_late(&bytes) {
            self.health.late += 1;
            return Ok(());
        }
        let is_whole = instants.entries(bytes.len()).is_some();
        if is_whole && self.springs.give(frame.stream, &bytes)? {
            self.health.received += 1;
        } else {
            self.health.refused += 1;
        }
        Ok(())
    }

    /// Whether a command is too old to be executed.
    fn is_late(&self, bytes: &[u8]) -> bool {
        use message::Bytes as _;
        let given_at = Instant::from_nanos(Header::get(bytes).valid_at_ns);
        clock::now().since(given_at) > self.late_after
    }

    /// Updates whether the peer is connected and logs changes.
    fn listen(&mut self, now: Instant) {
        self.talk.listen(now);
        let is_heard = self.talk.is_heard();
        let was_heard = self.health.is_heard != 0;
        self.health.is_heard = u64::from(is_heard);
        if self.talk.is_crowded() && !std::mem::replace(&mut self.is_crowded, true) {
            tracing::warn!(
                "a second machine speaks for the other side of this robot's link: nothing is taken from it while the \
                 first one is heard. Robots of one network need different names, and a robot has one other machine"
            );
        }
        if is_heard && !was_heard {
            self.refusing = None;
            tracing::info!("the other machine is heard");
        } else if was_heard && !is_heard {
            tracing::warn!("the other machine is not heard any more; the link goes on trying");
        }
    }

    /// Sends what is due while the network has room.
    fn speak(&mut self, net: &Net, now: Instant) {
        if let Some(pulse) = self.talk.pulse(now) {
            self.send(net, Sort::Pulse, pulse.to_bytes(self.agreement));
        }
        while net.has_room()
            && let Some(bundle) = self.talk.bundle(now)
        {
            self.health.sent += count(bundle.frames.len());
            self.send(net, Sort::Bundle, bundle.to_bytes(self.agreement));
        }
    }

    fn send(&mut self, net: &Net, sort: Sort, bytes: Vec<u8>) {
        self.health.bytes_sent += count(bytes.len());
        net.send(sort, bytes);
    }

    fn fares(&self, now: Instant) -> LinkHealth {
        LinkHealth {
            hearings: self.talk.hearings,
            round_trip_ns: clock::nanos(self.talk.round_trip),
            clock_error_ns: self.talk.offset.error(now).map_or(0, clock::nanos),
            overtaken: self.talk.outbox.overtaken,
            given_up: self.talk.outbox.given_up,
            lost: self.talk.inbox.lost,
            refused: self.refused(),
            ..self.health
        }
    }

    /// Number of malformed messages and messages of a foreign peer.
    fn refused(&self) -> u64 {
        self.health.refused + self.talk.strange
    }
}

fn count(size: usize) -> u64 {
    u64::try_from(size).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};

use clock::{Duration, Instant};
use config::Robot;
use config::leo::{Link, Side};
use message::{Header, LinkHealth, Process, TopicId};
use process::{Launch, ProcessError, ProcessNode, Progress};
use quantity::number::saturating_u64;

use crate::compatibility::{Compatibility, IncompatiblePeer};
use crate::instants::TimestampFields;
use crate::io::net::{KeyError, Keys, Message, MessageKind, Net};
use crate::io::ports::{TopicReaders, TopicWriters};
use crate::order::{carried_topics, publishing_order};
use crate::session::Session;
use crate::wire::{Batch, DecodeError, Frame, Heartbeat};

/// Write period of the health board.
const HEALTH_PERIOD: Duration = Duration::from_millis(100);
/// Minimum interval between two frames of a reliable topic after a reconnect. Local readers poll at 20 Hz or
/// faster and have queues of a few frames.
const MIN_REPLAY_INTERVAL: Duration = Duration::from_millis(20);
/// Maximum number of received reliable frames that wait for publication.
const MAX_PENDING_FRAMES: usize = 8192;

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
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), ProcessError> {
    let (leo, link) = (&robot.leo, &robot.leo.link);
    let mut member = ProcessNode::join(launch, Process::Link, &leo.buffers, &link.realtime)?;
    let perspectives = leo.belief.perspectives(launch.partners.unwrap_or(leo.belief.partners));
    let (here, there): (Vec<TopicId>, Vec<TopicId>) = carried_topics(perspectives)
        .into_iter()
        .partition(|topic| topic.writer().is_some_and(|writer| link.runs_here(writer)));
    let is_sent =
        |topic: &TopicId| link.topics.is_empty() || link.topics.iter().any(|name| name == topic.row().name);
    let here: Vec<TopicId> = here.into_iter().filter(is_sent).collect();
    let mut carrier = LinkRuntime {
        publishers: TopicWriters::open(&member, &there, robot)?,
        instants: there.iter().map(|&topic| (topic, TimestampFields::of(topic))).collect(),
        late_after: link.max_command_age_ms.duration(),
        ..LinkRuntime::new(Compatibility::of(robot, perspectives), &here, clock::now())
    };
    let mut subscribers = TopicReaders::open(&member, &here)?;
    let net = Net::start(link, carrier.compatibility).map_err(ProcessError::own)?;
    let mut board = member.board()?;
    let mut tell_at = clock::now();
    member.begin(Some(link.link_rate_hz.period()))?;
    while let Some(now) = member.next_cycle()? {
        if net.is_over() {
            return Err(ProcessError::own("the link's network thread has ended"));
        }
        subscribers.take(&mut |topic, place, bytes| carrier.session.push(now, topic, place, bytes))?;
        carrier.session.latched_subscribers += u64::from(carrier.publishers.has_new_subscribers());
        carrier.receive_and_publish(&net)?;
        if carrier.session.take_replay_request() {
            // The peer has a new subscriber of a latched topic. The local publisher replays to a new subscription.
            let took = &mut |topic, place, bytes| carrier.session.push(now, topic, place, bytes);
            if let Err(error) = subscribers.resubscribe(&member, took) {
                tracing::warn!(%error, "new subscribers on the other machine do not get what was learned before");
            }
        }
        carrier.listen(now);
        carrier.transmit(&net, clock::now());
        if now >= tell_at {
            tell_at = now + HEALTH_PERIOD;
            board.write(&carrier.link_health(now));
        }
        let health = member.health();
        health.drops = subscribers.drops();
        health.undelivered = carrier.publishers.undelivered();
        health.refused = carrier.refused();
        member.end_cycle(Progress::More)?;
    }
    Ok(())
}

/// The state of the link on this machine: the session and the local publishers.
struct LinkRuntime {
    session: Session,
    publishers: TopicWriters,
    instants: BTreeMap<TopicId, TimestampFields>,
    compatibility: Compatibility,
    late_after: Duration,
    /// Received reliable frames that are not published yet, each with the clock offset to add.
    pending_frames: VecDeque<(Frame, i64)>,
    /// Earliest publishing time of the next reliable frame, by topic.
    next_publish_at: BTreeMap<TopicId, Instant>,
    health: LinkHealth,
    /// The last reported incompatibility of the peer.
    refusing: Option<IncompatiblePeer>,
    /// Whether a second peer was reported.
    has_second_peer: bool,
}

impl LinkRuntime {
    /// A link that sends these topics and publishes none yet.
    fn new(compatibility: Compatibility, here: &[TopicId], now: Instant) -> Self {
        Self {
            session: Session::new(now.as_nanos(), here, now),
            publishers: TopicWriters::default(),
            instants: BTreeMap::new(),
            compatibility,
            late_after: Duration::ZERO,
            pending_frames: VecDeque::new(),
            next_publish_at: BTreeMap::new(),
            health: LinkHealth::default(),
            refusing: None,
            has_second_peer: false,
        }
    }

    /// Processes received messages and publishes new frames: reliable ones in order, then the newest of the
    /// others.
    fn receive_and_publish(&mut self, net: &Net) -> Result<(), ProcessError> {
        let mut newest = BTreeMap::<(bool, TopicId), (Frame, i64)>::new();
        while let Some(Message { sort, at, bytes }) = net.receive() {
            self.health.bytes_received += saturating_u64(bytes.len());
            let understood = match sort {
                MessageKind::Heartbeat => Heartbeat::decode(&bytes, self.compatibility).map(|pulse| {
                    self.session.receive_heartbeat(at, &pulse);
                    None
                }),
                MessageKind::Batch => Batch::decode(&bytes, self.compatibility)
                    .map(|bundle| self.session.receive_batch(at, bundle)),
            };
            let came = match understood {
                Ok(came) => came,
                Err(nonsense) => {
                    self.refuse(nonsense);
                    continue;
                }
            };
            let Some(came) = came else { continue };
            let Some((delay, ahead_ns)) = came.transit else { continue };
            self.health.delay.record(clock::nanos(delay));
            self.pending_frames.extend(came.new.said.into_iter().map(|frame| (frame, ahead_ns)));
            for frame in came.new.newest {
                newest.insert(publishing_order(frame.topic), (frame, ahead_ns));
            }
        }
        self.publish_pending()?;
        newest.into_values().try_for_each(|(frame, ahead_ns)| self.publish(&frame, ahead_ns))
    }

    /// Publishes pending reliable frames in order, rate-limited by topic.
    fn publish_pending(&mut self) -> Result<(), ProcessError> {
        let beyond = self.pending_frames.len().saturating_sub(MAX_PENDING_FRAMES);
        self.health.refused += saturating_u64(self.pending_frames.drain(..beyond).len());
        let now = clock::now();
        let waiting = std::mem::take(&mut self.pending_frames);
        for (frame, ahead_ns) in waiting {
            if self.next_publish_at.get(&frame.topic).is_some_and(|&next_publish_at| now < next_publish_at) {
                self.pending_frames.push_back((frame, ahead_ns));
            } else {
                self.next_publish_at.insert(frame.topic, now + MIN_REPLAY_INTERVAL);
                self.publish(&frame, ahead_ns)?;
            }
        }
        Ok(())
    }

    fn refuse(&mut self, nonsense: DecodeError) {
        self.health.refused += 1;
        if let Some(disagreement) = self.news(nonsense) {
            tracing::error!("{disagreement}");
        }
    }

    /// The incompatibility to report, once until the peer is connected again.
    fn news(&mut self, nonsense: DecodeError) -> Option<IncompatiblePeer> {
        let DecodeError::IncompatiblePeer(disagreement) = nonsense else { return None };
        (self.refusing.replace(disagreement) != Some(disagreement)).then_some(disagreement)
    }

    /// Publishes a frame after its timestamps are converted; `ahead_ns` is this clock minus the peer's.
    fn publish(&mut self, frame: &Frame, ahead_ns: i64) -> Result<(), ProcessError> {
        let Some(instants) = self.instants.get(&frame.topic) else {
            self.health.refused += 1;
            return Ok(());
        };
        let mut bytes = frame.bytes.to_vec();
        instants.shift(&mut bytes, ahead_ns);
        if frame.topic.row().is_command && self.is_late(&bytes) {
            self.health.late += 1;
            return Ok(());
        }
        let is_whole = instants.entries(bytes.len()).is_some();
        if is_whole && self.publishers.publish_frame(frame.topic, &bytes)? {
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
        self.session.listen(now);
        let is_up = self.session.is_up();
        let was_up = self.health.is_up != 0;
        self.health.is_up = u64::from(is_up);
        if self.session.has_second_peer && !std::mem::replace(&mut self.has_second_peer, true) {
            tracing::warn!(
                "a second machine claims to be the other side of this robot's link. Its messages are refused while the \
                 first one is connected. Each robot on a network needs its own name, and a robot has only one other \
                 machine"
            );
        }
        if is_up && !was_up {
            self.refusing = None;
            tracing::info!("connected to the other machine");
        } else if was_up && !is_up {
            tracing::warn!("the connection to the other machine is lost; the link keeps trying");
        }
    }

    /// Sends what is due while the network has room.
    fn transmit(&mut self, net: &Net, now: Instant) {
        if let Some(pulse) = self.session.pulse(now) {
            self.send(net, MessageKind::Heartbeat, pulse.to_bytes(self.compatibility));
        }
        while net.has_room()
            && let Some(bundle) = self.session.bundle(now)
        {
            self.health.sent += saturating_u64(bundle.frames.len());
            self.send(net, MessageKind::Batch, bundle.to_bytes(self.compatibility));
        }
    }

    fn send(&mut self, net: &Net, sort: MessageKind, bytes: Vec<u8>) {
        self.health.bytes_sent += saturating_u64(bytes.len());
        net.send(sort, bytes);
    }

    fn link_health(&self, now: Instant) -> LinkHealth {
        LinkHealth {
            sessions: self.session.established,
            round_trip_ns: clock::nanos(self.session.round_trip),
            clock_error_ns: self.session.offset.error(now).map_or(0, clock::nanos),
            overtaken: self.session.outbox.overtaken,
            expired: self.session.outbox.expired,
            lost: self.session.inbox.lost,
            refused: self.refused(),
            ..self.health
        }
    }

    /// Number of messages and frames that were received and not published, except commands that came too late.
    fn refused(&self) -> u64 {
        self.health.refused + self.session.foreign_messages
    }
}

#[cfg(test)]
mod tests;

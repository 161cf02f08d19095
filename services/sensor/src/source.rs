use clock::{Duration, Instant};
use geometry::{Base, Pose, Thing};
use message::{
    Header, Hop, LOSSES, Loss, MAX_PERSPECTIVES, Observation, ObservationKind, SourceHealth, Text,
};
use persons::Persons;
use quantity::number::single;

use crate::SourceEvent;

/// Tolerance for timestamps ahead of the cycle: a frame may be sent after the cycle's instant.
const AHEAD: Duration = Duration::from_millis(100);
/// Maximum age of a timestamp.
const BEHIND: Duration = Duration::from_secs(10);
/// Maximum plausible gap between two sequence numbers.
const MAX_SEQUENCE_GAP: u64 = 1 << 20;
/// Periods without a frame after which a source is silent, and the minimum time.
const SILENT_PERIODS: u32 = 3;
const MIN_SILENCE: Duration = Duration::from_millis(100);
/// Minimum time without silence before a source is reported as heard again. A slightly slow source is thus
/// reported once and not at every frame.
const SETTLED: Duration = Duration::from_secs(1);

/// Number of agents that can have a perspective, the robot included.
const PERSONS: usize = MAX_PERSPECTIVES;
/// The losses must fit into the bit mask.
const _: () = assert!(LOSSES <= 32);

/// One sensory source: its state and its reports of this cycle.
///
/// Allocates only in `new`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Source {
    number: u16,
    x_base_source: Option<Pose<Base, geometry::Source>>,
    confidence: f32,
    /// Standard deviation of a position, in metres, where an observation states none; zero if unknown.
    position_sd_m: f32,
    silent_after: Option<Duration>,
    /// Incarnation and sequence number of the last frame.
    last: Option<(u64, u64)>,
    /// Whether a frame of this cycle is waiting to be taken.
    waits: bool,
    /// Timestamp of the newest taken frame.
    valid_at: Option<Instant>,
    /// Newest observation timestamp in all taken frames.
    observed_at: Option<Instant>,
    heard_at: Option<Instant>,
    /// Last time at which it was silent.
    silent_at: Instant,
    /// The reports of this cycle: the header of the frame, and the valid observations in the robot's base
    /// frame.
    pub(crate) header: Option<Header>,
    pub(crate) observations: Vec<Observation>,
    /// Last observation time of each agent, if any.
    persons: Vec<Option<Instant>>,
    capacity: usize,
    pub(crate) health: SourceHealth,
    /// Unreported first losses, one bit each.
    unreported: u32,
    told_silent: bool,
    /// The unreported change to silent or heard, if any.
    pub(crate) turn: Option<SourceEvent>,
}

impl Source {
    pub(crate) fn new(
        number: u16,
        name: &str,
        x_base_source: Option<Pose<Base, geometry::Source>>,
        [confidence, position_sd_m]: [f32; 2],
        period: Option<Duration>,
        capacity: usize,
    ) -> Self {
        Self {
            number,
            x_base_source,
            confidence,
            position_sd_m,
            silent_after: period.map(|period| (period * SILENT_PERIODS).max(MIN_SILENCE)),
            observations: Vec::with_capacity(capacity),
            persons: vec![None; PERSONS],
            capacity,
            health: SourceHealth { name: Text::new(name), ..SourceHealth::default() },
            ..Self::default()
        }
    }

    /// Begins a cycle.
    pub(crate) fn begin(&mut self) {
        self.header = None;
        self.observations.clear();
        self.waits = false;
    }

    /// Records the header of a received frame. Returns whether the frame may be taken unless a newer one
    /// follows.
    pub(crate) fn record_header(&mut self, header: &Header) -> bool {
        if std::mem::replace(&mut self.waits, false) {
            self.count_loss(Loss::Overtaken, 1);
        }
        let last = self.last.replace((header.incarnation, header.sequence));
        let missed = match last {
            Some((incarnation, number)) if incarnation == header.incarnation => {
                header.sequence.checked_sub(number).and_then(|step| step.checked_sub(1))
            }
            Some(_) | None => Some(0),
        };
        match missed {
            Some(missed) if missed <= MAX_SEQUENCE_GAP => {
                self.count_loss(Loss::Missed, missed);
                self.waits = true;
            }
            Some(_) | None => self.count_loss(Loss::Misnumbered, 1),
        }
        self.waits
    }

    /// Takes the newest frame of the cycle at `now`.
    pub(crate) fn take(&mut self, now: Instant, header: &Header, entries: &[Observation]) {
        self.waits = false;
        // Copied from the writer's memory, so that the validated value is the used one.
        let header = *header;
        let valid_at = Instant::from_nanos(header.valid_at_ns);
        let stamped_at = header.hop_time(Hop::Observed).map(Instant::from_nanos);
        let Some(stamped_at) = stamped_at.filter(|stamped_at| when(now, *stamped_at).is_ok()) else {
            return self.count_loss(Loss::Unstamped, 1);
        };
        if when(now, valid_at).is_err() || self.valid_at.is_some_and(|newest| valid_at <= newest) {
            return self.count_loss(Loss::Untimely, 1);
        }
        self.valid_at = Some(valid_at);
        self.heard_at = Some(now);
        self.health.last_frame_at_ns = now.as_nanos();
        self.health.frames += 1;
        let mut newest = self.observed_at;
        // At most `room` entries are examined, however many there are.
        let room = self.capacity.saturating_sub(self.observations.len());
        for entry in entries.iter().take(room) {
            match self.validate(now, *entry) {
                Ok(observation) => {
                    if self.is_duplicate(&observation) {
                        self.count_loss(Loss::Duplicate, 1);
                        continue;
                    }
                    newest = newest.max(Some(Instant::from_nanos(observation.observed_at_ns)));
                    self.observations.push(observation);
                }
                Err(loss) => self.count_loss(loss, 1),
            }
        }
        self.observed_at = newest;
        let beyond = u64::try_from(entries.len().saturating_sub(room)).unwrap_or(u64::MAX);
        self.count_loss(Loss::OverCapacity, beyond);
        let mut taken = Header::at(header.valid_at_ns);
        taken.pass(Hop::Observed, stamped_at.as_nanos());
        let before = self.header.map_or(0, |earlier| earlier.over_capacity);
        taken.over_capacity = before.saturating_add(header.over_capacity).saturating_add(beyond);
        self.header = Some(taken);
    }

    /// Whether the newest observation of this person has the same timestamp. Older observations are accepted
    /// and do not update the newest. Partner numbers beyond the last agent are ignored, and so are detections.
    fn is_duplicate(&mut self, observation: &Observation) -> bool {
        let is_person = observation.kind() == Some(ObservationKind::Person) && observation.detection == 0;
        let newest = self.persons.get_mut(usize::from(observation.partner)).filter(|_| is_person);
        let at = Some(Instant::from_nanos(observation.observed_at_ns));
        newest.is_some_and(|newest| {
            let is_duplicate = *newest == at;
            *newest = at.max(*newest);
            is_duplicate
        })
    }

    /// Validates an observation of this source and transforms it into the robot's base frame.
    fn validate(&self, now: Instant, alleged: Observation) -> Result<Observation, Loss> {
        if let Some(loss) = alleged.fault() {
            return Err(loss);
        }
        let observed_at = Instant::from_nanos(alleged.observed_at_ns);
        when(now, observed_at)?;
        if self.observed_at.is_some_and(|newest| observed_at <= newest) {
            return Err(Loss::Stale);
        }
        let mut observation =
            Observation { source: self.number, confidence: alleged.confidence * self.confidence, ..alleged };
        for sd_m in observation.position_sd_m.iter_mut().filter(|sd_m| **sd_m <= 0.0) {
            *sd_m = self.position_sd_m;
        }
        if let Some(x_base_source) = self.x_base_source {
            observation.position_sd_m =
                x_base_source.position_sd_m(observation.position_sd_m.map(f64::from)).map(single);
            let position_m = alleged.position_m.map(f64::from);
            let alleged_xyzw = alleged.orientation().map(|xyzw| xyzw.map(f64::from));
            let xyzw = alleged_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]);
            let x_source_thing = Pose::<geometry::Source, Thing>::from_parts(position_m, xyzw);
            let x_base_thing = x_base_source * x_source_thing.ok_or(Loss::Orientation)?;
            observation.position_m = x_base_thing.position_m().map(single);
            // An orientation that was not observed stays unobserved in the base frame.
            if alleged_xyzw.is_some() {
                observation.orientation_xyzw = x_base_thing.orientation_xyzw().map(single);
            }
        }
        // A valid source position may be out of range in the base frame.
        observation.fault().map_or(Ok(observation), Err)
    }

    /// Names the partner of each detection of a person, and removes the others.
    pub(crate) fn identify(&mut self, persons: &mut Persons) {
        persons.identify(&mut self.observations, self.confidence);
        let unidentified = Persons::retain_identified(&mut self.observations);
        self.count_loss(Loss::Unidentified, unidentified);
    }

    /// Ends the cycle at `now` and updates whether the source is silent.
    pub(crate) fn end(&mut self, now: Instant) {
        let entered = u64::try_from(self.observations.len()).unwrap_or(0);
        self.health.observations = self.health.observations.saturating_add(entered);
        let heard_at = *self.heard_at.get_or_insert(now);
        let is_silent = self.silent_after.is_some_and(|limit| now.since(heard_at) > limit);
        self.health.silent = u64::from(is_silent);
        if is_silent {
            self.silent_at = now;
        }
        let settled = now.since(self.silent_at) >= SETTLED;
        if is_silent != self.told_silent && (is_silent || settled) {
            self.told_silent = is_silent;
            self.turn = Some(if is_silent { SourceEvent::Silent } else { SourceEvent::Heard });
        }
    }

    /// Counts losses.
    pub(crate) fn count_loss(&mut self, loss: Loss, count: u64) {
        let Some(slot) = self.health.losses.get_mut(usize::from(loss.raw())) else { return };
        if *slot == 0 && count > 0 {
            self.unreported |= 1 << loss.raw();
        }
        *slot = slot.saturating_add(count);
    }

    /// A first loss that was not reported yet.
    pub(crate) fn first_loss(&mut self) -> Option<Loss> {
        let loss = Loss::ALL.iter().copied().find(|loss| self.unreported & (1 << loss.raw()) != 0)?;
        self.unreported &= !(1 << loss.raw());
        Some(loss)
    }

    /// Keeps the first `room` observations of this cycle and counts the rest as left out.
    pub(crate) fn keep(&mut self, room: usize) {
        let beyond = self.observations.len().saturating_sub(room);
        self.observations.truncate(room);
        let beyond = u64::try_from(beyond).unwrap_or(u64::MAX);
        self.count_loss(Loss::OverCapacity, beyond);
        if let Some(header) = &mut self.header {
            header.over_capacity = header.over_capacity.saturating_add(beyond);
        }
    }
}

/// Checks that a source's timestamp is near the present.
fn when(now: Instant, alleged: Instant) -> Result<(), Loss> {
    if alleged.since(now) > AHEAD {
        Err(Loss::Future)
    } else if now.since(alleged) > BEHIND {
        Err(Loss::Past)
    } else {
        Ok(())
    }
}

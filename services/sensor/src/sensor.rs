use belief::percepts::Percepts;
use clock::Instant;
use config::leo;
use geometry::Pose;
use message::{Header, LOSSES, Loss, MAX_SOURCES, Observation, Perceived, PerceptHead, SourceSet, Sources};
use perception::{Frame, Own, Perception, PerceptionError};
use persons::{PersonSettings, Persons};
use quantity::number::{saturating_u32, single};

use crate::source::Source;

/// The sensor cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum SensorError {
    /// The percepts cannot be evaluated.
    #[error(transparent)]
    Percepts(#[from] PerceptionError),
    /// A source's frame is no valid pose.
    #[error("the coordinate frame of the source `{name}` is not a valid pose")]
    Frame {
        /// Name of the source.
        name: String,
    },
    /// There are more than [`MAX_SOURCES`] sources.
    #[error("{sources} sources are too many: at most {max} are possible", max = MAX_SOURCES)]
    Sources {
        /// Configured number of sources.
        sources: usize,
    },
}

/// A change of a source's state that should be reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceEvent {
    /// The first loss for this reason.
    Lost(Loss),
    /// No frame for longer than the configured rate allows.
    Silent,
    /// Frames arrive again after a silence.
    Heard,
}

/// The core of the sensor process: validates the observations of a cycle and perceives them (Berlin et al.
/// 2006, Eq. 1 and 2).
///
/// Reports of sources are untrusted. Invalid ones are refused and counted by reason. Valid ones are
/// transformed into the robot's base frame and get the number of their source. Allocates only in `new`.
///
/// ```
/// use clock::Instant;
/// use message::{Header, Hop, Loss, Observation, SourceSet};
/// use sensor_process::Sensor;
///
/// let robot = config::Robot::load(None)?;
/// let mut sensor = Sensor::new(&robot.percepts, &robot.leo.sensor.source, 16)?;
///
/// let mut header = Header { sequence: 1, ..Header::at(1_000) };
/// header.pass(Hop::Observed, 1_100);
/// let sound = Observation::object(7, 1_000);
/// let nowhere = Observation { position_m: [f32::NAN; 3], ..sound };
///
/// sensor.begin(Instant::from_nanos(2_000));
/// assert!(sensor.record_header(0, &header));
/// sensor.take(0, &header, &[nowhere, sound]);
/// let head = sensor.end();
///
/// assert_eq!((head.header.valid_at_ns, sensor.len()), (1_000, 1));
/// assert_eq!(head.active_sources(), SourceSet::of(0));
/// assert_eq!(sensor.perceived().next().unwrap().observation.source, 0);
/// assert_eq!(sensor.losses()[usize::from(Loss::Position.raw())], 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Sensor {
    perception: Perception,
    sources: Vec<Source>,
    persons: Persons,
    capacity: usize,
    now: Instant,
}

impl Sensor {
    /// Returns a sensor of these sources, for frames of at most `capacity` observations.
    ///
    /// # Errors
    ///
    /// [`SensorError`] if the percepts cannot be evaluated, a source's frame is no pose, or there are too many
    /// sources.
    pub fn new(percepts: &Percepts, sources: &[leo::Source], capacity: usize) -> Result<Self, SensorError> {
        Self::with_plugins(percepts, &Own::new(), sources, capacity)
    }

    /// As [`Self::new`], with plug-in percepts.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn with_plugins(
        percepts: &Percepts,
        own: &Own,
        sources: &[leo::Source],
        capacity: usize,
    ) -> Result<Self, SensorError> {
        if sources.len() > MAX_SOURCES {
            return Err(SensorError::Sources { sources: sources.len() });
        }
        let make = |(number, source): (u16, &leo::Source)| {
            let x_base_source = source.frame.map(|frame| {
                Pose::from_parts(frame.position_m, frame.orientation_xyzw)
                    .ok_or_else(|| SensorError::Frame { name: source.name.clone() })
            });
            let sd_m = source.position_sd_m.map_or(0.0, settings::number::NotNegative::get);
            let quality = [source.confidence(percepts), sd_m].map(single);
            let period = source.rate_hz.map(settings::number::Hertz::period);
            Ok(Source::new(number, &source.name, x_base_source.transpose()?, quality, period, capacity))
        };
        Ok(Self {
            perception: Perception::with_plugins(percepts, own)?,
            sources: (0..).zip(sources).map(make).collect::<Result<_, SensorError>>()?,
            persons: Persons::new(&PersonSettings::default()),
            capacity,
            now: Instant::EPOCH,
        })
    }

    /// Identifies persons by these settings instead of the default ones.
    #[must_use]
    pub fn identifying(mut self, settings: &PersonSettings) -> Self {
        self.persons = Persons::new(settings);
        self
    }

    /// Begins a cycle.
    pub fn begin(&mut self, now: Instant) {
        self.now = now;
        self.sources.iter_mut().for_each(Source::begin);
    }

    /// Records the header of a received frame, in order of arrival. Returns whether the frame may be taken;
    /// only the newest of a cycle is used.
    pub fn record_header(&mut self, source: usize, header: &Header) -> bool {
        self.sources.get_mut(source).is_some_and(|source| source.record_header(header))
    }

    /// Takes the last recorded frame of a source. A frame with invalid timestamps is refused as a whole. Of
    /// the others, valid observations are taken up to the capacity.
    pub fn take(&mut self, source: usize, header: &Header, observations: &[Observation]) {
        if let Some(source) = self.sources.get_mut(source) {
            source.take(self.now, header, observations);
        }
    }

    /// Counts a frame or observation that was lost before it reached the sensor.
    pub fn count_loss(&mut self, source: usize, loss: Loss) {
        if let Some(source) = self.sources.get_mut(source) {
            source.count_loss(loss, 1);
        }
    }

    /// Ends the cycle and returns the head of the percept frame.
    ///
    /// Detections of persons become observations of partners, or are lost as unidentified.
    ///
    /// Its timestamp and hop stamp are those of the newest frame of this cycle, or `now` without one. It has
    /// the number of observations left out for lack of capacity, by the sources and here. `active_sources` has the
    /// sources that delivered a complete frame. A source with left-out observations does not count, since a
    /// missing observation may be one of them.
    pub fn end(&mut self) -> PerceptHead {
        for source in &mut self.sources {
            source.identify(&mut self.persons);
        }
        self.distribute_capacity();
        for source in &mut self.sources {
            source.end(self.now);
        }
        let headers = || self.sources.iter().filter_map(|source| source.header);
        let newest = headers().max_by_key(|header| header.valid_at_ns);
        let mut header = newest.unwrap_or_else(|| Header::at(self.now.as_nanos()));
        header.over_capacity = headers().fold(0, |sum: u64, header| sum.saturating_add(header.over_capacity));
        let is_whole = |source: &Source| source.header.is_some_and(|header| header.over_capacity == 0);
        let active_sources = (0..).zip(&self.sources).filter(|(_, source)| is_whole(source));
        PerceptHead::new(header, active_sources.map(|(number, _)| SourceSet::of(number)).collect())
    }

    /// Distributes the capacity if there are too many observations. Each source is guaranteed an equal share;
    /// what is left goes to the first ones. A flooding source cannot displace another's share.
    fn distribute_capacity(&mut self) {
        let share = self.capacity / self.sources.len().max(1);
        let claim = |source: &Source| source.observations.len().min(share);
        let mut claimed: usize = self.sources.iter().map(claim).sum();
        let mut room = self.capacity;
        for source in &mut self.sources {
            claimed -= claim(source);
            source.keep(room.saturating_sub(claimed));
            room = room.saturating_sub(source.observations.len());
        }
    }

    /// Number of observations of this cycle that enter the percept frame.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sources.iter().map(|source| source.observations.len()).sum()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The entries of the percept frame, by source: each observation with its percept snapshot (Eq. 2).
    pub fn perceived(&self) -> impl Iterator<Item = Perceived> {
        let observations = self.sources.iter().flat_map(|source| &source.observations);
        observations.map(|observation| Perceived {
            observation: *observation,
            snapshot: self.perception.perceive(observation, &Frame { agent: 0 }),
        })
    }

    /// Losses of all sources, indexed by [`Loss`].
    #[must_use]
    pub fn losses(&self) -> [u64; LOSSES] {
        let mut losses = [0_u64; LOSSES];
        for source in &self.sources {
            for (sum, count) in losses.iter_mut().zip(&source.health.losses) {
                *sum = sum.saturating_add(*count);
            }
        }
        losses
    }

    /// Health of each source.
    #[must_use]
    pub fn sources(&self) -> Sources {
        let mut sources =
            Sources { count: u64::from(saturating_u32(self.sources.len())), ..Sources::default() };
        for (slot, source) in sources.sources.iter_mut().zip(&self.sources) {
            *slot = source.health;
        }
        sources
    }

    /// The next unreported change of a source, with the source's number. Each kind of loss is reported once.
    pub fn news(&mut self) -> Option<(usize, SourceEvent)> {
        self.sources.iter_mut().enumerate().find_map(|(number, source)| {
            let news = source.turn.take().or_else(|| source.first_loss().map(SourceEvent::Lost));
            Some((number, news?))
        })
    }
}

#[cfg(test)]
mod tests;

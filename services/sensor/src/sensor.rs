use clock::Instant;
use config::leo;
use config::percepts::Percepts;
use geometry::Pose;
use message::{Header, LOSSES, Loss, MAX_SOURCES, Observation, Perceived, PerceptHead, SourceSet, Sources};
use perception::{Frame, Own, Perception, Unperceivable};
use quantity::number::{saturating_u32, single};

use crate::source::Source;

/// Why nothing can be sensed.
#[derive(Debug, thiserror::Error)]
pub enum Unsensing {
    /// The percepts cannot be evaluated.
    #[error(transparent)]
    Percepts(#[from] Unperceivable),
    /// A source's frame is none.
    #[error("the frame of the source `{name}` is no pose")]
    Frame {
        /// The source.
        name: String,
    },
    /// There are more sources than can be told apart.
    #[error("{sources} sources are too many: at most {most} can be told apart", most = MAX_SOURCES)]
    Sources {
        /// The number asked for.
        sources: usize,
    },
}

/// What is to be told of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum News {
    /// Something it reported was lost, for the first time for this reason.
    Lost(Loss),
    /// Nothing has been heard of it for longer than its rate lets expect.
    Silent,
    /// It is heard again.
    Heard,
}

/// The core of the sensor process: which observations of this cycle enter the percept buffer, and
/// what the robot perceives in each (Berlin et al. 2006, Eq. 1 and 2).
///
/// What a source reports is an allegation. Here it is judged: what is nonsense is refused and
/// counted by its reason, and what is left is brought into the robot's base frame and bears the
/// number of the source that it came from. Allocates in `new` alone.
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
/// assert!(sensor.note(0, &header));
/// sensor.take(0, &header, &[nowhere, sound]);
/// let head = sensor.end();
///
/// assert_eq!((head.header.valid_at_ns, sensor.len()), (1_000, 1));
/// assert_eq!(head.looked(), SourceSet::of(0));
/// assert_eq!(sensor.perceived().next().unwrap().observation.source, 0);
/// assert_eq!(sensor.losses()[usize::from(Loss::Place.raw())], 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Sensor {
    perception: Perception,
    sources: Vec<Source>,
    capacity: usize,
    now: Instant,
}

impl Sensor {
    /// A sensor of these sources, for frames of at most `capacity` observations.
    ///
    /// # Errors
    ///
    /// The percepts cannot be evaluated, or a source cannot be.
    pub fn new(percepts: &Percepts, sources: &[leo::Source], capacity: usize) -> Result<Self, Unsensing> {
        Self::with_own(percepts, &Own::new(), sources, capacity)
    }

    /// The same with the program's own percepts.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn with_own(
        percepts: &Percepts,
        own: &Own,
        sources: &[leo::Source],
        capacity: usize,
    ) -> Result<Self, Unsensing> {
        if sources.len() > MAX_SOURCES {
            return Err(Unsensing::Sources { sources: sources.len() });
        }
        let make = |(number, source): (u16, &leo::Source)| {
            let x_base_source = source.frame.map(|frame| {
                Pose::from_parts(frame.position_m, frame.orientation_xyzw)
                    .ok_or_else(|| Unsensing::Frame { name: source.name.clone() })
            });
            let confidence = single(source.confidence(percepts));
            let period = source.rate_hz.map(config::number::Hertz::period);
            Ok(Source::new(number, &source.name, x_base_source.transpose()?, confidence, period, capacity))
        };
        Ok(Self {
            perception: Perception::with_own(percepts, own)?,
            sources: (0..).zip(sources).map(make).collect::<Result<_, Unsensing>>()?,
            capacity,
            now: Instant::EPOCH,
        })
    }

    /// Begins a cycle.
    pub fn begin(&mut self, now: Instant) {
        self.now = now;
        self.sources.iter_mut().for_each(Source::begin);
    }

    /// Takes note of a frame of a source, in the order of their coming. Whether it may be taken:
    /// the newest one of the cycle is.
    pub fn note(&mut self, source: usize, header: &Header) -> bool {
        self.sources.get_mut(source).is_some_and(|source| source.note(header))
    }

    /// Takes the frame of a source that was noted last in this cycle. It is refused whole where
    /// its times cannot be; else its sound observations are taken, as many as there is room for.
    pub fn take(&mut self, source: usize, header: &Header, observations: &[Observation]) {
        if let Some(source) = self.sources.get_mut(source) {
            source.take(self.now, header, observations);
        }
    }

    /// Counts a frame of a source, or an observation, that was lost before it came here.
    pub fn lose(&mut self, source: usize, loss: Loss) {
        if let Some(source) = self.sources.get_mut(source) {
            source.lose(loss, 1);
        }
    }

    /// Ends the cycle; gives the head of the percept buffer.
    ///
    /// It speaks about the newest instant that a source observed in this cycle, with the stamp of
    /// that source, and says how many observations were left out for lack of room, by all sources
    /// and here, and which sources looked. A source of which anything was left out did not: what is not
    /// among its observations may be what there was no room for. Where no source had anything new, it speaks
    /// about `now`: time passes for the beliefs, and nothing is taken to have vanished.
    pub fn end(&mut self) -> PerceptHead {
        self.share_out();
        for source in &mut self.sources {
            source.end(self.now);
        }
        let headers = || self.sources.iter().filter_map(Source::header);
        let newest = headers().max_by_key(|header| header.valid_at_ns);
        let mut header = newest.copied().unwrap_or_else(|| Header::at(self.now.as_nanos()));
        header.left_out = headers().fold(0, |sum: u64, header| sum.saturating_add(header.left_out));
        let is_whole = |source: &Source| source.header().is_some_and(|header| header.left_out == 0);
        let looked = (0..).zip(&self.sources).filter(|(_, source)| is_whole(source));
        PerceptHead::new(header, looked.map(|(number, _)| SourceSet::of(number)).collect())
    }

    /// Where there are more observations than room, every source is sure of an equal share of it,
    /// and the first ones get what others leave: a source that floods crowds out nobody's share.
    fn share_out(&mut self) {
        let share = self.capacity / self.sources.len().max(1);
        let claim = |source: &Source| source.observations().len().min(share);
        let mut claimed: usize = self.sources.iter().map(claim).sum();
        let mut room = self.capacity;
        for source in &mut self.sources {
            claimed -= claim(source);
            source.keep(room.saturating_sub(claimed));
            room = room.saturating_sub(source.observations().len());
        }
    }

    /// How many observations of the cycle enter the percept buffer.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sources.iter().map(|source| source.observations().len()).sum()
    }

    /// Whether none does.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The entries of the percept buffer, source by source: each observation with what the robot
    /// perceives in it, its percept snapshot (Eq. 2).
    pub fn perceived(&self) -> impl Iterator<Item = Perceived> {
        let observations = self.sources.iter().flat_map(Source::observations);
        observations.map(|observation| Perceived {
            observation: *observation,
            snapshot: self.perception.perceive(observation, &Frame { agent: 0 }),
        })
    }

    /// What was lost of all sources' reports, by the number of the [`Loss`].
    #[must_use]
    pub fn losses(&self) -> [u64; LOSSES] {
        let mut losses = [0_u64; LOSSES];
        for source in &self.sources {
            for (sum, count) in losses.iter_mut().zip(&source.health().losses) {
                *sum = sum.saturating_add(*count);
            }
        }
        losses
    }

    /// What became of what each source reported.
    #[must_use]
    pub fn sources(&self) -> Sources {
        let mut sources =
            Sources { count: u64::from(saturating_u32(self.sources.len())), ..Sources::default() };
        for (slot, source) in sources.sources.iter_mut().zip(&self.sources) {
            *slot = *source.health();
        }
        sources
    }

    /// Something to be told of a source that was not told yet, with the source's number. Each loss
    /// is told once, when it first happens.
    pub fn news(&mut self) -> Option<(usize, News)> {
        self.sources.iter_mut().enumerate().find_map(|(number, source)| {
            let turned = source.turn().map(|silent| if silent { News::Silent } else { News::Heard });
            Some((number, turned.or_else(|| source.first_loss().map(News::Lost))?))
        })
    }
}

#[cfg(test)]
mod tests;

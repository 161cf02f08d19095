use belief_process::{BeliefProcessError, Believer};
use clock::Instant;
use config::Robot;
use message::{
    Belief, BeliefHead, Header, Hop, Loss, Observation, ObservationKind, Perceived, PerceptHead, SourceSet,
};
use perception::{Frame as Whose, Perception};
use persons::Persons;
use perspective::{Divergence, PerspectiveBeliefs};
use quantity::number::saturating_u64;
use reports::beliefs::{PerspectiveRecord, Refusal};
use trace::Frame;

/// All perspectives over a trace: the robot's perception and the core of the belief process in sequence, as if
/// connected by the percept buffer; and the differences of each perspective from the robot's.
///
/// The trace reader already validates observations, and a trace is in the base frame. So of the sensor process only
/// the identification of persons and perception are needed.
pub(crate) struct BeliefPipeline {
    perception: Perception,
    believer: Believer,
    partners: u32,
    capacity: usize,
    persons: Persons,
    /// The observations of a frame whose partners are named.
    identified: Vec<Observation>,
    /// The number of detections without a partner, and the instant of the first.
    unidentified: (u64, Option<Instant>),
    entries: Vec<Perceived>,
    left_out: u64,
    minds: Vec<PerspectiveState>,
}

/// One perspective.
struct PerspectiveState {
    head: BeliefHead,
    beliefs: Vec<Belief>,
    /// Its differences from the robot; nothing is compared before the partner has been seen.
    divergence: Divergence,
}

impl BeliefPipeline {
    /// No beliefs yet, with the capacities of the robot's buffers.
    pub(crate) fn new(robot: &Robot, partners: u32) -> Result<Self, BeliefProcessError> {
        let capacity = robot.leo.buffers.max_objects.get();
        let depth = robot.leo.belief.depth.get();
        let believer = Believer::new(&robot.percepts, &robot.perspective, partners, depth, capacity)?;
        let own = |perspective| PerspectiveState {
            head: believer.head(perspective),
            beliefs: Vec::with_capacity(capacity),
            divergence: Divergence::new(&robot.percepts, capacity),
        };
        Ok(Self {
            perception: Perception::new(&robot.percepts)?,
            partners,
            capacity,
            persons: Persons::new(&robot.leo.sensor.persons),
            identified: Vec::new(),
            unidentified: (0, None),
            entries: Vec::with_capacity(capacity),
            left_out: 0,
            minds: (0..believer.perspectives()).map(own).collect(),
            believer,
        })
    }

    /// One percept snapshot and the belief step that it triggers, over the frames of one instant.
    pub(crate) fn step(&mut self, frames: &[Frame]) {
        let Some(at_ns) = frames.iter().map(|frame| frame.at_ns).max() else { return };
        self.entries.clear();
        let mut active_sources = SourceSet::EMPTY;
        for frame in frames {
            self.identify(frame);
            let room = self.capacity.saturating_sub(self.entries.len());
            let perception = &self.perception;
            self.entries.extend(self.identified.iter().take(room).map(|observation| Perceived {
                observation: *observation,
                snapshot: perception.perceive(observation, &Whose { agent: 0 }),
            }));
            let left_out = saturating_u64(self.identified.len().saturating_sub(room));
            self.left_out = self.left_out.saturating_add(left_out);
            // A source whose observations did not all fit counts as inactive, as in the sensor process: missing
            // observations must not count as absent objects.
            if left_out == 0 {
                active_sources = active_sources.union(SourceSet::of(frame.source));
            }
        }
        let mut header = Header::at(at_ns);
        // A time stamp of zero means "none".
        header.pass(Hop::Observed, at_ns.max(1));
        self.believer.step(
            Instant::from_nanos(at_ns),
            &PerceptHead::new(header, active_sources),
            &self.entries,
        );
        self.read();
    }

    /// Names the partners of a frame's detections of persons.
    fn identify(&mut self, frame: &Frame) {
        self.identified.clear();
        self.identified.extend_from_slice(&frame.observations);
        self.persons.identify(&mut self.identified, 1.0);
        let unidentified = Persons::retain_identified(&mut self.identified);
        if unidentified > 0 {
            self.unidentified.0 = self.unidentified.0.saturating_add(unidentified);
            self.unidentified.1.get_or_insert(Instant::from_nanos(frame.at_ns));
        }
    }

    /// Reads the beliefs of every perspective, as from the belief buffers.
    fn read(&mut self) {
        let believer = &self.believer;
        for (perspective, own) in (0..).zip(&mut self.minds) {
            own.head = believer.head(perspective);
            own.beliefs.clear();
            own.beliefs.extend(
                (0..believer.len(perspective)).filter_map(|index| believer.entry(perspective, index)),
            );
        }
        let Some((robot, partners)) = self.minds.split_first_mut() else { return };
        let robots = PerspectiveBeliefs { head: &robot.head, beliefs: &robot.beliefs };
        for partner in partners {
            if partner.head.present != 0 || !partner.beliefs.is_empty() {
                let his = PerspectiveBeliefs { head: &partner.head, beliefs: &partner.beliefs };
                partner.divergence.compare(robots, his);
            }
        }
    }

    /// The instant of the beliefs.
    pub(crate) fn at(&self) -> Instant {
        Instant::from_nanos(self.minds.first().map_or(0, |robot| robot.head.header.valid_at_ns))
    }

    /// The observed partners of this instant; 0 is the robot, by its head.
    pub(crate) fn partners(&self) -> impl Iterator<Item = u16> {
        let observations = self.entries.iter().map(|entry| &entry.observation);
        let persons = observations.filter(|seen| seen.kind() == Some(ObservationKind::Person));
        persons.map(|seen| seen.partner)
    }

    /// Whether a partner's beliefs are simulated.
    pub(crate) fn simulates(&self, partner: u16) -> bool {
        u32::from(partner) <= self.partners
    }

    /// Observations that did not fit into a frame of the percept buffer.
    pub(crate) fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Detections of persons that belong to no partner, as a refusal.
    pub(crate) fn unidentified(&self) -> Option<Refusal> {
        let (observations, first) = self.unidentified;
        Some(Refusal {
            reason: Loss::Unidentified.advice().to_owned(),
            observations,
            first: format!("at {:.3} s", first?.since(Instant::EPOCH).as_secs_f64()),
        })
    }

    /// Every perspective, the robot's first.
    pub(crate) fn all(&self) -> Vec<PerspectiveRecord<'_>> {
        let mind = |own| {
            let PerspectiveState { head, beliefs, divergence }: &PerspectiveState = own;
            PerspectiveRecord {
                head,
                beliefs,
                pairs: divergence.pairs(),
                differences: divergence.differences(),
            }
        };
        self.minds.iter().map(mind).collect()
    }
}

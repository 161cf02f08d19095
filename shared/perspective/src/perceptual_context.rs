use clock::{Duration, Instant};
use geometry::{Base, Eye, Pose, Thing};
use message::{Observation, ObservationKind, Perceived, SourceSet};
use scene::Occluders;

use crate::occluders::RememberedOccluders;
use crate::transform::place_of;

/// What one perspective perceives: the input for the perspectives nested in it.
///
/// Allocates only in `new`.
#[derive(Clone, Debug)]
pub struct PerceptualContext {
    perceives: Vec<bool>,
    /// The agent of this perspective, and its own eye; `None` while the agent is absent.
    agent: u16,
    own_eye: Option<Pose<Base, Eye>>,
    /// The eyes of the robot and of its partners.
    eyes: Vec<Option<AgentPose>>,
    absent_after: Duration,
    occluders: RememberedOccluders,
    active_sources: SourceSet,
    capacity: usize,
}

/// The last perceived pose of an agent's eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AgentPose {
    pub(crate) x_base_eye: Pose<Base, Eye>,
    /// Observation time; a later observation replaces an earlier one.
    pub(crate) observed_at: Instant,
    /// Arrival time: observation time plus the latency of the source. The absence timeout counts from here.
    pub(crate) received_at: Instant,
}

impl PerceptualContext {
    /// Returns an empty context of `agent`, for at most `partners` partners and `capacity` observations a
    /// frame.
    #[must_use]
    pub fn new(agent: u16, config: &crate::settings::Perspective, partners: u16, capacity: usize) -> Self {
        Self {
            perceives: Vec::with_capacity(capacity),
            agent,
            own_eye: None,
            eyes: vec![None; usize::from(partners) + 1],
            absent_after: config.sight.absent_after_ms.duration(),
            occluders: RememberedOccluders::new(&config.occluders),
            active_sources: SourceSet::EMPTY,
            capacity,
        }
    }

    /// Records one frame: which observations are perceived, and the eyes and occluders among them.
    ///
    /// Observations beyond the capacity count as not perceived. Only sources in `active_sources` can report an
    /// absence.
    pub(crate) fn record_frame(
        &mut self,
        at: Instant,
        active_sources: SourceSet,
        entries: &[Perceived],
        perceives: impl IntoIterator<Item = bool>,
    ) {
        self.active_sources = active_sources;
        self.perceives.clear();
        self.occluders.begin();
        for (entry, perceived) in entries.iter().zip(perceives).take(self.capacity) {
            self.perceives.push(perceived);
            if perceived {
                self.record_observation(at, &entry.observation);
            }
        }
        self.occluders.rebuild();
    }

    fn record_observation(&mut self, at: Instant, observation: &Observation) {
        // An observation time in the future would never be replaced.
        let observed_at = Instant::from_nanos(observation.observed_at_ns).min(at);
        match observation.kind() {
            Some(ObservationKind::Person) => {
                if let Some(x_base_eye) = place_of(observation) {
                    self.update_agent(
                        observation.partner,
                        AgentPose { x_base_eye, observed_at, received_at: at },
                    );
                }
            }
            Some(ObservationKind::Occluder) => {
                self.occluders.observe(observation, at);
            }
            Some(ObservationKind::Object | ObservationKind::Hand) | None => {}
        }
    }

    /// Records the eye of an agent; an older observation is ignored.
    pub(crate) fn update_agent(&mut self, agent: u16, met: AgentPose) {
        if let Some(slot) = self.eyes.get_mut(usize::from(agent))
            && slot.is_none_or(|before| before.observed_at <= met.observed_at)
        {
            *slot = Some(met);
        }
    }

    /// Removes occluders that were not observed for the configured time while `is_partly_visible` reported part of the
    /// box in view.
    ///
    /// An occluder for which `stands` is true stays. Returns whether any was removed.
    pub(crate) fn forget(
        &mut self,
        at: Instant,
        is_partly_visible: impl Fn(&Pose<Base, Thing>, [f64; 3]) -> bool,
        stands: impl Fn(&Pose<Base, Thing>) -> bool,
    ) -> bool {
        self.occluders.forget(at, self.active_sources, is_partly_visible, stands)
    }

    /// Whether an occluder is remembered at this place.
    pub(crate) fn has_occluder_at(&self, x_base_box: &Pose<Base, Thing>) -> bool {
        self.occluders.has_one_at(&x_base_box.origin())
    }

    /// Sets the eye of the perspective's own agent.
    pub(crate) fn set_own_eye(&mut self, x_base_eye: Pose<Base, Eye>) {
        self.own_eye = Some(x_base_eye);
    }

    /// Marks the agent as absent: it perceives nothing, and all nested perspectives freeze.
    pub(crate) fn set_absent(&mut self) {
        self.own_eye = None;
        self.active_sources = SourceSet::EMPTY;
        self.perceives.clear();
        self.occluders.restart_absence_timers();
    }

    /// The sources that delivered a frame at this instant. Only these can report what they saw before as
    /// missing.
    #[must_use]
    pub fn active_sources(&self) -> SourceSet {
        self.active_sources
    }

    /// For each observation of this instant, in order, whether it is perceived. Of people, a partner
    /// perceives only the eyes: see [`Self::eye`].
    #[must_use]
    pub fn perceives(&self) -> &[bool] {
        &self.perceives
    }

    /// The agent of this perspective: 0 the robot, n partner n.
    #[must_use]
    pub fn agent(&self) -> u16 {
        self.agent
    }

    /// The eye of an agent (0 the robot, n partner n). `None` if that agent is absent or was never perceived,
    /// or if the agent of this perspective is absent.
    #[must_use]
    pub fn eye(&self, agent: u16, at: Instant) -> Option<Pose<Base, Eye>> {
        let own_eye = self.own_eye?;
        if agent == self.agent { Some(own_eye) } else { self.perceived_eye(agent, at) }
    }

    /// The recently perceived eye of an agent, which may be the perspective's own.
    pub(crate) fn perceived_eye(&self, agent: u16, at: Instant) -> Option<Pose<Base, Eye>> {
        self.perceived(agent, at).map(|met| met.x_base_eye)
    }

    fn perceived(&self, agent: u16, at: Instant) -> Option<AgentPose> {
        let met = self.eyes.get(usize::from(agent)).copied().flatten();
        met.filter(|met| at.since(met.received_at) <= self.absent_after)
    }

    /// All agents with a known eye, the perspective's own included.
    pub(crate) fn eyes(&self, at: Instant) -> impl Iterator<Item = (u16, AgentPose)> + Clone {
        let known = move |agent| {
            let own = AgentPose { x_base_eye: self.own_eye?, observed_at: at, received_at: at };
            let met = (agent == self.agent).then_some(own).or_else(|| self.perceived(agent, at))?;
            Some((agent, met))
        };
        (0..).take(self.eyes.len()).filter_map(known)
    }

    /// Number of occluder observations dropped because all slots were taken.
    pub(crate) fn left_out(&self) -> u64 {
        self.occluders.left_out
    }

    /// The remembered occluders, in the base frame.
    #[must_use]
    pub fn occluders(&self) -> &Occluders {
        &self.occluders.shapes
    }
}

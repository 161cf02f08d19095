use clock::{Duration, Instant};
use geometry::{Base, Eye, Pose, Thing};
use message::{Observation, ObservationKind, Perceived, SourceSet};
use scene::Occluders;

use crate::occluders::RememberedOccluders;
use crate::transform::place_of;

/// What one perspective is aware of: all that a perspective within it is made from.
///
/// Allocates in `new` alone.
#[derive(Clone, Debug)]
pub struct Awareness {
    perceives: Vec<bool>,
    /// Whose perspective it is, and where he has his own eye; nowhere while he is absent.
    agent: u16,
    own_eye: Option<Pose<Base, Eye>>,
    /// The eyes of the robot and of its partners, and when they were last perceived.
    eyes: Vec<Option<(Pose<Base, Eye>, Instant)>>,
    absent_after: Duration,
    occluders: RememberedOccluders,
    looked: SourceSet,
    capacity: usize,
}

impl Awareness {
    /// Aware of nothing yet, for `agent` to be aware of up to `partners` partners and `capacity`
    /// observations at once.
    #[must_use]
    pub fn new(
        agent: u16,
        config: &config::perspective::Perspective,
        partners: u16,
        capacity: usize,
    ) -> Self {
        Self {
            perceives: Vec::with_capacity(capacity),
            agent,
            own_eye: None,
            eyes: vec![None; usize::from(partners) + 1],
            absent_after: config.sight.absent_after_ms.duration(),
            occluders: RememberedOccluders::new(&config.occluders),
            looked: SourceSet::EMPTY,
            capacity,
        }
    }

    /// Takes note of an instant: of each observation whether it is perceived, and of eyes and
    /// occluders among them. Observations beyond the capacity are not perceived. What none of those who
    /// `looked` saw before is not taken to be gone.
    pub(crate) fn note(
        &mut self,
        at: Instant,
        looked: SourceSet,
        entries: &[Perceived],
        perceives: impl IntoIterator<Item = bool>,
    ) {
        self.looked = looked;
        self.perceives.clear();
        self.occluders.begin();
        for (entry, perceived) in entries.iter().zip(perceives).take(self.capacity) {
            self.perceives.push(perceived);
            if perceived {
                self.note_one(at, &entry.observation);
            }
        }
        self.occluders.end();
    }

    fn note_one(&mut self, at: Instant, observation: &Observation) {
        // What claims to have been observed later than now would outlive everything.
        let observed_at = Instant::from_nanos(observation.observed_at_ns).min(at);
        match observation.kind() {
            Some(ObservationKind::Person) => {
                if let Some(x_base_eye) = place_of(observation) {
                    self.meet(observation.partner, x_base_eye, observed_at);
                }
            }
            Some(ObservationKind::Occluder) => {
                let _remembered = self.occluders.observe(observation, observed_at);
            }
            Some(ObservationKind::Object) | None => {}
        }
    }

    /// The eye of an agent is perceived.
    pub(crate) fn meet(&mut self, agent: u16, x_base_eye: Pose<Base, Eye>, observed_at: Instant) {
        if let Some(slot) = self.eyes.get_mut(usize::from(agent))
            && slot.is_none_or(|(_, noted_at)| noted_at <= observed_at)
        {
            *slot = Some((x_base_eye, observed_at));
        }
    }

    /// Forgets the occluders that are gone: not observed for long, though `glimpses` says that
    /// some of the box would be seen if it were there. Whether it forgot any.
    pub(crate) fn forget(
        &mut self,
        at: Instant,
        glimpses: impl Fn(&Pose<Base, Thing>, [f64; 3]) -> bool,
    ) -> bool {
        self.occluders.forget(at, self.looked, glimpses)
    }

    /// Whether it remembers an occluder there.
    pub(crate) fn remembers(&self, x_base_box: &Pose<Base, Thing>) -> bool {
        self.occluders.has_one_at(&x_base_box.origin())
    }

    /// He whose perspective it is has his own eye here.
    pub(crate) fn have_eye(&mut self, x_base_eye: Pose<Base, Eye>) {
        self.own_eye = Some(x_base_eye);
    }

    /// He whose perspective it is is absent: he perceives nothing, and all within it freezes.
    pub(crate) fn lose(&mut self) {
        self.own_eye = None;
        self.looked = SourceSet::EMPTY;
        self.perceives.clear();
    }

    /// The sources that observed anything new at this instant: only of what they saw before does an
    /// absence say that it is gone.
    #[must_use]
    pub fn looked(&self) -> SourceSet {
        self.looked
    }

    /// Which observations of this instant the perspective perceives, in their order. Of people, a
    /// partner perceives their eyes alone: see [`Self::eye`].
    #[must_use]
    pub fn perceives(&self) -> &[bool] {
        &self.perceives
    }

    /// Whose perspective it is: 0 the robot's, n that of partner n.
    #[must_use]
    pub fn agent(&self) -> u16 {
        self.agent
    }

    /// The eye of an agent (0 the robot, n partner n), his own among them; `None` while that one is
    /// absent or was never perceived, or the perspective's own agent is.
    #[must_use]
    pub fn eye(&self, agent: u16, at: Instant) -> Option<Pose<Base, Eye>> {
        let own_eye = self.own_eye?;
        if agent == self.agent { Some(own_eye) } else { self.perceived_eye(agent, at) }
    }

    /// The eye of an agent as it was perceived of late, be it his own.
    pub(crate) fn perceived_eye(&self, agent: u16, at: Instant) -> Option<Pose<Base, Eye>> {
        self.perceived(agent, at).map(|(x_base_eye, _)| x_base_eye)
    }

    fn perceived(&self, agent: u16, at: Instant) -> Option<(Pose<Base, Eye>, Instant)> {
        let noted = self.eyes.get(usize::from(agent)).copied().flatten();
        noted.filter(|(_, noted_at)| at.since(*noted_at) <= self.absent_after)
    }

    /// All agents whose eyes it knows, its own among them, with when they were perceived.
    pub(crate) fn eyes(&self, at: Instant) -> impl Iterator<Item = (u16, Pose<Base, Eye>, Instant)> + Clone {
        let known = move |agent| {
            let own_eye = self.own_eye?;
            let own = (agent == self.agent).then_some((own_eye, at));
            let (x_base_eye, noted_at) = own.or_else(|| self.perceived(agent, at))?;
            Some((agent, x_base_eye, noted_at))
        };
        (0..).take(self.eyes.len()).filter_map(known)
    }

    /// The occluders that it remembers, in the base frame.
    #[must_use]
    pub fn occluders(&self) -> &Occluders {
        self.occluders.shapes()
    }
}

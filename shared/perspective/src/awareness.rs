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
    /// The eyes of the robot and of its partners.
    eyes: Vec<Option<Met>>,
    absent_after: Duration,
    occluders: RememberedOccluders,
    looked: SourceSet,
    capacity: usize,
}

/// Somebody's eye as it was last perceived.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    pub(crate) x_base_eye: Pose<Base, Eye>,
    /// When it was there: of two the later one counts.
    pub(crate) observed_at: Instant,
    /// When it was taken in, later by what its source takes to understand what it sees: he is absent when
    /// nothing of him has come for a while.
    pub(crate) noticed_at: Instant,
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
                    self.meet(observation.partner, Met { x_base_eye, observed_at, noticed_at: at });
                }
            }
            Some(ObservationKind::Occluder) => {
                self.occluders.observe(observation, at);
            }
            Some(ObservationKind::Object) | None => {}
        }
    }

    /// The eye of an agent is perceived.
    pub(crate) fn meet(&mut self, agent: u16, met: Met) {
        if let Some(slot) = self.eyes.get_mut(usize::from(agent))
            && slot.is_none_or(|before| before.observed_at <= met.observed_at)
        {
            *slot = Some(met);
        }
    }

    /// Forgets the occluders that are gone: not observed for long, though `glimpses` says that
    /// some of the box would be seen if it were there; unless it `stands` there for another reason. Whether it
    /// forgot any.
    pub(crate) fn forget(
        &mut self,
        at: Instant,
        glimpses: impl Fn(&Pose<Base, Thing>, [f64; 3]) -> bool,
        stands: impl Fn(&Pose<Base, Thing>) -> bool,
    ) -> bool {
        self.occluders.forget(at, self.looked, glimpses, stands)
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
        self.occluders.look_anew();
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
        self.perceived(agent, at).map(|met| met.x_base_eye)
    }

    fn perceived(&self, agent: u16, at: Instant) -> Option<Met> {
        let met = self.eyes.get(usize::from(agent)).copied().flatten();
        met.filter(|met| at.since(met.noticed_at) <= self.absent_after)
    }

    /// All agents whose eyes it knows, its own among them.
    pub(crate) fn eyes(&self, at: Instant) -> impl Iterator<Item = (u16, Met)> + Clone {
        let known = move |agent| {
            let own = Met { x_base_eye: self.own_eye?, observed_at: at, noticed_at: at };
            let met = (agent == self.agent).then_some(own).or_else(|| self.perceived(agent, at))?;
            Some((agent, met))
        };
        (0..).take(self.eyes.len()).filter_map(known)
    }

    /// Observations of occluders that hide nothing, because more stood there at once than are remembered.
    pub(crate) fn left_out(&self) -> u64 {
        self.occluders.left_out()
    }

    /// The occluders that it remembers, in the base frame.
    #[must_use]
    pub fn occluders(&self) -> &Occluders {
        self.occluders.shapes()
    }
}

use belief::percepts::Percepts;
use belief::{BeliefPlugins, BeliefSystem};
use clock::Instant;
use geometry::{Base, Eye, Person, Pose, Position};
use message::{Belief, BeliefHead, Header, Perceived};
use perception::{Frame, Perception};
use quantity::number::saturating_u32;
use scene::{Cone, Occluders, Sight};

use crate::field::{is_fully_in_view, is_partly_visible};
use crate::gaze::Gaze;
use crate::robot::{head_with_counts, is_object};
use crate::senses::Senses;
use crate::settings::Perspective;
use crate::transform::place_in_base;
use crate::{Anchor, OwnershipEstimator, PerceptualContext, PerspectiveError};

/// A model of what a partner perceives and believes, as the robot or another partner sees it.
///
/// Allocates only in `new` and [`Self::with_perceptual_context`].
#[derive(Clone)]
pub struct Partner {
    senses: Senses,
    system: BeliefSystem,
    empty_margin_m: f64,
    anchor: Anchor,
    owners: OwnershipEstimator,
    eye: Option<Pose<Base, Eye>>,
    present: bool,
    /// The last instant at which the partner was present; their beliefs are frozen at it.
    at: Instant,
    /// The input for perspectives nested in this one, if any.
    perceptual_context: Option<PerceptualContext>,
}

impl Partner {
    /// Returns partner `agent` (1, 2, …; nested in a partner's perspective also the robot, 0) without
    /// beliefs. `capacity` limits a frame of observations and the belief system.
    ///
    /// # Errors
    ///
    /// [`PerspectiveError`] if the configured belief system or cone is invalid.
    pub fn new(
        agent: u16,
        perception: Perception,
        percepts: &Percepts,
        config: &Perspective,
        capacity: usize,
    ) -> Result<Self, PerspectiveError> {
        Self::with_plugins(agent, perception, percepts, &BeliefPlugins::default(), config, capacity)
    }

    /// As [`Self::new`], with plug-in functions in the belief system.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn with_plugins(
        agent: u16,
        perception: Perception,
        percepts: &Percepts,
        functions: &BeliefPlugins,
        config: &Perspective,
        capacity: usize,
    ) -> Result<Self, PerspectiveError> {
        let sight = &config.sight;
        let half_angle_rad = sight.cone_half_angle_deg.radians();
        let gaze = Gaze::new(half_angle_rad, sight.gaze_sd_deg.radians());
        let reach_rad = gaze.map_or(half_angle_rad, |gaze| gaze.reach_rad());
        let cone = Cone::new(reach_rad, sight.range_m.get())
            .map_err(|source| PerspectiveError::Cone { agent, source })?;
        Ok(Self {
            senses: Senses {
                frame: Frame { agent },
                perception,
                sight: Sight::new(Pose::identity(), cone, &Occluders::new(config.occluders.max_count.get())),
                gaze,
                samples: sight.samples,
                hearing_range_m: sight.hearing_range_m.get(),
                sees_occluders: false,
                visible: Vec::with_capacity(capacity),
                perceived: Vec::with_capacity(capacity),
                hands: 0,
                hidden: 0,
                refused: 0,
            },
            system: BeliefSystem::with_plugins(percepts, functions, capacity)
                .map_err(|source| PerspectiveError::Belief { agent, source })?
                .assume_validated(),
            empty_margin_m: sight.empty_margin_m.get(),
            anchor: Anchor::new(config.frame.reanchor_m.get(), config.frame.reanchor_deg.radians()),
            owners: OwnershipEstimator::new(&config.ownership, capacity).of(agent),
            eye: None,
            present: false,
            at: Instant::EPOCH,
            perceptual_context: None,
        })
    }

    /// Enables nesting: records the perceptual context for perspectives within this one. The partner then also
    /// perceives occluders and the eyes of the robot and of up to `partners` partners.
    #[must_use]
    pub fn with_perceptual_context(mut self, config: &Perspective, partners: u16, capacity: usize) -> Self {
        self.senses.sees_occluders = true;
        self.perceptual_context = Some(PerceptualContext::new(self.agent(), config, partners, capacity));
        self
    }

    /// The recorded perceptual context; `None` unless enabled by [`Self::with_perceptual_context`].
    #[must_use]
    pub fn perceptual_context(&self) -> Option<&PerceptualContext> {
        self.perceptual_context.as_ref()
    }

    /// Advances by one instant, from the perceptual context of the parent perspective. `entries` must be those that
    /// `parent` recorded.
    ///
    /// `surveyed` returns whether every ancestor, from the robot ([`crate::Robot::is_fully_in_view`]) to the parent
    /// ([`Self::is_fully_in_view`]), would notice a missing thing at a place. A place outside the parent's view gives
    /// no evidence of absence.
    ///
    /// While the partner is absent or their pose is unknown, their beliefs and all nested ones stay
    /// unchanged.
    pub fn step(
        &mut self,
        at: Instant,
        entries: &[Perceived],
        parent: &PerceptualContext,
        surveyed: impl Fn(&Position<Base>) -> bool,
    ) {
        let eye = parent.eye(self.agent(), at);
        let was_present = std::mem::replace(&mut self.present, eye.is_some());
        let Some(x_base_eye) = eye else {
            let aware = entries.iter().zip(parent.perceives());
            self.senses.perceived.clear();
            self.senses.hands = 0;
            self.senses.hidden = aware.filter(|(entry, perceives)| **perceives && is_object(entry)).count();
            if let Some(perceptual_context) = &mut self.perceptual_context {
                perceptual_context.set_absent();
            }
            return;
        };
        if !was_present {
            self.system.look_anew(at);
        }
        self.eye = eye;
        self.at = at;
        let (x_base_person, anew) = self.anchor.follow(&x_base_eye);
        if let Some(x_new_old) = anew {
            self.system.reanchor(&x_new_old);
        }
        self.senses.sight.update_view(&x_base_eye, parent.occluders());
        let mut step_builder = self.system.begin(at);
        self.senses.perceive(entries, parent, &x_base_person, |index, perceived| {
            step_builder.add_observation(index, perceived);
        });
        let senses = &self.senses;
        let Senses { sight, perceived, visible, .. } = senses;
        if let Some(perceptual_context) = &mut self.perceptual_context {
            perceptual_context.record_frame(at, parent.active_sources(), entries, visible.iter().copied());
            update_nested_context(perceptual_context, senses, at, parent, x_base_eye);
        }
        let margin_m = self.empty_margin_m;
        step_builder.finish(perceived, parent.active_sources(), |place_m| {
            let place = place_in_base(&x_base_person, place_m);
            senses.is_certain(&place) && is_fully_in_view(sight, &place, margin_m) && surveyed(&place)
        });
        let agents = parent.eyes(at).map(|(agent, met)| (agent, met.x_base_eye.origin()));
        self.owners.update_from_beliefs(&self.system, at, &x_base_person, agents);
    }

    /// The agent: 1, 2, …, or 0 the robot.
    #[must_use]
    pub fn agent(&self) -> u16 {
        self.senses.frame.agent
    }

    /// Whether the partner, as they look now, would notice a missing thing at a place.
    #[must_use]
    pub fn is_fully_in_view(&self, place: &Position<Base>) -> bool {
        self.present
            && self.senses.is_certain(place)
            && is_fully_in_view(&self.senses.sight, place, self.empty_margin_m)
    }

    /// The partner's frame; `None` if they were never perceived.
    #[must_use]
    pub fn frame(&self) -> Option<Pose<Base, Person>> {
        self.anchor.frame()
    }

    /// The partner's beliefs, in their frame.
    #[must_use]
    pub fn beliefs(&self) -> &BeliefSystem {
        &self.system
    }

    /// The head of the partner's belief topic. Frame and eye are the last known ones; `perceivable` and
    /// `hidden` count observations of objects.
    #[must_use]
    pub fn head(&self, header: Header) -> BeliefHead {
        let mut head = head_with_counts(&self.system, self.senses.frame.agent, header);
        if let Some(x_base_person) = self.anchor.frame() {
            head.frame_position_m = x_base_person.position_m();
            head.frame_orientation_xyzw = x_base_person.orientation_xyzw();
        }
        if let Some(x_base_eye) = self.eye {
            head.eye_position_m = x_base_eye.position_m();
            head.eye_orientation_xyzw = x_base_eye.orientation_xyzw();
        }
        head.present = u32::from(self.present);
        head.perceivable = saturating_u32(self.senses.perceived.len() - self.senses.hands);
        head.hidden = saturating_u32(self.senses.hidden);
        head.refused = head.refused.saturating_add(self.senses.refused);
        head.overflowed += self.perceptual_context.as_ref().map_or(0, PerceptualContext::left_out);
        head
    }

    /// A belief by its index in the order of identities, evaluated at the last instant at which the partner
    /// was present. During an absence it does not fade.
    #[must_use]
    pub fn entry(&self, index: usize) -> Option<Belief> {
        let mut belief = self.system.write(index, self.at)?;
        belief.owner = self.owners.owner_of(index, belief.id);
        Some(belief)
    }
}

/// Copies the eyes that both the parent and this partner can see into the nested context, and updates its
/// occluders.
///
/// The parent's own eye is included only while it is in this partner's view.
fn update_nested_context(
    perceptual_context: &mut PerceptualContext,
    senses: &Senses,
    at: Instant,
    parent: &PerceptualContext,
    x_base_eye: Pose<Base, Eye>,
) {
    perceptual_context.set_own_eye(x_base_eye);
    for (agent, met) in parent.eyes(at) {
        if senses.sees(&met.x_base_eye.origin()) {
            perceptual_context.update_agent(agent, met);
        }
    }
    // Occluders that the parent remembers stay in the nested context.
    let is_partly_visible =
        |x_base_box: &_, half_extents_m| is_partly_visible(&senses.sight, x_base_box, half_extents_m);
    perceptual_context.forget(at, is_partly_visible, |x_base_box| parent.has_occluder_at(x_base_box));
}

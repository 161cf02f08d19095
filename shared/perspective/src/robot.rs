use belief::percepts::Percepts;
use belief::{BeliefPlugins, BeliefSystem, Counts};
use clock::Instant;
use geometry::{Base, Eye, Pose, Position};
use message::{Belief, BeliefHead, Header, ObservationKind, Perceived, SourceSet};
use quantity::number::saturating_u32;
use scene::{Cone, Sight};
use settings::number::Coordinate;

use crate::field::{is_fully_in_view, is_partly_visible};
use crate::settings::{Field, Perspective};
use crate::transform::place_in_base;
use crate::{OwnershipEstimator, PerceptualContext, PerspectiveError};

/// Prefetch distance, in entries.
const AHEAD: usize = 4;

/// The robot's own perspective: it perceives all observations, in the base frame, and detects absences where
/// its sensors look.
///
/// Its eye is its recently observed head (a person of number 0), or the configured rest pose.
#[derive(Clone, Debug)]
pub struct Robot {
    system: BeliefSystem,
    perceptual_context: PerceptualContext,
    /// `None` if it perceives everything.
    sight: Option<Sight>,
    x_base_rest: Pose<Base, Eye>,
    owners: OwnershipEstimator,
    empty_margin_m: f64,
    at: Instant,
    perceivable: usize,
    refused: u64,
    left_out: u64,
}

impl Robot {
    /// Returns a robot without beliefs, for up to `partners` partners. `capacity` limits a frame of
    /// observations and the belief system.
    ///
    /// # Errors
    ///
    /// [`PerspectiveError`] if the configured belief system or field of view is invalid.
    pub fn new(
        percepts: &Percepts,
        config: &Perspective,
        partners: u16,
        capacity: usize,
    ) -> Result<Self, PerspectiveError> {
        Self::with_plugins(percepts, &BeliefPlugins::default(), config, partners, capacity)
    }

    /// As [`Self::new`], with plug-in functions in the belief system.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn with_plugins(
        percepts: &Percepts,
        functions: &BeliefPlugins,
        config: &Perspective,
        partners: u16,
        capacity: usize,
    ) -> Result<Self, PerspectiveError> {
        let system = BeliefSystem::with_plugins(percepts, functions, capacity)
            .map_err(|source| PerspectiveError::Belief { agent: 0, source })?;
        let perceptual_context = PerceptualContext::new(0, config, partners, capacity);
        let position = |coordinates: [Coordinate; 3]| {
            let [x, y, z] = coordinates.map(Coordinate::get);
            Position::<Base>::new(x, y, z)
        };
        let x_base_rest = Pose::looking(&position(config.robot.eye_m), &position(config.robot.looks_at_m));
        let sight = match config.robot.field_of_view {
            Field::Everything => None,
            Field::Cone { half_angle_deg, range_m } => {
                let cone = Cone::new(half_angle_deg.radians(), range_m.get())
                    .map_err(|source| PerspectiveError::Cone { agent: 0, source })?;
                Some(Sight::new(x_base_rest, cone, perceptual_context.occluders()))
            }
        };
        Ok(Self {
            system: system.assume_validated(),
            perceptual_context,
            sight,
            x_base_rest,
            owners: OwnershipEstimator::new(&config.ownership, capacity).of(0),
            empty_margin_m: config.sight.empty_margin_m.get(),
            at: Instant::EPOCH,
            perceivable: 0,
            refused: 0,
            left_out: 0,
        })
    }

    /// Advances by one instant: records eyes and occluders and updates the beliefs. Invalid entries are
    /// refused and counted; entries beyond the capacity are dropped and counted.
    ///
    /// `active_sources` are the sources that delivered a frame, which may be empty. Only these can report a belief as
    /// missing.
    pub fn step(&mut self, at: Instant, active_sources: SourceSet, entries: &[Perceived]) {
        self.at = at;
        self.perceivable = 0;
        // One pass over the entries, for cache locality.
        let mut step_builder = self.system.begin(at);
        let noted = entries.iter().enumerate().map(|(index, entry)| {
            if let Some(later) = entries.get(index + AHEAD) {
                prefetch::prefetch_whole(later);
            }
            let is_sound = entry.is_sound();
            self.perceivable += usize::from(is_sound && is_object(entry));
            if is_sound && (is_object(entry) || is_hand(entry)) {
                step_builder.add_observation(index, entry);
            }
            is_sound
        });
        self.perceptual_context.record_frame(at, active_sources, entries, noted);
        let x_base_eye = self.perceptual_context.perceived_eye(0, at).unwrap_or(self.x_base_rest);
        self.perceptual_context.set_own_eye(x_base_eye);
        if let Some(sight) = &mut self.sight {
            sight.update_view(&x_base_eye, self.perceptual_context.occluders());
        }
        let sight = self.sight.as_ref();
        let is_partly_visible =
            |x_base_box: &_, half| sight.is_none_or(|sight| is_partly_visible(sight, x_base_box, half));
        if self.perceptual_context.forget(at, is_partly_visible, |_| false)
            && let Some(sight) = &mut self.sight
        {
            sight.update_view(&x_base_eye, self.perceptual_context.occluders());
        }
        let noted = self.perceptual_context.perceives();
        let refused = noted.iter().filter(|perceives| !**perceives).count();
        let left_out = entries.len().saturating_sub(noted.len());
        self.refused = self.refused.saturating_add(u64::from(saturating_u32(refused)));
        self.left_out = self.left_out.saturating_add(u64::from(saturating_u32(left_out)));
        let (sight, margin_m) = (self.sight.as_ref(), self.empty_margin_m);
        step_builder.finish(entries, active_sources, |place_m| {
            let place = place_in_base(&Pose::identity(), place_m);
            sight.is_none_or(|sight| is_fully_in_view(sight, &place, margin_m))
        });
        let agents = self.perceptual_context.eyes(at).map(|(agent, met)| (agent, met.x_base_eye.origin()));
        self.owners.update_from_beliefs(&self.system, at, &Pose::<Base, Base>::identity(), agents);
    }

    /// Whether the robot, as it looks now, would notice a missing thing at a place.
    #[must_use]
    pub fn is_fully_in_view(&self, place: &Position<Base>) -> bool {
        self.sight.as_ref().is_none_or(|sight| is_fully_in_view(sight, place, self.empty_margin_m))
    }

    /// The input for the partners' perspectives.
    #[must_use]
    pub fn perceptual_context(&self) -> &PerceptualContext {
        &self.perceptual_context
    }

    /// The robot's beliefs.
    #[must_use]
    pub fn beliefs(&self) -> &BeliefSystem {
        &self.system
    }

    /// Number of entries refused because the observation or its percepts were invalid.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// The head of the robot's belief topic.
    #[must_use]
    pub fn head(&self, header: Header) -> BeliefHead {
        let mut head = head_with_counts(&self.system, 0, header);
        let x_base_eye = self.perceptual_context.eye(0, self.at).unwrap_or(self.x_base_rest);
        head.eye_position_m = x_base_eye.position_m();
        head.eye_orientation_xyzw = x_base_eye.orientation_xyzw();
        head.present = 1;
        head.perceivable = saturating_u32(self.perceivable);
        head.refused = head.refused.saturating_add(self.refused);
        head.overflowed += self.left_out + self.perceptual_context.left_out();
        head
    }

    /// A belief by its index in the order of identities, evaluated at the last step's instant.
    #[must_use]
    pub fn entry(&self, index: usize) -> Option<Belief> {
        let mut belief = self.system.write(index, self.at)?;
        belief.owner = self.owners.owner_of(index, belief.id);
        Some(belief)
    }
}

/// The head of an agent's belief topic, with the counters of the belief system.
pub(crate) fn head_with_counts(system: &BeliefSystem, agent: u16, header: Header) -> BeliefHead {
    let counts = system.counts();
    let Counts { created, merged, culled, overflowed, .. } = counts;
    let head = BeliefHead::of(u32::from(agent), header);
    BeliefHead { refused: counts.refused(), created, merged, culled, overflowed, ..head }
}

pub(crate) fn is_object(entry: &Perceived) -> bool {
    entry.observation.kind() == Some(ObservationKind::Object)
}

pub(crate) fn is_hand(entry: &Perceived) -> bool {
    entry.observation.kind() == Some(ObservationKind::Hand)
}

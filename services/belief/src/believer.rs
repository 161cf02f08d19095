use belief::percepts::Percepts;
use clock::Instant;
use geometry::{Base, Position};
use invariant::{invariant, require};
use message::{Belief, BeliefHead, Header, Path, Perceived, PerceptHead, Perspectives};
use perception::{Perception, PerceptionError};
use perspective::settings::Perspective;
use perspective::{NestedPerspective, Partner, PerspectiveError, Robot};
use quantity::number::{saturating_u16, saturating_u32};

/// The plug-ins of a program, under the names that `percepts.toml` uses.
#[derive(Clone, Default)]
pub struct Own {
    /// Percepts, for `kernel = { plugin = "NAME" }`.
    pub percepts: perception::Own,
    /// Distances, culling functions and histories.
    pub functions: belief::BeliefPlugins,
}

/// Reasons why a [`Believer`] cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum BeliefProcessError {
    /// The percepts cannot be evaluated.
    #[error(transparent)]
    Percepts(#[from] PerceptionError),
    /// A perspective cannot be created.
    #[error(transparent)]
    Perspective(#[from] PerspectiveError),
}

/// All perspectives: the robot's beliefs, the beliefs that the robot attributes to each partner, and nested ones. A
/// nested perspective has the beliefs that a partner is assumed to attribute to another partner or to the robot.
///
/// Perspective 0 is the robot's, n that of partner n. Perspectives nested deeper follow in the order of [`NestedPerspective`].
/// Without partners, only the robot's perspective is computed. Only `new` allocates.
///
/// ```
/// use belief_process::Believer;
/// use clock::Instant;
/// use message::{Header, Observation, Perceived, PerceptHead, SourceSet};
///
/// let percepts = belief::percepts::Percepts::builtin();
/// let perspective = perspective::settings::Perspective::builtin();
/// let perception = perception::Perception::new(&percepts)?;
/// let mut believer = Believer::new(&percepts, &perspective, 1, 1, 16)?;
///
/// let observation = Observation { half_extents_m: [0.03; 3], ..Observation::object(0, 1_000) };
/// let snapshot = perception.perceive(&observation, &perception::Frame { agent: 0 });
/// let now = Instant::from_nanos(2_000);
/// let head = PerceptHead::new(Header::at(1_000), SourceSet::of(0));
/// believer.step(now, &head, &[Perceived { observation, snapshot }]);
///
/// assert_eq!(believer.perspectives(), 2);
/// assert_eq!(believer.len(0), 1);
/// assert!(believer.entry(0, 0).is_some());
/// // Partner 1 has not been observed yet, so their perspective has no beliefs.
/// assert_eq!((believer.len(1), believer.head(1).present), (0, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Believer {
    robot: Robot,
    /// Perspectives 1, 2, …: each is derived from one with a lower number.
    partner_perspectives: Vec<PartnerPerspective>,
    header: Header,
    at: Instant,
    /// Frames whose instant was corrected.
    retimed_frames: u64,
    computed: Perspectives,
}

#[derive(Clone)]
struct PartnerPerspective {
    path: Path,
    /// The number of the parent perspective, from which it is derived.
    within: usize,
    partner: Partner,
}

impl Believer {
    /// Creates the perspectives, without beliefs. `depth` is their nesting depth: at 1 there is one for each partner.
    /// `capacity` is that of a frame of observations and of each belief system.
    ///
    /// # Errors
    ///
    /// The configuration of the percepts, the beliefs or the view cones is invalid, or there would be too many
    /// perspectives, or too deep ones.
    pub fn new(
        percepts: &Percepts,
        config: &Perspective,
        partners: u32,
        depth: u32,
        capacity: usize,
    ) -> Result<Self, BeliefProcessError> {
        Self::with_plugins(percepts, &Own::default(), config, partners, depth, capacity)
    }

    /// Like [`Self::new`], with plug-in percepts and functions, which every perspective uses.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    ///
    /// ```
    /// use std::sync::Arc;
    ///
    /// use belief::{Cull, CullContext};
    /// use belief_process::{Believer, Own};
    /// use belief::percepts::Percepts;
    /// use perspective::settings::Perspective;
    ///
    /// /// Things in an agent's hand are not culled.
    /// struct InNobodysHand;
    ///
    /// impl Cull for InNobodysHand {
    ///     fn agrees(&self, belief: &CullContext<'_>) -> bool {
    ///         belief.held_by() == message::NOBODY
    ///     }
    /// }
    ///
    /// let text = std::fs::read_to_string("../../config/percepts.toml")?;
    /// let text = text + "\n[[belief.cull]]\nwhen = { plugin = \"in nobody's hand\" }\n";
    /// let percepts = Percepts::parse(&text, "percepts.toml".as_ref())?;
    /// assert!(Believer::new(&percepts, &Perspective::builtin(), 1, 1, 64).is_err());
    ///
    /// let mut own = Own::default();
    /// own.functions.culls.push(("in nobody's hand".to_owned(), Arc::new(InNobodysHand)));
    /// let believer = Believer::with_plugins(&percepts, &own, &Perspective::builtin(), 1, 1, 64)?;
    /// assert_eq!(believer.perspectives(), 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_plugins(
        percepts: &Percepts,
        own: &Own,
        config: &Perspective,
        partners: u32,
        depth: u32,
        capacity: usize,
    ) -> Result<Self, BeliefProcessError> {
        let perspectives = NestedPerspective::all(partners, depth)?;
        // There are fewer partners than perspectives.
        let partners = usize::try_from(partners).map_or(u16::MAX, saturating_u16);
        let perception = Perception::with_plugins(percepts, &own.percepts)?;
        let robot = Robot::with_plugins(percepts, &own.functions, config, partners, capacity)?;
        let other = |(number, nested): (usize, &NestedPerspective)| {
            let NestedPerspective { path, within } = *nested;
            let agent = path.agent().unwrap_or(0);
            let partner =
                Partner::with_plugins(agent, perception.clone(), percepts, &own.functions, config, capacity)?;
            let contains = perspectives.iter().any(|nested| nested.within == number);
            let partner =
                if contains { partner.with_perceptual_context(config, partners, capacity) } else { partner };
            Ok(PartnerPerspective { path, within, partner })
        };
        let partner_perspectives =
            perspectives.iter().enumerate().skip(1).map(other).collect::<Result<_, PerspectiveError>>()?;
        let mut computed =
            Perspectives { count: u64::from(saturating_u32(perspectives.len())), ..Perspectives::default() };
        for (counts, nested) in computed.perspectives.iter_mut().zip(&perspectives) {
            counts.path = nested.path;
        }
        Ok(Self {
            robot,
            partner_perspectives,
            header: Header::default(),
            at: Instant::EPOCH,
            retimed_frames: 0,
            computed,
        })
    }

    /// Advances every perspective to the instant of a frame of the percept buffer.
    ///
    /// A frame with an instant after `now` is processed at `now`. One older than the previous frame is processed at
    /// that frame's instant. Both are [counted](Self::retimed_frames). So the time of the beliefs never goes backwards. A
    /// thing counts as missing only if one of the frame's sources saw it before.
    pub fn step(&mut self, now: Instant, head: &PerceptHead, entries: &[Perceived]) {
        let header = &head.header;
        let alleged = Instant::from_nanos(header.valid_at_ns);
        self.at = alleged.min(now).max(self.at);
        self.retimed_frames += u64::from(self.at != alleged);
        self.header = Header { valid_at_ns: self.at.as_nanos(), ..header.header_for_derived() };
        self.robot.step(self.at, head.active_sources(), entries);
        self.count(0);
        for index in 0..self.partner_perspectives.len() {
            let split = self.partner_perspectives.split_at_mut_checked(index);
            let Some((earlier, [other, ..])) = split else {
                invariant!(false, "perspective {index} of the partners exists");
                return;
            };
            let perceptual_context = match other.within.checked_sub(1) {
                None => Some(self.robot.perceptual_context()),
                Some(index) => earlier.get(index).and_then(|parent| parent.partner.perceptual_context()),
            };
            let perceptual_context = require!(
                perceptual_context,
                "perspective {} contains others, and has a perceptual context",
                other.within
            );
            if let Some(perceptual_context) = perceptual_context {
                let (robot, within) = (&self.robot, other.within);
                let surveyed =
                    |place: &Position<Base>| is_fully_in_view_of_all(robot, earlier, within, place);
                other.partner.step(self.at, entries, perceptual_context, surveyed);
                self.count(saturating_u32(index + 1));
            }
        }
    }

    /// Number of frames whose instant was after `now` or before that of the previous frame.
    #[must_use]
    pub fn retimed_frames(&self) -> u64 {
        self.retimed_frames
    }

    /// Computation counters of each perspective, incremented where the work is done.
    #[must_use]
    pub fn computed(&self) -> &Perspectives {
        &self.computed
    }

    fn count(&mut self, perspective: u32) {
        let (head, beliefs) = (self.head(perspective), self.len(perspective));
        let counts =
            usize::try_from(perspective).ok().and_then(|index| self.computed.perspectives.get_mut(index));
        if let Some(counts) = require!(counts, "perspective {perspective} is counted") {
            counts.steps += 1;
            counts.beliefs += u64::from(saturating_u32(beliefs));
            (counts.over_capacity, counts.refused) = (head.overflowed, head.refused);
        }
    }

    /// Number of perspectives, including the robot's.
    #[must_use]
    pub fn perspectives(&self) -> u32 {
        saturating_u32(self.partner_perspectives.len()).saturating_add(1)
    }

    /// The head of a perspective's belief buffer. For a perspective that does not exist, the head is marked as absent.
    #[must_use]
    pub fn head(&self, perspective: u32) -> BeliefHead {
        match self.other(perspective) {
            None if perspective == 0 => self.robot.head(self.header),
            None => BeliefHead::of(perspective, self.header),
            Some(PartnerPerspective { path, partner, .. }) => {
                let mut head = partner.head(self.header);
                head.perspective = perspective;
                head.path = *path;
                // Entries that the robot rejected were not passed on, so they count for every perspective.
                head.refused = head.refused.saturating_add(self.robot.refused());
                head
            }
        }
    }

    /// Number of beliefs of a perspective.
    #[must_use]
    pub fn len(&self, perspective: u32) -> usize {
        match self.other(perspective) {
            None if perspective == 0 => self.robot.beliefs().len(),
            None => 0,
            Some(other) => other.partner.beliefs().len(),
        }
    }

    /// The number of the parent perspective; `None` for the robot's, and for a perspective that does not exist.
    #[must_use]
    pub fn within(&self, perspective: u32) -> Option<u32> {
        Some(saturating_u32(self.other(perspective)?.within))
    }

    /// Whether a perspective has no beliefs.
    #[must_use]
    pub fn is_empty(&self, perspective: u32) -> bool {
        self.len(perspective) == 0
    }

    /// A belief of a perspective, by its index in order of the identities, evaluated at the frame's instant. For an
    /// absent partner it is evaluated at the last instant at which the partner was present.
    #[must_use]
    pub fn entry(&self, perspective: u32, index: usize) -> Option<Belief> {
        match self.other(perspective) {
            None if perspective == 0 => self.robot.entry(index),
            None => None,
            Some(other) => other.partner.entry(index),
        }
    }

    fn other(&self, perspective: u32) -> Option<&PartnerPerspective> {
        let index = usize::try_from(perspective.checked_sub(1)?).ok()?;
        self.partner_perspectives.get(index)
    }
}

/// Whether a position is fully in view of a perspective and of all its ancestors, so that each would notice a missing
/// thing there.
fn is_fully_in_view_of_all(
    robot: &Robot,
    partner_perspectives: &[PartnerPerspective],
    number: usize,
    place: &Position<Base>,
) -> bool {
    match number.checked_sub(1) {
        None => robot.is_fully_in_view(place),
        Some(index) => partner_perspectives.get(index).is_some_and(|other| {
            other.partner.is_fully_in_view(place)
                && is_fully_in_view_of_all(robot, partner_perspectives, other.within, place)
        }),
    }
}

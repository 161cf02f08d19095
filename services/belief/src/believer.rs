use clock::Instant;
use config::percepts::Percepts;
use config::perspective::Perspective;
use geometry::{Base, Position};
use message::{Belief, BeliefHead, Header, Path, Perceived, PerceptHead, Perspectives};
use perception::{Perception, Unperceivable};
use perspective::{Nested, NoPerspective, Partner, Robot};
use quantity::number::{saturating_u16, saturating_u32};

/// What a program brings along itself, by the names that `percepts.toml` calls it.
#[derive(Clone, Default)]
pub struct Own {
    /// Percepts, for `kernel = { own = "NAME" }`.
    pub percepts: perception::Own,
    /// Distances, culling functions and histories.
    pub functions: belief::Functions,
}

/// Why nothing can be believed.
#[derive(Debug, thiserror::Error)]
pub enum Unbelieving {
    /// The percepts cannot be evaluated.
    #[error(transparent)]
    Percepts(#[from] Unperceivable),
    /// A perspective cannot be made.
    #[error(transparent)]
    Perspective(#[from] NoPerspective),
}

/// What the robot believes, what it takes each of its partners to believe, and what it takes them to
/// take each other, and the robot, to believe.
///
/// Perspective 0 is the robot's own, n that of partner n; those nested deeper follow, in the order of
/// [`Nested`]. Without partners nothing of anybody else's perspective is computed. Allocates in `new`
/// alone.
///
/// ```
/// use belief_process::Believer;
/// use clock::Instant;
/// use message::{Header, Observation, Perceived, PerceptHead, SourceSet};
///
/// let percepts = config::percepts::Percepts::builtin();
/// let perspective = config::perspective::Perspective::builtin();
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
/// // Nobody has seen partner 1 yet: he is taken to believe nothing.
/// assert_eq!((believer.len(1), believer.head(1).present), (0, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Believer {
    robot: Robot,
    /// Perspectives 1, 2, …: each is made from an earlier one.
    others: Vec<Other>,
    header: Header,
    at: Instant,
    /// Frames that were taken as of another instant than they alleged.
    untimely: u64,
    computed: Perspectives,
}

#[derive(Clone)]
struct Other {
    path: Path,
    /// The number of the perspective that it is made from.
    within: usize,
    partner: Partner,
}

impl Believer {
    /// Nothing believed yet. Perspectives are nested `depth` deep: 1 is what each partner believes.
    /// `capacity` is that of a frame of observations and of each belief system.
    ///
    /// # Errors
    ///
    /// The configuration's percepts, beliefs or cones cannot be, or there would be too many
    /// perspectives, or too deep ones.
    pub fn new(
        percepts: &Percepts,
        config: &Perspective,
        partners: u32,
        depth: u32,
        capacity: usize,
    ) -> Result<Self, Unbelieving> {
        Self::with_own(percepts, &Own::default(), config, partners, depth, capacity)
    }

    /// The same with the program's own percepts and functions of the Belief System: every perspective
    /// has them.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    ///
    /// ```
    /// use std::sync::Arc;
    ///
    /// use belief::{Cull, Doubtful};
    /// use belief_process::{Believer, Own};
    /// use config::percepts::Percepts;
    /// use config::perspective::Perspective;
    ///
    /// /// Nobody forgets what somebody has in hand.
    /// struct InNobodysHand;
    ///
    /// impl Cull for InNobodysHand {
    ///     fn agrees(&self, belief: &Doubtful<'_>) -> bool {
    ///         belief.held_by() == message::NOBODY
    ///     }
    /// }
    ///
    /// let text = std::fs::read_to_string("../../config/percepts.toml")?;
    /// let text = text + "\n[[belief.cull]]\nwhen = { own = \"in nobody's hand\" }\n";
    /// let percepts = Percepts::parse(&text, "percepts.toml".as_ref())?;
    /// assert!(Believer::new(&percepts, &Perspective::builtin(), 1, 1, 64).is_err());
    ///
    /// let mut own = Own::default();
    /// own.functions.culls.push(("in nobody's hand".to_owned(), Arc::new(InNobodysHand)));
    /// let believer = Believer::with_own(&percepts, &own, &Perspective::builtin(), 1, 1, 64)?;
    /// assert_eq!(believer.perspectives(), 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_own(
        percepts: &Percepts,
        own: &Own,
        config: &Perspective,
        partners: u32,
        depth: u32,
        capacity: usize,
    ) -> Result<Self, Unbelieving> {
        let perspectives = Nested::all(partners, depth)?;
        // There are fewer partners than perspectives.
        let partners = usize::try_from(partners).map_or(u16::MAX, saturating_u16);
        let perception = Perception::with_own(percepts, &own.percepts)?;
        let robot = Robot::with_own(percepts, &own.functions, config, partners, capacity)?;
        let other = |(number, nested): (usize, &Nested)| {
            let Nested { path, within } = *nested;
            let agent = path.agent().unwrap_or(0);
            let partner =
                Partner::with_own(agent, perception.clone(), percepts, &own.functions, config, capacity)?;
            let contains = perspectives.iter().any(|nested| nested.within == number);
            let partner = if contains { partner.with_awareness(config, partners, capacity) } else { partner };
            Ok(Other { path, within, partner })
        };
        let others =
            perspectives.iter().enumerate().skip(1).map(other).collect::<Result<_, NoPerspective>>()?;
        let mut computed =
            Perspectives { count: u64::from(saturating_u32(perspectives.len())), ..Perspectives::default() };
        for (counts, nested) in computed.perspectives.iter_mut().zip(&perspectives) {
            counts.path = nested.path;
        }
        Ok(Self { robot, others, header: Header::default(), at: Instant::EPOCH, untimely: 0, computed })
    }

    /// Brings every perspective to the instant that a frame of the percept buffer speaks about.
    ///
    /// A frame that claims to come from the future counts as of `now`, and one older than its predecessor as of that
    /// one, and both are [counted](Self::untimely): beliefs never run backwards. What none of the sources that
    /// looked saw before does not vanish in it.
    pub fn step(&mut self, now: Instant, head: &PerceptHead, entries: &[Perceived]) {
        let header = &head.header;
        let alleged = Instant::from_nanos(header.valid_at_ns);
        self.at = alleged.min(now).max(self.at);
        self.untimely += u64::from(self.at != alleged);
        self.header = Header { valid_at_ns: self.at.as_nanos(), ..header.onwards() };
        self.robot.step(self.at, head.looked(), entries);
        self.count(0);
        for index in 0..self.others.len() {
            let Some((earlier, [other, ..])) = self.others.split_at_mut_checked(index) else { return };
            let awareness = match other.within.checked_sub(1) {
                None => Some(self.robot.awareness()),
                Some(index) => earlier.get(index).and_then(|parent| parent.partner.awareness()),
            };
            // A perspective that contains others is aware: `new` saw to it.
            if let Some(awareness) = awareness {
                let (robot, within) = (&self.robot, other.within);
                let surveyed = |place: &Position<Base>| all_survey(robot, earlier, within, place);
                other.partner.step(self.at, entries, awareness, surveyed);
                self.count(saturating_u32(index + 1));
            }
        }
    }

    /// Frames that were ahead of now, or older than the one before.
    #[must_use]
    pub fn untimely(&self) -> u64 {
        self.untimely
    }

    /// What was computed of each perspective, counted where it is computed.
    #[must_use]
    pub fn computed(&self) -> &Perspectives {
        &self.computed
    }

    fn count(&mut self, perspective: u32) {
        let (head, beliefs) = (self.head(perspective), self.len(perspective));
        let counts =
            usize::try_from(perspective).ok().and_then(|index| self.computed.perspectives.get_mut(index));
        if let Some(counts) = counts {
            counts.steps += 1;
            counts.beliefs += u64::from(saturating_u32(beliefs));
            (counts.left_out, counts.refused) = (head.overflowed, head.refused);
        }
    }

    /// How many perspectives there are, the robot's among them.
    #[must_use]
    pub fn perspectives(&self) -> u32 {
        saturating_u32(self.others.len()).saturating_add(1)
    }

    /// The head of a perspective's belief buffer. Of a perspective that there is not, the head
    /// says that it is absent.
    #[must_use]
    pub fn head(&self, perspective: u32) -> BeliefHead {
        match self.other(perspective) {
            None if perspective == 0 => self.robot.head(self.header),
            None => BeliefHead::of(perspective, self.header),
            Some(Other { path, partner, .. }) => {
                let mut head = partner.head(self.header);
                head.perspective = perspective;
                head.path = *path;
                // What the robot could not use, it could not hand on.
                head.refused = head.refused.saturating_add(self.robot.refused());
                head
            }
        }
    }

    /// How many objects a perspective believes in.
    #[must_use]
    pub fn len(&self, perspective: u32) -> usize {
        match self.other(perspective) {
            None if perspective == 0 => self.robot.beliefs().len(),
            None => 0,
            Some(other) => other.partner.beliefs().len(),
        }
    }

    /// The perspective that one is made from and nested in, by its number; `None` for the robot's
    /// own, and where there is none.
    #[must_use]
    pub fn within(&self, perspective: u32) -> Option<u32> {
        Some(saturating_u32(self.other(perspective)?.within))
    }

    /// Whether a perspective believes in no object.
    #[must_use]
    pub fn is_empty(&self, perspective: u32) -> bool {
        self.len(perspective) == 0
    }

    /// A belief of a perspective, in the order of identities, evaluated at the frame's instant
    /// (of an absent partner, at the last instant at which he was present).
    #[must_use]
    pub fn entry(&self, perspective: u32, index: usize) -> Option<Belief> {
        match self.other(perspective) {
            None if perspective == 0 => self.robot.entry(index),
            None => None,
            Some(other) => other.partner.entry(index),
        }
    }

    fn other(&self, perspective: u32) -> Option<&Other> {
        let index = usize::try_from(perspective.checked_sub(1)?).ok()?;
        self.others.get(index)
    }
}

/// Whether the perspective of a number, and all within which it is, would notice that a thing is gone
/// from a place.
fn all_survey(robot: &Robot, others: &[Other], number: usize, place: &Position<Base>) -> bool {
    match number.checked_sub(1) {
        None => robot.surveys(place),
        Some(index) => others.get(index).is_some_and(|other| {
            other.partner.surveys(place) && all_survey(robot, others, other.within, place)
        }),
    }
}

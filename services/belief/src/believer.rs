use clock::Instant;
use config::percepts::Percepts;
use config::perspective::Perspective;
use message::{Belief, BeliefHead, Header, Hop, Perceived};
use perception::{Own, Perception, Unperceivable};
use perspective::{NoPerspective, Partner, Robot};

/// Why nothing can be believed.
#[derive(Debug, thiserror::Error)]
pub enum Unbelieving {
    /// The percepts cannot be evaluated.
    #[error(transparent)]
    Percepts(#[from] Unperceivable),
    /// A perspective cannot be made.
    #[error(transparent)]
    Perspective(#[from] NoPerspective),
    /// There are more partners than agent numbers.
    #[error("{partners} partners are too many: at most {most} can be told apart")]
    Partners {
        /// The number asked for.
        partners: u32,
        /// The number that can be.
        most: u16,
    },
}

/// Partners that can be told apart; the highest agent number stands for nobody.
const PARTNERS_MOST: u16 = message::NOBODY - 1;

/// What the robot believes, and what it takes each of its partners to believe.
///
/// Perspective 0 is the robot's own, n that of partner n. Without partners nothing of anybody
/// else's perspective is computed. Allocates in `new` alone.
///
/// ```
/// use belief_process::Believer;
/// use clock::Instant;
/// use message::{Header, Observation, Perceived};
///
/// let percepts = config::percepts::Percepts::builtin();
/// let perspective = config::perspective::Perspective::builtin();
/// let perception = perception::Perception::new(&percepts)?;
/// let mut believer = Believer::new(&percepts, &perspective, 1, 16)?;
///
/// let observation = Observation { half_extents_m: [0.03; 3], ..Observation::object(0, 1_000) };
/// let snapshot = perception.perceive(&observation, &perception::Frame { agent: 0 });
/// let now = Instant::from_nanos(2_000);
/// believer.step(now, &Header::at(1_000), &[Perceived { observation, snapshot }]);
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
    partners: Vec<Partner>,
    header: Header,
    at: Instant,
}

impl Believer {
    /// Nothing believed yet. `capacity` is that of a frame of observations and of each belief
    /// system.
    ///
    /// # Errors
    ///
    /// The configuration's percepts, beliefs or cones cannot be, or there are too many partners.
    pub fn new(
        percepts: &Percepts,
        config: &Perspective,
        partners: u32,
        capacity: usize,
    ) -> Result<Self, Unbelieving> {
        Self::with_own(percepts, &Own::new(), config, partners, capacity)
    }

    /// The same with the program's own percepts.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn with_own(
        percepts: &Percepts,
        own: &Own,
        config: &Perspective,
        partners: u32,
        capacity: usize,
    ) -> Result<Self, Unbelieving> {
        let last = u16::try_from(partners)
            .ok()
            .filter(|last| *last <= PARTNERS_MOST)
            .ok_or(Unbelieving::Partners { partners, most: PARTNERS_MOST })?;
        let perception = Perception::with_own(percepts, own)?;
        let robot = Robot::new(percepts, config, last, capacity)?;
        let partners = (1..=last)
            .map(|agent| Partner::new(agent, perception.clone(), percepts, config, capacity))
            .collect::<Result<_, _>>()?;
        Ok(Self { robot, partners, header: Header::default(), at: Instant::EPOCH })
    }

    /// Brings every perspective to the instant that a frame of the percept buffer speaks about.
    ///
    /// A frame that claims to come from the future counts as of `now`, and one older than its
    /// predecessor as of that one: beliefs never run backwards. A frame that passed no
    /// [`Hop::Observed`] was observed by nobody: nothing vanishes in it.
    pub fn step(&mut self, now: Instant, header: &Header, entries: &[Perceived]) {
        self.at = Instant::from_nanos(header.valid_at_ns).min(now).max(self.at);
        self.header = Header { valid_at_ns: self.at.as_nanos(), ..header.onwards() };
        self.robot.step(self.at, header.passed(Hop::Observed).is_some(), entries);
        for partner in &mut self.partners {
            partner.step(self.at, entries, self.robot.awareness());
        }
    }

    /// How many perspectives there are: the robot's, and one for each partner.
    #[must_use]
    pub fn perspectives(&self) -> u32 {
        // `new` has counted the partners in 16 bits.
        quantity::number::saturating_u32(self.partners.len()).saturating_add(1)
    }

    /// The head of a perspective's belief buffer. Of a perspective that there is not, the head
    /// says that it is absent.
    #[must_use]
    pub fn head(&self, perspective: u32) -> BeliefHead {
        match self.partner(perspective) {
            None if perspective == 0 => self.robot.head(self.header),
            None => BeliefHead::of(perspective, self.header),
            Some(partner) => {
                let mut head = partner.head(self.header);
                // What the robot could not use, it could not hand on.
                head.refused = head.refused.saturating_add(self.robot.refused());
                head
            }
        }
    }

    /// How many objects a perspective believes in.
    #[must_use]
    pub fn len(&self, perspective: u32) -> usize {
        match self.partner(perspective) {
            None if perspective == 0 => self.robot.beliefs().len(),
            None => 0,
            Some(partner) => partner.beliefs().len(),
        }
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
        match self.partner(perspective) {
            None if perspective == 0 => self.robot.entry(index),
            None => None,
            Some(partner) => partner.entry(index),
        }
    }

    fn partner(&self, perspective: u32) -> Option<&Partner> {
        let index = usize::try_from(perspective.checked_sub(1)?).ok()?;
        self.partners.get(index)
    }
}

use belief::{BeliefSystem, Functions};
use clock::Instant;
use config::percepts::Percepts;
use config::perspective::Perspective;
use geometry::{Base, Eye, Person, Pose, Position};
use message::{Belief, BeliefHead, Header, Perceived};
use perception::{Frame, Perception};
use quantity::number::saturating_u32;
use scene::{Cone, Occluders, Samples, Sight};

use crate::field::{glimpses, surveys};
use crate::robot::is_object;
use crate::senses::Senses;
use crate::transform::place_in_base;
use crate::{Anchor, Awareness, NoPerspective, Owners};

/// What the robot takes a partner to perceive and to believe, or what a partner takes another, or
/// the robot, to.
///
/// Allocates in `new` and in [`Self::with_awareness`] alone.
#[derive(Clone)]
pub struct Partner {
    senses: Senses,
    system: BeliefSystem,
    empty_margin_m: f64,
    anchor: Anchor,
    owners: Owners,
    eye: Option<Pose<Base, Eye>>,
    present: bool,
    /// The last instant at which he was present: his beliefs are those of then.
    at: Instant,
    /// What perspectives within his are made from, if there are any.
    awareness: Option<Awareness>,
}

impl Partner {
    /// Partner `agent` (1, 2, …; within a partner's perspective also the robot, 0), of whom nothing
    /// is known yet, with the Perception System made from the same percepts. `capacity` is that of
    /// a frame of observations and of his belief system. Allocates all that it will ever need.
    ///
    /// # Errors
    ///
    /// The configuration's beliefs or cone cannot be.
    pub fn new(
        agent: u16,
        perception: Perception,
        percepts: &Percepts,
        config: &Perspective,
        capacity: usize,
    ) -> Result<Self, NoPerspective> {
        Self::with_own(agent, perception, percepts, &Functions::default(), config, capacity)
    }

    /// The same with a belief system that has the program's own functions.
    ///
    /// # Errors
    ///
    /// As [`Self::new`].
    pub fn with_own(
        agent: u16,
        perception: Perception,
        percepts: &Percepts,
        functions: &Functions,
        config: &Perspective,
        capacity: usize,
    ) -> Result<Self, NoPerspective> {
        let sight = &config.sight;
        let cone = Cone::new(sight.cone_half_angle_deg.radians(), sight.range_m.get())
            .map_err(|source| NoPerspective::Cone { agent, source })?;
        Ok(Self {
            senses: Senses {
                frame: Frame { agent },
                perception,
                sight: Sight::new(Pose::identity(), cone, &Occluders::new(config.occluders.most.get())),
                samples: match sight.samples {
                    config::perspective::Samples::Centre => Samples::Centre,
                    config::perspective::Samples::Faces => Samples::Faces,
                    config::perspective::Samples::Corners => Samples::Corners,
                },
                hearing_range_m: sight.hearing_range_m.get(),
                of_occluders: false,
                visible: Vec::with_capacity(capacity),
                perceived: Vec::with_capacity(capacity),
                hidden: 0,
                refused: 0,
            },
            system: BeliefSystem::with_own(percepts, functions, capacity)
                .map_err(|source| NoPerspective::Belief { agent, source })?
                .trusting(),
            empty_margin_m: sight.empty_margin_m.get(),
            anchor: Anchor::new(config.frame.reanchor_m.get(), config.frame.reanchor_deg.radians()),
            owners: Owners::new(&config.resource, capacity).of(agent),
            eye: None,
            present: false,
            at: Instant::EPOCH,
            awareness: None,
        })
    }

    /// The same, noting what he is aware of: perspectives within his can be made from it. Then he
    /// also perceives occluders, and the eyes of the robot and of up to `partners` partners.
    #[must_use]
    pub fn with_awareness(mut self, config: &Perspective, partners: u16, capacity: usize) -> Self {
        self.senses.of_occluders = true;
        self.awareness = Some(Awareness::new(self.agent(), config, partners, capacity));
        self
    }

    /// What he is aware of; `None` unless it is noted.
    #[must_use]
    pub fn awareness(&self) -> Option<&Awareness> {
        self.awareness.as_ref()
    }

    /// One instant, as he perceives it, out of what the perspective that contains his is aware of
    /// (`entries` are those that `parent` took note of).
    ///
    /// `surveyed` says of a place whether all those within whose perspectives his is would notice
    /// that a thing is gone from there, from the robot ([`crate::Robot::surveys`]) to the parent
    /// ([`Self::surveys`]). What the parent does not see he cannot take another to miss: the thing
    /// may be where it was.
    ///
    /// While he is absent, or his pose is unknown, nothing happens to his beliefs, nor to those
    /// within his.
    pub fn step(
        &mut self,
        at: Instant,
        entries: &[Perceived],
        parent: &Awareness,
        surveyed: impl Fn(&Position<Base>) -> bool,
    ) {
        let eye = parent.eye(self.agent(), at);
        let was_present = std::mem::replace(&mut self.present, eye.is_some());
        let Some(x_base_eye) = eye else {
            let aware = entries.iter().zip(parent.perceives());
            self.senses.perceived.clear();
            self.senses.hidden = aware.filter(|(entry, perceives)| **perceives && is_object(entry)).count();
            if let Some(awareness) = &mut self.awareness {
                awareness.lose();
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
        self.senses.sight.look(&x_base_eye, parent.occluders());
        let mut intake = self.system.begin(at);
        self.senses.perceive(entries, parent, &x_base_person, |index, perceived| {
            intake.take_in(index, perceived);
        });
        let Senses { sight, perceived, visible, .. } = &self.senses;
        if let Some(awareness) = &mut self.awareness {
            awareness.note(at, parent.looked(), entries, visible.iter().copied());
            know(awareness, sight, at, parent, x_base_eye);
        }
        let margin_m = self.empty_margin_m;
        intake.finish(perceived, parent.looked(), |place_m| {
            let place = place_in_base(&x_base_person, place_m);
            surveys(sight, &place, margin_m) && surveyed(&place)
        });
        let agents = parent.eyes(at).map(|(agent, met)| (agent, met.x_base_eye.origin()));
        self.owners.judge_system(&self.system, at, &x_base_person, agents);
    }

    /// Who he is: 1, 2, …, or 0 the robot.
    #[must_use]
    pub fn agent(&self) -> u16 {
        self.senses.frame.agent
    }

    /// Whether he could perceive anything at the last step's instant.
    #[must_use]
    pub fn is_present(&self) -> bool {
        self.present
    }

    /// Whether he would notice, as he looks now, that a thing is gone from a place.
    #[must_use]
    pub fn surveys(&self, place: &Position<Base>) -> bool {
        self.present && surveys(&self.senses.sight, place, self.empty_margin_m)
    }

    /// His frame, if he was ever perceived.
    #[must_use]
    pub fn frame(&self) -> Option<Pose<Base, Person>> {
        self.anchor.frame()
    }

    /// What he believes, in his frame.
    #[must_use]
    pub fn beliefs(&self) -> &BeliefSystem {
        &self.system
    }

    /// The head of his belief buffer. Frame and eye are the last known ones; `perceivable` and
    /// `hidden` count observations of objects.
    #[must_use]
    pub fn head(&self, header: Header) -> BeliefHead {
        let counts = self.system.counts();
        let mut head = BeliefHead::of(u32::from(self.senses.frame.agent), header);
        if let Some(x_base_person) = self.anchor.frame() {
            head.frame_position_m = x_base_person.position_m();
            head.frame_orientation_xyzw = x_base_person.orientation_xyzw();
        }
        if let Some(x_base_eye) = self.eye {
            head.eye_position_m = x_base_eye.position_m();
            head.eye_orientation_xyzw = x_base_eye.orientation_xyzw();
        }
        head.present = u32::from(self.present);
        head.perceivable = saturating_u32(self.senses.perceived.len());
        head.hidden = saturating_u32(self.senses.hidden);
        head.refused = self.senses.refused.saturating_add(counts.refused());
        head.created = counts.created;
        head.merged = counts.merged;
        head.culled = counts.culled;
        head.overflowed = counts.overflowed + self.awareness.as_ref().map_or(0, Awareness::left_out);
        head
    }

    /// A belief by its place in the order of identities, evaluated at the last instant at which
    /// he was present: while he is not, his beliefs do not even fade.
    #[must_use]
    pub fn entry(&self, index: usize) -> Option<Belief> {
        let mut belief = self.system.write(index, self.at)?;
        belief.owner = self.owners.owner_of(index, belief.id);
        Some(belief)
    }
}

/// He knows of those whose eyes are in his view, of all whom his parent sees, and of the parent itself: you know
/// that I see only while you see me. And of what hides things from whoever is in his mind.
fn know(
    awareness: &mut Awareness,
    sight: &Sight,
    at: Instant,
    parent: &Awareness,
    x_base_eye: Pose<Base, Eye>,
) {
    awareness.have_eye(x_base_eye);
    for (agent, met) in parent.eyes(at) {
        if sight.sees(&met.x_base_eye.origin()) {
            awareness.meet(agent, met);
        }
    }
    // What the parent remembers stands there, as far as anybody in his mind is concerned.
    let glimpses = |x_base_box: &_, half_extents_m| glimpses(sight, x_base_box, half_extents_m);
    awareness.forget(at, glimpses, |x_base_box| parent.remembers(x_base_box));
}

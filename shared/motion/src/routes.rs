//! The way of each skill, phase by phase.

use geometry::{Base, Position};
use kinematics::Side;

use crate::draft::Draft;
use crate::model::Stance;
use crate::parts::set;
use crate::plan::Await;
use crate::{Face, Phase, Refusal, Skill};

/// An empty hand above the table is at least this high, in metres: blocks are up to 0.10 tall.
const SAFE_M: f64 = 0.22;
/// An empty hand passes at least this far above what it comes for, in metres.
const OVER_M: f64 = 0.04;
/// The lower end of what is carried passes at least this high, in metres.
const CLEAR_M: f64 = 0.12;
/// A hand below this, in metres, is lifted out of the blocks before anything else.
const LOW_M: f64 = 0.18;
/// How deep a long peg goes into a hole, in metres.
const DEPTH_MOST_M: f64 = 0.05;

impl Draft<'_> {
    /// Writes a skill into the plan.
    pub(crate) fn skill(&mut self, skill: &Skill) -> Result<(), Refusal> {
        match skill {
            Skill::Insert { thing, half_height_m, hole } => {
                check(&[*thing, *hole], *half_height_m)?;
                let lower_end_m = hole.point().z - half_height_m.min(DEPTH_MOST_M);
                self.carry(thing, *half_height_m, &at_height(hole, lower_end_m + half_height_m))
            }
            Skill::Place { thing, half_height_m, to } => {
                check(&[*thing, *to], *half_height_m)?;
                self.carry(thing, *half_height_m, to)
            }
            Skill::LookAt(target) => {
                check(&[*target], 0.0)?;
                self.restart();
                self.look(target);
                self.push(Phase::Look, Await::Moved)
            }
            Skill::Rest => {
                self.restart();
                self.raise_low_hands()?;
                self.rest(Await::Moved)
            }
            Skill::Show(face) => self.show(*face),
        }
    }

    /// Takes a thing at its centre and puts it down with the centre at `to`: by the nearer arm if
    /// that gets there, by the other or with the torso's help if not.
    fn carry(
        &mut self,
        thing: &Position<Base>,
        half_height_m: f64,
        to: &Position<Base>,
    ) -> Result<(), Refusal> {
        let leftness = thing.point().y + to.point().y;
        let sides = if leftness >= 0.0 { [Side::Left, Side::Right] } else { [Side::Right, Side::Left] };
        let mut first = None;
        for stance in &self.model.stances {
            for side in sides {
                match self.carry_by(side, stance, thing, half_height_m, to) {
                    Ok(()) => return Ok(()),
                    // The first way tried is the plainest: its reason is the one to tell.
                    Err(why) => first = first.or(Some(why)),
                }
            }
        }
        first.map_or(Ok(()), Err)
    }

    fn carry_by(
        &mut self,
        side: Side,
        stance: &Stance,
        thing: &Position<Base>,
        half_height_m: f64,
        to: &Position<Base>,
    ) -> Result<(), Refusal> {
        let higher = thing.point().z.max(to.point().z);
        let over_m = SAFE_M.max(higher + half_height_m + OVER_M);
        // On the way from above one thing to above the other it clears both and what stands there.
        let carried_m = over_m.max(CLEAR_M + half_height_m);
        self.restart();
        self.look(thing);
        self.push(Phase::Look, Await::Nothing)?;
        self.raise_low_hands()?;
        self.rest_arms();
        stance.stand(&self.model.parts, self.at);
        let ready = stance.ready(side).ok_or(Refusal::NotReady { side })?;
        self.set_arm(side, ready);
        self.open(side);
        self.look(thing);
        self.push(Phase::Ready, Await::MovedButGaze)?;
        let ready = self.model.body.hand(side, self.at).origin();
        self.line(side, Phase::Hover, &at_height(thing, over_m))?;
        self.line(side, Phase::Descend, thing)?;
        self.close(side);
        self.push(Phase::Close, Await::MovedButGaze)?;
        self.line(side, Phase::Lift, &at_height(thing, carried_m))?;
        self.look(to);
        self.line(side, Phase::Carry, &at_height(to, carried_m))?;
        self.line(side, Phase::Lower, to)?;
        self.open(side);
        self.push(Phase::Open, Await::MovedButGaze)?;
        self.line(side, Phase::Retreat, &at_height(to, over_m))?;
        self.line(side, Phase::Rest, &ready)?;
        self.rest(Await::MovedButGaze)
    }

    /// Brings everything but the face to rest.
    fn rest(&mut self, awaits: Await) -> Result<(), Refusal> {
        self.rest_arms();
        for joint in self.model.parts.gaze().into_iter().chain(self.model.parts.torso()) {
            self.rest_joint(joint);
        }
        self.push(Phase::Rest, awaits)
    }

    /// Sets both arms and hands to rest.
    fn rest_arms(&mut self) {
        for side in Side::BOTH {
            self.open(side);
            for joint in self.model.body.arm_joints(side) {
                self.rest_joint(joint);
            }
        }
    }

    fn rest_joint(&mut self, joint: usize) {
        set(self.at, joint, self.model.rest_rad.get(joint).copied().unwrap_or(0.0));
    }

    /// Lifts hands out of the blocks that a skill given up has left there.
    fn raise_low_hands(&mut self) -> Result<(), Refusal> {
        for side in Side::BOTH {
            if self.model.body.hand(side, self.at).origin().point().z < LOW_M {
                self.raise(side, SAFE_M)?;
            }
        }
        Ok(())
    }

    fn show(&mut self, face: Face) -> Result<(), Refusal> {
        self.restart();
        for (joint, position_rad) in self.model.parts.face.iter().zip(face.positions_rad()) {
            set(self.at, *joint, self.model.limited(*joint, position_rad));
        }
        self.push(Phase::Face, Await::Moved)
    }
}

fn at_height(point: &Position<Base>, height_m: f64) -> Position<Base> {
    let [x, y, _] = point.to_array();
    Position::new(x, y, height_m)
}

fn check(points: &[Position<Base>], half_height_m: f64) -> Result<(), Refusal> {
    let finite = points.iter().flat_map(Position::to_array).all(f64::is_finite);
    // Written so that NaN fails.
    if finite && half_height_m >= 0.0 && half_height_m.is_finite() { Ok(()) } else { Err(Refusal::NoNumber) }
}

//! The path of each skill, phase by phase.

use geometry::{Base, Position};
use invariant::require;
use kinematics::Side;

use crate::model::Stance;
use crate::parts::set;
use crate::plan::WaitFor;
use crate::plan_builder::PlanBuilder;
use crate::{Face, Phase, Skill, SkillError, Turn};

/// Minimum height of an empty hand above the table, in metres: blocks are up to 0.10 m tall.
const SAFE_M: f64 = 0.22;
/// Minimum height of an empty hand above the object to grasp, in metres.
const OVER_M: f64 = 0.04;
/// Minimum height of the lower end of a carried object, in metres.
const CLEAR_M: f64 = 0.12;
/// A hand below this height, in metres, is raised out of the blocks first.
const LOW_M: f64 = 0.18;
/// Rotations of the hand before grasping, in radians, smallest first.
const GRASP_ROTATIONS_RAD: [f64; 9] = [0.0, -0.35, 0.35, -0.7, 0.7, -1.05, 1.05, -1.4, 1.4];
/// Maximum insertion depth of a long peg, in metres.
const MAX_DEPTH_M: f64 = 0.05;

/// An object to be carried.
struct Load {
    /// Its centre.
    thing: Position<Base>,
    half_height_m: f64,
    /// Target position of its centre.
    to: Position<Base>,
    turn: Option<Turn>,
}

/// Rotations of a hand about the vertical, in radians: before grasping, and with the object.
#[derive(Clone, Copy)]
struct WristRotation {
    grasp_rotation_rad: f64,
    carry_rotation_rad: f64,
}

impl Load {
    /// The possible rotations, simplest first. If the wrist cannot rotate far enough with the object, it can grasp
    /// with another rotation.
    fn wrists(&self) -> impl Iterator<Item = Option<WristRotation>> {
        let turned = self.turn.into_iter().flat_map(|turn| {
            GRASP_ROTATIONS_RAD.into_iter().flat_map(move |grasp_rotation_rad| {
                turn.equivalents().map(move |carry_rotation_rad| {
                    Some(WristRotation { grasp_rotation_rad, carry_rotation_rad })
                })
            })
        });
        let free = if self.turn.is_none() { Some(None) } else { None };
        turned.chain(free)
    }
}

impl PlanBuilder<'_> {
    /// Writes a skill into the plan.
    pub(crate) fn skill(&mut self, skill: &Skill) -> Result<(), SkillError> {
        match skill {
            Skill::Insert { thing, half_height_m, hole } => {
                check(&[*thing, *hole], *half_height_m)?;
                let lower_end_m = hole.point().z - half_height_m.min(MAX_DEPTH_M);
                let to = at_height(hole, lower_end_m + half_height_m);
                self.carry(&Load { thing: *thing, half_height_m: *half_height_m, to, turn: None })
            }
            Skill::Place { thing, half_height_m, to, turn } => {
                check(&[*thing, *to], *half_height_m)?;
                if turn.is_some_and(|turn| !(turn.by_rad.is_finite() && turn.period_rad > 0.0)) {
                    return Err(SkillError::NotFinite);
                }
                self.carry(&Load { thing: *thing, half_height_m: *half_height_m, to: *to, turn: *turn })
            }
            Skill::LookAt(target) => {
                check(&[*target], 0.0)?;
                self.restart();
                self.look(target);
                self.push(Phase::Look, WaitFor::Moved)
            }
            Skill::Hold => {
                self.restart();
                self.push(Phase::Rest, WaitFor::Nothing)
            }
            Skill::Rest => {
                self.restart();
                self.raise_low_hands()?;
                self.rest(WaitFor::Moved)
            }
            Skill::Show(face) => self.show(*face),
        }
    }

    /// Grasps an object at its centre and puts it down elsewhere. It uses the nearer arm if possible, otherwise the
    /// other arm or the torso's help.
    fn carry(&mut self, load: &Load) -> Result<(), SkillError> {
        let leftness = load.thing.point().y + load.to.point().y;
        let sides = if leftness >= 0.0 { [Side::Left, Side::Right] } else { [Side::Right, Side::Left] };
        let mut first = None;
        for stance in &self.model.stances {
            for side in sides {
                for wrist in load.wrists() {
                    match self.carry_by(side, stance, load, wrist) {
                        Ok(()) => return Ok(()),
                        // The first attempt is the simplest, so its error is reported.
                        Err(why) => first = first.or(Some(why)),
                    }
                }
            }
        }
        first.map_or(Ok(()), Err)
    }

    fn carry_by(
        &mut self,
        side: Side,
        stance: &Stance,
        load: &Load,
        wrist: Option<WristRotation>,
    ) -> Result<(), SkillError> {
        let Load { thing, half_height_m, to, .. } = load;
        let higher = thing.point().z.max(to.point().z);
        let over_m = SAFE_M.max(higher + half_height_m + OVER_M);
        // High enough to clear both places and the blocks between them.
        let carried_m = over_m.max(CLEAR_M + half_height_m);
        self.restart();
        self.look(thing);
        self.push(Phase::Look, WaitFor::Nothing)?;
        self.raise_low_hands()?;
        self.rest_arms();
        stance.stand(&self.model.parts, self.at);
        let ready = side.of(stance.ready).ok_or(SkillError::NotReady { side })?;
        self.set_arm(side, ready);
        self.open(side);
        self.look(thing);
        self.push(Phase::Ready, WaitFor::MovedButGaze)?;
        let ready = self.model.body.hand(side, self.at).origin();
        self.line(side, Phase::Hover, &at_height(thing, over_m), None)?;
        if let Some(WristRotation { grasp_rotation_rad, .. }) = wrist {
            self.line(side, Phase::Hover, &at_height(thing, over_m), Some(grasp_rotation_rad))?;
        }
        // From grasp to release the hand rotates like the object.
        let still = wrist.map(|_| 0.0);
        self.line(side, Phase::Descend, thing, still)?;
        self.close(side);
        self.push(Phase::Close, WaitFor::MovedButGaze)?;
        self.line(side, Phase::Lift, &at_height(thing, carried_m), still)?;
        self.look(to);
        let turns = wrist.map(|wrist| wrist.carry_rotation_rad);
        self.line(side, Phase::Carry, &at_height(to, carried_m), turns)?;
        self.line(side, Phase::Lower, to, still)?;
        self.open(side);
        self.push(Phase::Open, WaitFor::MovedButGaze)?;
        self.line(side, Phase::Retreat, &at_height(to, over_m), still)?;
        self.line(side, Phase::Rest, &ready, None)?;
        self.rest(WaitFor::MovedButGaze)
    }

    /// Moves everything except the face to rest.
    fn rest(&mut self, awaits: WaitFor) -> Result<(), SkillError> {
        self.rest_arms();
        for joint in self.model.parts.gaze().into_iter().chain(self.model.parts.torso) {
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
        let rest_rad = require!(self.model.rest_rad.get(joint), "joint {joint} exists");
        set(self.at, joint, rest_rad.copied().unwrap_or(0.0));
    }

    /// Raises hands out of the blocks, where an aborted skill may have left them.
    fn raise_low_hands(&mut self) -> Result<(), SkillError> {
        for side in Side::BOTH {
            if self.model.body.hand(side, self.at).origin().point().z < LOW_M {
                self.raise(side, SAFE_M)?;
            }
        }
        Ok(())
    }

    fn show(&mut self, face: Face) -> Result<(), SkillError> {
        self.restart();
        for (joint, position_rad) in self.model.parts.face.iter().zip(face.positions_rad()) {
            set(self.at, *joint, self.model.limited(*joint, position_rad));
        }
        self.push(Phase::Face, WaitFor::Moved)
    }
}

fn at_height(point: &Position<Base>, height_m: f64) -> Position<Base> {
    let [x, y, _] = point.to_array();
    Position::new(x, y, height_m)
}

fn check(points: &[Position<Base>], half_height_m: f64) -> Result<(), SkillError> {
    let finite = points.iter().flat_map(Position::to_array).all(f64::is_finite);
    // Written so that NaN fails.
    if finite && half_height_m >= 0.0 && half_height_m.is_finite() {
        Ok(())
    } else {
        Err(SkillError::NotFinite)
    }
}

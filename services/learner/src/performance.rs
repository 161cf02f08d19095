//! Performance of a learned task.

mod arrangement_plan;
mod free_space;
mod rule_plan;

use std::collections::BTreeMap;
use std::fmt::Debug;

use clock::{Duration, Instant};
use message::{Event, EventKind};
use motion::{Face, Skill};
use tasks::{Learned, Object, Snapshot};

use crate::vocabulary::Vocabulary;
use crate::{Body, Motion};
use arrangement_plan::ArrangementPlan;
use rule_plan::RulePlan;

/// Maximum time after the end of a skill until the beliefs confirm its effect.
const CONFIRM_TIMEOUT: Duration = Duration::from_millis(1500);
/// Maximum number of retries of a step.
const MAX_RETRIES: usize = 2;
/// An object is the expected one if it has the same class features and is at most this far away, in metres.
const SAME_PLACE_M: f64 = 0.04;

/// Half the heights of objects without perceived extents, in metres.
const BLOCK_HALF_HEIGHT_M: f64 = 0.03;
const PEG_HALF_HEIGHT_M: f64 = 0.025;
const MARKER_HALF_HEIGHT_M: f64 = 0.005;

/// The plan of a performance, step by step.
trait Plan: Debug + Send {
    /// The goal state in words: "filled".
    fn wanted(&self) -> String;

    /// Selects the next step; `None` if nothing is left to do.
    ///
    /// # Errors
    /// The reason, in words, why the work cannot start.
    fn choose(&mut self, vocabulary: &Vocabulary, own: &Snapshot) -> Result<Option<Step>, String>;

    /// The skill for the selected step.
    ///
    /// # Errors
    /// The reason, in words, why there is no such skill.
    fn skill(&self, vocabulary: &Vocabulary, step: &Step, own: &Snapshot) -> Result<Skill, String>;

    /// Whether the selected step has its effect; `None` if its object is not found.
    fn is_done(&self, step: &Step, own: &Snapshot) -> Option<bool>;

    /// Marks the selected step as done.
    fn done(&mut self);

    /// Gives up a step.
    fn give_up(&mut self, step: &Step);

    /// Says which objects of the task are missing, so that fewer steps or none were possible; `None` if there are
    /// enough.
    fn missing(&self, own: &Snapshot) -> Option<String>;
}

/// The performance of a task. It selects a step, executes it, and waits until the robot's beliefs confirm it. A failed
/// step is retried, then given up with a reason.
#[derive(Debug)]
pub(crate) struct Performance {
    pub(crate) task: String,
    plan: Box<dyn Plan>,
    phase: Phase,
    done: u32,
    failed: u32,
}

#[derive(Clone, Debug)]
enum Phase {
    Choosing,
    Acting(Step),
    Confirming(Step, Instant),
    /// Moves to the rest pose before the step is retried.
    Recovering(Step),
}

/// A step: one object to be worked on.
#[derive(Clone, Debug)]
struct Step {
    name: String,
    features: BTreeMap<String, String>,
    /// Its expected position after the step.
    place_m: [f64; 3],
    wanted: String,
    retries: usize,
}

/// The context of a performance step.
pub(crate) struct StepContext<'a, B> {
    pub(crate) now: Instant,
    pub(crate) vocabulary: &'a Vocabulary,
    /// The robot's beliefs; `None` while objects may still be missing after a restart of the belief process.
    pub(crate) own: Option<&'a Snapshot>,
    pub(crate) present_rad: &'a [Option<f64>],
    pub(crate) body: &'a mut B,
    pub(crate) motion: Motion,
}

impl Performance {
    pub(crate) fn new(task: &str, learned: &Learned) -> Self {
        let plan: Box<dyn Plan> = match learned.arrangements.first() {
            Some(rule) => Box::new(ArrangementPlan::new(&rule.arrangement)),
            None => Box::new(RulePlan::new(learned)),
        };
        Self { task: task.to_owned(), plan, phase: Phase::Choosing, done: 0, failed: 0 }
    }

    /// Advances the performance; returns `None` when it has ended.
    pub(crate) fn step<B: Body>(
        mut self,
        context: &mut StepContext<'_, B>,
        events: &mut Vec<Event>,
    ) -> Option<Self> {
        let Some(own) = context.own else { return Some(self) };
        self.phase = match self.phase.clone() {
            Phase::Choosing => match self.plan.choose(context.vocabulary, own) {
                Ok(Some(step)) => {
                    let text = format!("{}, to be {}", step.name, step.wanted);
                    events.push(self.event(EventKind::StepStarted, &text));
                    self.attempt(step, own, context, events)
                }
                Ok(None) => {
                    let missing = self.plan.missing(own);
                    events.push(self.ended(missing.as_deref()));
                    return self.end(missing.is_none(), context);
                }
                Err(why) => {
                    self.failed += 1;
                    events.push(self.event(EventKind::StepFailed, &why));
                    events.push(self.ended(None));
                    return self.end(false, context);
                }
            },
            Phase::Acting(step) => match context.motion.clone() {
                Motion::Running => Phase::Acting(step),
                Motion::Done => Phase::Confirming(step, context.now + CONFIRM_TIMEOUT),
                Motion::Failed { why } => self.retry(step, &why, context, events),
            },
            Phase::Confirming(step, until) => {
                let is_done = self.plan.is_done(&step, own);
                if is_done == Some(true) {
                    self.done += 1;
                    self.plan.done();
                    let text = format!("{} {}", step.name, step.wanted);
                    events.push(self.event(EventKind::StepDone, &text));
                    Phase::Choosing
                } else if context.now < until {
                    Phase::Confirming(step, until)
                } else {
                    let why = match is_done {
                        Some(_) => format!("the {} is still not {}", step.name, step.wanted),
                        None => format!("the {} is not where it should be", step.name),
                    };
                    self.retry(step, &why, context, events)
                }
            }
            Phase::Recovering(step) => match &context.motion {
                Motion::Running => Phase::Recovering(step),
                Motion::Done | Motion::Failed { .. } => self.attempt(step, own, context, events),
            },
        };
        Some(self)
    }

    /// Gives up the current step. Returns the object's name and the event; `None` if there is no current step.
    pub(crate) fn skip(&mut self) -> Option<(String, Event)> {
        let step = match &self.phase {
            Phase::Choosing => return None,
            Phase::Acting(step) | Phase::Confirming(step, _) | Phase::Recovering(step) => step.clone(),
        };
        self.failed += 1;
        self.plan.give_up(&step);
        self.phase = Phase::Choosing;
        let event = self.event(EventKind::StepFailed, &format!("{}: not that one", step.name));
        Some((step.name, event))
    }

    /// The event for a performance that was stopped.
    pub(crate) fn stopped(&self) -> Event {
        let text = format!("stopped: {} {}", self.plan.wanted(), self.done);
        self.event(EventKind::PerformanceEnded, &text)
    }

    /// Shows the face for complete or incomplete success.
    fn end<B: Body>(&self, is_all: bool, context: &mut StepContext<'_, B>) -> Option<Self> {
        let face = if is_all && self.failed == 0 { Face::Pleased } else { Face::Puzzled };
        context.body.begin(context.now, Skill::Show(face), context.present_rad);
        None
    }

    fn attempt<B: Body>(
        &mut self,
        step: Step,
        own: &Snapshot,
        context: &mut StepContext<'_, B>,
        events: &mut Vec<Event>,
    ) -> Phase {
        match self.plan.skill(context.vocabulary, &step, own) {
            Ok(skill) => {
                context.body.begin(context.now, skill, context.present_rad);
                Phase::Acting(step)
            }
            Err(why) => self.give_up(&step, &why, events),
        }
    }

    fn retry<B: Body>(
        &mut self,
        mut step: Step,
        why: &str,
        context: &mut StepContext<'_, B>,
        events: &mut Vec<Event>,
    ) -> Phase {
        context.body.begin(context.now, Skill::Rest, context.present_rad);
        if step.retries < MAX_RETRIES {
            step.retries += 1;
            Phase::Recovering(step)
        } else {
            self.give_up(&step, why, events)
        }
    }

    fn give_up(&mut self, step: &Step, why: &str, events: &mut Vec<Event>) -> Phase {
        self.failed += 1;
        self.plan.give_up(step);
        events.push(self.event(EventKind::StepFailed, &format!("{}: {why}", step.name)));
        Phase::Choosing
    }

    fn ended(&self, missing: Option<&str>) -> Event {
        let wanted = self.plan.wanted();
        let all = self.done + self.failed;
        // Without any matching object "everything is filled" would be vacuous, so the missing objects are named.
        let text = match (all, missing) {
            (0, None) => format!("nothing to do: everything is {wanted}"),
            (0, Some(missing)) => format!("nothing to do: {missing}"),
            (_, None) => format!("{wanted} {} of {all}", self.done),
            (_, Some(missing)) => format!("{wanted} {} of {all}: {missing}", self.done),
        };
        self.event(EventKind::PerformanceEnded, &text)
    }

    fn event(&self, kind: EventKind, text: &str) -> Event {
        let mut event = Event::new(kind, &self.task, text);
        event.succeeded = self.done;
        event
    }
}

fn half_height_m(object: &Object) -> Option<f64> {
    object.half_extents_m.map(|[_, _, z]| z).filter(|&half| half > 0.0)
}

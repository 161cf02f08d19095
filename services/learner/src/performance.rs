use std::collections::{BTreeMap, BTreeSet};

use clock::{Duration, Instant};
use geometry::Position;
use message::{Event, EventKind};
use tasks::{Effect, Learned, Object, Rule, Snapshot, describe_object};

use crate::report::expectation;
use crate::vocabulary::{Insertion, Vocabulary};
use crate::{Body, Motion, Skill};

/// An effect that the beliefs do not confirm this long after the skill ended has not come about.
const CONFIRM: Duration = Duration::from_millis(1500);
/// How often a step is tried again.
const RETRIES: usize = 2;
/// An object is the one meant when it looks the same and is no further away than this, in metres.
const SAME_PLACE_M: f64 = 0.04;

/// Half the height of a thing whose extents are not perceived, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HalfHeights {
    pub(crate) block_m: f64,
    pub(crate) peg_m: f64,
    pub(crate) marker_m: f64,
}

/// Leo performing a task: the objects that its rules are about and that are not as they should
/// be are worked off, the nearest first.
#[derive(Clone, Debug)]
pub(crate) struct Performance {
    pub(crate) task: String,
    rules: Vec<Rule>,
    /// What the teachers' pegs and markers were like.
    kinds: BTreeSet<BTreeMap<String, String>>,
    phase: Phase,
    done: u32,
    /// Places of objects that were given up.
    given_up: Vec<[f64; 3]>,
}

#[derive(Clone, Debug)]
enum Phase {
    Choosing,
    Acting(Step),
    Confirming(Step, Instant),
    /// Coming to rest before a step is tried again.
    Recovering(Step),
}

/// One object to be worked on.
#[derive(Clone, Debug)]
struct Step {
    name: String,
    features: BTreeMap<String, String>,
    place_m: [f64; 3],
    rule: Rule,
    retries: usize,
}

/// What a performance needs to know and may move.
pub(crate) struct Stage<'a, B> {
    pub(crate) now: Instant,
    pub(crate) vocabulary: &'a Vocabulary,
    pub(crate) half_heights: HalfHeights,
    /// What the robot believes; `None` while it may not have found everything yet.
    pub(crate) own: Option<&'a Snapshot>,
    pub(crate) present_rad: &'a [Option<f64>],
    pub(crate) body: &'a mut B,
    pub(crate) motion: Motion,
}

impl Performance {
    pub(crate) fn new(task: &str, learned: &Learned) -> Self {
        Self {
            task: task.to_owned(),
            rules: learned.primary().cloned().collect(),
            kinds: learned.means.iter().flat_map(|means| means.kinds.iter().cloned()).collect(),
            phase: Phase::Choosing,
            done: 0,
            given_up: Vec::new(),
        }
    }

    /// Goes on; gives the performance back unless it has ended.
    pub(crate) fn step<B: Body>(mut self, stage: &mut Stage<'_, B>, events: &mut Vec<Event>) -> Option<Self> {
        let Some(own) = stage.own else { return Some(self) };
        self.phase = match self.phase.clone() {
            Phase::Choosing => match self.choose(stage.vocabulary, own) {
                Some(step) => {
                    let text = format!("{}, to be {}", step.name, expectation(&step.rule));
                    events.push(self.event(EventKind::StepStarted, &text));
                    self.attempt(step, own, stage, events)
                }
                None => {
                    events.push(self.ended());
                    let mood = if self.given_up.is_empty() { Skill::Pleased } else { Skill::Puzzled };
                    stage.body.begin(stage.now, mood, stage.present_rad);
                    return None;
                }
            },
            Phase::Acting(step) => match stage.motion.clone() {
                Motion::Running => Phase::Acting(step),
                Motion::Done => Phase::Confirming(step, stage.now + CONFIRM),
                Motion::Failed { why } => self.retry(step, &why, stage, events),
            },
            Phase::Confirming(step, until) => {
                let object = own.nearest(&step.features, step.place_m, SAME_PLACE_M);
                if object.is_some_and(|object| step.rule.is_done(object)) {
                    self.done += 1;
                    let text = format!("{} {}", step.name, expectation(&step.rule));
                    events.push(self.event(EventKind::StepDone, &text));
                    Phase::Choosing
                } else if stage.now < until {
                    Phase::Confirming(step, until)
                } else {
                    let why = match object {
                        Some(_) => format!("the {} is still not {}", step.name, expectation(&step.rule)),
                        None => format!("the {} is no longer where it was", step.name),
                    };
                    self.retry(step, &why, stage, events)
                }
            }
            Phase::Recovering(step) => match &stage.motion {
                Motion::Running => Phase::Recovering(step),
                Motion::Done | Motion::Failed { .. } => self.attempt(step, own, stage, events),
            },
        };
        Some(self)
    }

    /// The open object nearest to the robot.
    fn choose(&self, vocabulary: &Vocabulary, own: &Snapshot) -> Option<Step> {
        let open = self.rules.iter().flat_map(|rule| rule.open(own).map(move |object| (rule, object)));
        let (_, place_m, rule, object) = open
            .filter_map(|(rule, object)| {
                let place_m = object.position_m.filter(|_| !self.is_given_up(object))?;
                Some((object.distance([0.0; 3])?, place_m, rule, object))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let like = own.objects.iter().filter(|other| other.states.keys().eq(object.states.keys()));
        Some(Step {
            name: describe_object(&vocabulary.language, object, like),
            features: object.features.clone(),
            place_m,
            rule: rule.clone(),
            retries: 0,
        })
    }

    fn is_given_up(&self, object: &Object) -> bool {
        self.given_up
            .iter()
            .any(|place| object.distance(*place).is_some_and(|distance| distance < SAME_PLACE_M))
    }

    fn attempt<B: Body>(
        &mut self,
        step: Step,
        own: &Snapshot,
        stage: &mut Stage<'_, B>,
        events: &mut Vec<Event>,
    ) -> Phase {
        match self.skill(&step, own, stage) {
            Ok(skill) => {
                stage.body.begin(stage.now, skill, stage.present_rad);
                Phase::Acting(step)
            }
            Err(why) => self.give_up(&step, &why, events),
        }
    }

    fn retry<B: Body>(
        &mut self,
        mut step: Step,
        why: &str,
        stage: &mut Stage<'_, B>,
        events: &mut Vec<Event>,
    ) -> Phase {
        stage.body.begin(stage.now, Skill::Rest, stage.present_rad);
        if step.retries < RETRIES {
            step.retries += 1;
            Phase::Recovering(step)
        } else {
            self.give_up(&step, why, events)
        }
    }

    fn give_up(&mut self, step: &Step, why: &str, events: &mut Vec<Event>) -> Phase {
        self.given_up.push(step.place_m);
        events.push(self.event(EventKind::StepFailed, &format!("{}: {why}", step.name)));
        Phase::Choosing
    }

    /// What brings about what a step's rule expects.
    fn skill<B>(&self, step: &Step, own: &Snapshot, stage: &Stage<'_, B>) -> Result<Skill, String> {
        let Stage { vocabulary, half_heights, .. } = stage;
        let block = own
            .nearest(&step.features, step.place_m, SAME_PLACE_M)
            .ok_or_else(|| format!("the {} is no longer where it was", step.name))?;
        let lost = || "I do not know where things are".to_owned();
        let [x, y, z] = block.position().ok_or_else(lost)?.to_array();
        let top_m = z + half_height_m(block).unwrap_or(half_heights.block_m);
        let is_wanted = |state: &str| {
            let effect = Effect::State { name: state.to_owned(), on: true };
            step.rule.expectation.iter().eq([&effect])
        };
        if let Some(Insertion { filled, inserted }) = &vocabulary.insertion
            && is_wanted(filled)
        {
            let is_loose = |object: &Object| object.states.get(inserted) == Some(&false);
            let peg = self.means(own, step, is_loose);
            let peg = peg.ok_or_else(|| format!("I see nothing that could still be {inserted}"))?;
            return Ok(Skill::Insert {
                thing: peg.position().ok_or_else(lost)?,
                half_height_m: half_height_m(peg).unwrap_or(half_heights.peg_m),
                hole: Position::new(x, y, top_m),
            });
        }
        if let Some(marked) = &vocabulary.marked
            && is_wanted(marked)
        {
            // A marker that lies on something marked is what marks it.
            let lies_on = |marker: &Object, thing: &Object| {
                let places = marker.position().zip(thing.position());
                thing.states.get(marked) == Some(&true)
                    && places.is_some_and(|(above, below)| {
                        let offset = above.point() - below.point();
                        offset.xy().norm() < SAME_PLACE_M && offset.z > 0.0
                    })
            };
            let is_loose = |object: &Object| {
                object.states.is_empty() && !own.objects.iter().any(|thing| lies_on(object, thing))
            };
            let marker = self.means(own, step, is_loose);
            let marker = marker.ok_or_else(|| format!("I see nothing left by which it could be {marked}"))?;
            let half_height_m = half_height_m(marker).unwrap_or(half_heights.marker_m);
            return Ok(Skill::Place {
                thing: marker.position().ok_or_else(lost)?,
                half_height_m,
                to: Position::new(x, y, top_m + half_height_m),
            });
        }
        Err(format!("I have no skill that makes a thing {}", expectation(&step.rule)))
    }

    /// What the work is done with: of the kind that the teachers used, not used up yet, the nearest
    /// to the step's object; for every retry the next one, because the first may be out of reach.
    fn means<'a>(
        &self,
        own: &'a Snapshot,
        step: &Step,
        is_loose: impl Fn(&Object) -> bool,
    ) -> Option<&'a Object> {
        let is_known = |object: &Object| self.kinds.is_empty() || self.kinds.contains(&object.features);
        let mut means: Vec<(f64, &Object)> = own
            .objects
            .iter()
            .filter(|object| is_known(object) && is_loose(object))
            .filter_map(|object| Some((object.distance(step.place_m)?, object)))
            .collect();
        means.sort_by(|a, b| a.0.total_cmp(&b.0));
        let last = means.len().checked_sub(1)?;
        means.get(step.retries.min(last)).map(|(_, object)| *object)
    }

    fn ended(&self) -> Event {
        let wanted: BTreeSet<String> = self.rules.iter().map(expectation).collect();
        let wanted = wanted.into_iter().collect::<Vec<_>>().join(", ");
        let all = self.done + quantity::number::saturating_u32(self.given_up.len());
        let text = if all == 0 {
            format!("nothing to do: everything is {wanted}")
        } else {
            format!("{wanted} {} of {all}", self.done)
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

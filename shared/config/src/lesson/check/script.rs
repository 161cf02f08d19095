//! Checks the script of a table: whether each step is possible when it happens.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use settings::number::Coordinate;
use settings::{Spanned, SpannedError};

use super::super::{Act, Destination, Object, Occluder, Role, Step, raw};
use super::{Catalogue, named, standing};

/// The objects and occluders on the table.
pub(super) struct TableContents<'a> {
    pub(super) objects: &'a [Object],
    pub(super) occluders: &'a [Occluder],
}

/// The state after the steps checked so far.
#[derive(Default)]
struct ScriptState {
    last: Duration,
    /// The time at which each teacher's hand is free again.
    hand_free: BTreeMap<u16, Duration>,
    away: Vec<u16>,
    /// For each peg in a hole, the block with that hole.
    filled: BTreeMap<usize, usize>,
    said: u32,
}

pub(super) fn script(
    raw: &[Spanned<raw::Step>],
    table: Range<usize>,
    lying: &TableContents<'_>,
    catalogue: &Catalogue,
    away: &mut Vec<u16>,
) -> Result<Vec<Step>, SpannedError> {
    let mut course = ScriptState { away: std::mem::take(away), ..ScriptState::default() };
    let mut steps = Vec::with_capacity(raw.len());
    for raw in raw {
        let span = raw.span();
        let raw = raw.get_ref();
        let step =
            Step { at: raw.at_s.get_ref().duration(), who: *raw.who.get_ref(), act: act(raw, span, lying)? };
        course.take(&step, raw, lying.objects, catalogue)?;
        steps.push(step);
    }
    *away = course.away;
    if course.said == 0 {
        return Err(SpannedError::within(
            table,
            "nothing is said in this demonstration, so Leo cannot know its task: add `say` steps",
        ));
    }
    Ok(steps)
}

impl ScriptState {
    fn take(
        &mut self,
        step: &Step,
        raw: &raw::Step,
        objects: &[Object],
        catalogue: &Catalogue,
    ) -> Result<(), SpannedError> {
        let who = step.who;
        let at_s = raw.at_s.get_ref().get();
        if !catalogue.teachers.contains(&who) {
            let known: Vec<String> = catalogue.teachers.iter().map(ToString::to_string).collect();
            let reason = format!("there is no teacher {who}: the teachers are {}", known.join(", "));
            return Err(SpannedError::at(&raw.who, reason));
        }
        if step.at < self.last {
            let last = self.last.as_secs_f64();
            let reason =
                format!("{at_s} s is before the step above it at {last} s: steps stand in the order of time");
            return Err(SpannedError::at(&raw.at_s, reason));
        }
        self.last = step.at;
        let is_away = self.away.contains(&who);
        if is_away && step.act != Act::Return {
            return Err(SpannedError::at(
                &raw.who,
                format!("teacher {who} is away: add a `return` step first"),
            ));
        }
        match &step.act {
            Act::Say(_) => self.said += 1,
            Act::Look { .. } | Act::Walk { .. } => {}
            Act::Slide { takes, .. } => self.use_hand(step, *takes, raw)?,
            Act::Leave => self.away.push(who),
            Act::Return if is_away => self.away.retain(|other| *other != who),
            Act::Return => {
                return Err(SpannedError::at(
                    &raw.who,
                    format!("teacher {who} is here: no `leave` step comes before"),
                ));
            }
            Act::Move { object, to, takes } => {
                self.use_hand(step, *takes, raw)?;
                self.filled.remove(object);
                if let Destination::Hole(block) = *to {
                    self.fill(*object, block, raw, objects)?;
                }
            }
        }
        Ok(())
    }

    fn use_hand(&mut self, step: &Step, takes: Duration, raw: &raw::Step) -> Result<(), SpannedError> {
        let free = self.hand_free.entry(step.who).or_default();
        if step.at < *free {
            let (who, free) = (step.who, free.as_secs_f64());
            let reason =
                format!("teacher {who} still moves something until {free} s: a teacher has one hand");
            return Err(SpannedError::at(&raw.at_s, reason));
        }
        *free = step.at + takes;
        Ok(())
    }

    fn fill(
        &mut self,
        peg: usize,
        block: usize,
        raw: &raw::Step,
        objects: &[Object],
    ) -> Result<(), SpannedError> {
        let span = raw.into.as_ref().map_or(0..0, Spanned::span);
        let name = |index: usize| objects.get(index).map_or("", |object| object.name.as_str());
        if let Some(sits) = self.filled.iter().find_map(|(peg, hole)| (*hole == block).then_some(*peg)) {
            let reason = format!("the hole of `{}` holds `{}` already", name(block), name(sits));
            return Err(SpannedError::within(span, reason));
        }
        self.filled.insert(peg, block);
        Ok(())
    }
}

fn span_of<T>(value: Option<&Spanned<T>>) -> Option<Range<usize>> {
    value.map(Spanned::span)
}

/// The single action of a step.
fn act(raw: &raw::Step, span: Range<usize>, lying: &TableContents<'_>) -> Result<Act, SpannedError> {
    let objects = lying.objects;
    let acts = [
        span_of(raw.say.as_ref()),
        span_of(raw.object.as_ref()),
        span_of(raw.slide.as_ref()),
        span_of(raw.look_at_m.as_ref()),
        span_of(raw.eyes_to_m.as_ref()),
        span_of(raw.leave.as_ref()),
        span_of(raw.comes_back.as_ref()),
    ];
    let mut acts = acts.into_iter().flatten();
    if acts.next().is_none() {
        return Err(SpannedError::within(
            span,
            "a step needs one of `say`, `move`, `slide`, `look_at_m`, `eyes_to_m`, `leave` and `return`",
        ));
    }
    if let Some(second) = acts.next() {
        return Err(SpannedError::within(second, "a step does one thing: make this a step of its own"));
    }
    let moves = raw.object.is_some();
    let slides = raw.slide.is_some();
    let places = moves && raw.to_m.is_some();
    for (given, belongs, rule) in [
        (span_of(raw.into.as_ref()), moves, "`into` belongs to a `move`"),
        (span_of(raw.onto.as_ref()), moves, "`onto` belongs to a `move`"),
        (span_of(raw.to_m.as_ref()), moves || slides, "`to_m` belongs to a `move` or a `slide`"),
        (span_of(raw.underside_m.as_ref()), places, "`underside_m` belongs to the `to_m` of a `move`"),
        (span_of(raw.heading_deg.as_ref()), places, "`heading_deg` belongs to the `to_m` of a `move`"),
        (
            span_of(raw.duration_s.as_ref()),
            moves || slides || raw.look_at_m.is_some() || raw.eyes_to_m.is_some(),
            "`duration_s` belongs to a `move`, a `slide`, a `look_at_m` or an `eyes_to_m`",
        ),
    ] {
        if let Some(span) = given.filter(|_| !belongs) {
            return Err(SpannedError::within(span, rule));
        }
    }
    if let Some(text) = &raw.say {
        return said(text);
    }
    if let Some(name) = &raw.object {
        let (index, object) = find(name, objects)?;
        let to = destination(raw, span.clone(), index, object, objects)?;
        return Ok(Act::Move { object: index, to, takes: takes(raw, span)? });
    }
    if let Some(name) = &raw.slide {
        let known = lying.occluders.iter().enumerate();
        let known = known.map(|(index, occluder)| (occluder.name.as_str(), (index, occluder)));
        let (index, occluder) = named(name, "occluder", known)?;
        let Some(to_m) = &raw.to_m else {
            return Err(SpannedError::at(
                name,
                "the destination is missing. A `slide` needs `to_m`, the middle of the occluder",
            ));
        };
        let ([x, y], [.., z]) = (to_m.get_ref().map(Coordinate::get), occluder.centre_m);
        return Ok(Act::Slide { occluder: index, centre_m: [x, y, z], takes: takes(raw, span)? });
    }
    if let Some(point) = &raw.look_at_m {
        return Ok(Act::Look { at_m: point.get_ref().map(Coordinate::get), takes: takes(raw, span)? });
    }
    if let Some(place) = &raw.eyes_to_m {
        return Ok(Act::Walk { eyes_m: place.get_ref().map(Coordinate::get), takes: takes(raw, span)? });
    }
    let (flag, act) = match (&raw.leave, &raw.comes_back) {
        (Some(flag), _) => (flag, Act::Leave),
        (None, Some(flag)) => (flag, Act::Return),
        (None, None) => return Err(SpannedError::within(span, "a step does one thing")),
    };
    if *flag.get_ref() { Ok(act) } else { Err(SpannedError::at(flag, "write `true`, or take the step out")) }
}

fn said(text: &Spanned<String>) -> Result<Act, SpannedError> {
    let length = text.get_ref().len();
    if text.get_ref().trim().is_empty() || length > message::TEXT_CAPACITY {
        let max = message::TEXT_CAPACITY;
        let reason = format!("a sentence has 1 to {max} bytes, and this one has {length}: say it in several");
        return Err(SpannedError::at(text, reason));
    }
    Ok(Act::Say(text.get_ref().clone()))
}

fn takes(raw: &raw::Step, span: Range<usize>) -> Result<Duration, SpannedError> {
    let Some(takes) = &raw.duration_s else {
        return Err(SpannedError::within(span, "missing `duration_s`: how long it takes"));
    };
    if takes.get_ref().get() > 0.0 {
        Ok(takes.get_ref().duration())
    } else {
        Err(SpannedError::at(takes, "no action takes zero time: `duration_s` must be above 0"))
    }
}

fn find<'a>(name: &Spanned<String>, objects: &'a [Object]) -> Result<(usize, &'a Object), SpannedError> {
    named(
        name,
        "object",
        objects.iter().enumerate().map(|(index, object)| (object.name.as_str(), (index, object))),
    )
}

fn destination(
    raw: &raw::Step,
    span: Range<usize>,
    index: usize,
    object: &Object,
    objects: &[Object],
) -> Result<Destination, SpannedError> {
    match (&raw.into, &raw.onto, &raw.to_m) {
        (Some(name), None, None) => {
            let (block, target) = find(name, objects)?;
            if !target.kind.hole {
                return Err(SpannedError::at(
                    name,
                    format!("`{}` has no hole: its kind says `hole = false`", target.name),
                ));
            }
            if object.kind.role != Role::Peg {
                return Err(SpannedError::at(
                    name,
                    format!("`{}` is not a peg: only pegs fit into holes", object.name),
                ));
            }
            Ok(Destination::Hole(block))
        }
        (None, Some(name), None) => {
            let (below, target) = find(name, objects)?;
            if below == index {
                return Err(SpannedError::at(name, "nothing can be put onto itself"));
            }
            if object.kind.role == Role::Marker && !target.kind.markable {
                let reason = format!("`{}` cannot be marked: its kind says `markable = false`", target.name);
                return Err(SpannedError::at(name, reason));
            }
            Ok(Destination::Top(below))
        }
        (None, None, Some(to_m)) => {
            let heading = raw.heading_deg.as_ref();
            let heading_deg =
                heading.map_or(object.place.heading_rad.to_degrees(), |heading| heading.get_ref().get());
            let underside_m = raw.underside_m.as_ref().map_or(0.0, |underside| underside.get_ref().get());
            Ok(Destination::UprightPose(standing(*to_m.get_ref(), underside_m, heading_deg, &object.kind)))
        }
        (None, None, None) => Err(SpannedError::within(
            span,
            "the destination is missing. A `move` needs one of `into`, `onto` and `to_m`",
        )),
        _ => Err(SpannedError::within(span, "a `move` has one end: keep one of `into`, `onto` and `to_m`")),
    }
}

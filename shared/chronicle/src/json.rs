use belief::percepts::Percepts;
use message::{Aspect, Belief, Difference, Feature, NOBODY};
use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};

use crate::words::PerceptPhrases;
use crate::{PerspectiveRecord, Summary};

/// Writes the beliefs of every perspective for programs, one JSON object per line.
///
/// `record` gives the type of a line:
///
/// - `perspective`: one for each perspective and instant;
/// - `belief`: one for each belief of a perspective;
/// - `difference`: one for each thing about which a partner differs from the robot;
/// - `summary`: one at the end.
#[derive(Clone, Debug)]
pub struct JsonLines {
    words: PerceptPhrases,
}

/// Final counters of a perspective.
#[derive(Clone, Copy, Debug, Serialize)]
struct End {
    perspective: u32,
    beliefs: usize,
    created: u64,
    merged: u64,
    culled: u64,
    refused: u64,
    overflowed: u64,
}

#[derive(Serialize)]
struct PerspectiveLine<'a> {
    record: &'static str,
    at_ns: u64,
    perspective: u32,
    path: &'a [u16],
    present: bool,
    beliefs: usize,
    perceivable: u32,
    hidden: u32,
    frame_position_m: [f64; 3],
    frame_orientation_xyzw: [f64; 4],
    eye_position_m: [f64; 3],
    eye_orientation_xyzw: [f64; 4],
}

#[derive(Serialize)]
struct BeliefLine<'a> {
    record: &'static str,
    at_ns: u64,
    perspective: u32,
    id: u64,
    robot_id: Option<u64>,
    born_at_ns: u64,
    perceived_at_ns: u64,
    observations: u64,
    held_by: Option<u16>,
    owner: Option<u16>,
    percepts: Remembered<'a>,
}

#[derive(Serialize)]
struct DifferenceLine<'a> {
    record: &'static str,
    at_ns: u64,
    perspective: u32,
    robot_id: Option<u64>,
    partner_id: Option<u64>,
    percepts: Differing<'a>,
}

#[derive(Serialize)]
struct SummaryLine<'a> {
    record: &'static str,
    #[serde(flatten)]
    summary: &'a Summary,
    perspectives: Vec<End>,
}

/// The percepts of a belief, by name.
struct Remembered<'a>(&'a PerceptPhrases, &'a Belief);

#[derive(Serialize)]
struct RememberedPercept<'a> {
    m: f32,
    c: f32,
    feature: Option<Value<'a>>,
    sampled_at_ns: u64,
}

/// The percepts in which two beliefs differ, by name.
struct Differing<'a>(&'a PerceptPhrases, &'a [Aspect]);

#[derive(Serialize)]
struct DifferingPercept<'a> {
    robot: Option<Value<'a>>,
    partner: Option<Value<'a>>,
    apart: Option<f64>,
}

/// A feature; symbols by name.
#[derive(Serialize)]
#[serde(untagged)]
enum Value<'a> {
    Symbol(&'a str),
    Number(f32),
    Vector([f32; 3]),
    Orientation([f32; 4]),
}

impl JsonLines {
    /// A writer with the names of these percepts.
    #[must_use]
    pub fn new(percepts: &Percepts) -> Self {
        Self { words: PerceptPhrases::of(percepts) }
    }

    /// Appends the beliefs at an instant to `out`.
    pub fn note(&self, at_ns: u64, minds: &[PerspectiveRecord<'_>], out: &mut String) {
        for mind in minds {
            line(&PerspectiveLine::new(at_ns, mind), out);
            for belief in mind.beliefs {
                line(&BeliefLine::new(&self.words, at_ns, mind, belief), out);
            }
            for difference in mind.differences {
                line(&DifferenceLine::new(&self.words, at_ns, mind, difference), out);
            }
        }
    }

    /// Appends the summary to `out`.
    pub fn close(&self, minds: &[PerspectiveRecord<'_>], summary: &Summary, out: &mut String) {
        let perspectives = minds.iter().map(End::of).collect();
        line(&SummaryLine { record: "summary", summary, perspectives }, out);
    }
}

fn line(value: &impl Serialize, out: &mut String) {
    // Names and numbers can always be serialised.
    out.push_str(&serde_json::to_string(value).unwrap_or_default());
    out.push('\n');
}

impl End {
    fn of(mind: &PerspectiveRecord<'_>) -> Self {
        let head = mind.head;
        Self {
            perspective: head.perspective,
            beliefs: mind.beliefs.len(),
            created: head.created,
            merged: head.merged,
            culled: head.culled,
            refused: head.refused,
            overflowed: head.overflowed,
        }
    }
}

impl<'a> PerspectiveLine<'a> {
    fn new(at_ns: u64, mind: &PerspectiveRecord<'a>) -> Self {
        let head = mind.head;
        Self {
            record: "perspective",
            at_ns,
            perspective: head.perspective,
            path: head.path.agents().unwrap_or(&[]),
            present: head.present != 0,
            beliefs: mind.beliefs.len(),
            perceivable: head.perceivable,
            hidden: head.hidden,
            frame_position_m: head.frame_position_m,
            frame_orientation_xyzw: head.frame_orientation_xyzw,
            eye_position_m: head.eye_position_m,
            eye_orientation_xyzw: head.eye_orientation_xyzw,
        }
    }
}

impl<'a> BeliefLine<'a> {
    fn new(words: &'a PerceptPhrases, at_ns: u64, mind: &PerspectiveRecord<'_>, belief: &'a Belief) -> Self {
        Self {
            record: "belief",
            at_ns,
            perspective: mind.head.perspective,
            id: belief.id,
            robot_id: if mind.head.perspective == 0 { Some(belief.id) } else { mind.robots(belief.id) },
            born_at_ns: belief.born_at_ns,
            perceived_at_ns: belief.perceived_at_ns,
            observations: belief.observations,
            held_by: agent(belief.held_by),
            owner: agent(belief.owner),
            percepts: Remembered(words, belief),
        }
    }
}

impl<'a> DifferenceLine<'a> {
    fn new(
        words: &'a PerceptPhrases,
        at_ns: u64,
        mind: &PerspectiveRecord<'_>,
        difference: &'a Difference,
    ) -> Self {
        Self {
            record: "difference",
            at_ns,
            perspective: mind.head.perspective,
            robot_id: difference.one(),
            partner_id: difference.other(),
            percepts: Differing(words, difference.aspects()),
        }
    }
}

fn agent(number: u16) -> Option<u16> {
    (number != NOBODY).then_some(number)
}

impl Serialize for Remembered<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let Self(words, belief) = self;
        let mut map = to.serialize_map(Some(belief.percepts().len()))?;
        for remembered in belief.percepts() {
            let percept = RememberedPercept {
                m: remembered.matching,
                c: remembered.confidence,
                feature: value(words, remembered.percept, remembered.feature()),
                sampled_at_ns: remembered.sampled_at_ns,
            };
            map.serialize_entry(words.name(remembered.percept), &percept)?;
        }
        map.end()
    }
}

impl Serialize for Differing<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let Self(words, aspects) = self;
        let mut map = to.serialize_map(Some(aspects.len()))?;
        for aspect in *aspects {
            let percept = DifferingPercept {
                robot: value(words, aspect.percept, aspect.one()),
                partner: value(words, aspect.percept, aspect.other()),
                apart: aspect.apart(),
            };
            map.serialize_entry(words.name(aspect.percept), &percept)?;
        }
        map.end()
    }
}

fn value(words: &PerceptPhrases, percept: u16, feature: Option<Feature>) -> Option<Value<'_>> {
    match feature? {
        Feature::None => None,
        // A symbol without a name is written as its number.
        Feature::Symbol(symbol) => {
            Some(words.symbol(percept, symbol).map_or(Value::Number(f32::from(symbol)), Value::Symbol))
        }
        Feature::Number(number) => Some(Value::Number(number)),
        Feature::Vector(vector) => Some(Value::Vector(vector)),
        Feature::Orientation(xyzw) => Some(Value::Orientation(xyzw)),
    }
}

use belief::percepts::Percepts;
use message::{Aspect, Belief, BeliefHead, Difference, Feature, NOBODY};
use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};

use super::BeliefReport;
use super::perspective_record::PerspectiveRecord;
use super::phrases::PerceptPhrases;
use super::summary::Summary;

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

/// Defines a line by its fields, each with its value.
macro_rules! record_line {
    ($line:ident<$life:lifetime>($($source:ident: $type:ty),+) { $($field:ident: $kind:ty = $value:expr,)+ }) => {
        #[derive(Serialize)]
        struct $line<$life> {
            record: &'static str,
            $($field: $kind,)+
        }

        impl<$life> $line<$life> {
            fn new(record: &'static str, $($source: $type),+) -> Self {
                Self { record, $($field: $value,)+ }
            }
        }
    };
}

record_line! {
    PerspectiveLine<'a>(at_ns: u64, head: &'a BeliefHead, beliefs: usize) {
        at_ns: u64 = at_ns,
        perspective: u32 = head.perspective,
        path: &'a [u16] = head.path.agents().unwrap_or(&[]),
        present: bool = head.present != 0,
        beliefs: usize = beliefs,
        perceivable: u32 = head.perceivable,
        hidden: u32 = head.hidden,
        frame_position_m: [f64; 3] = head.frame_position_m,
        frame_orientation_xyzw: [f64; 4] = head.frame_orientation_xyzw,
        eye_position_m: [f64; 3] = head.eye_position_m,
        eye_orientation_xyzw: [f64; 4] = head.eye_orientation_xyzw,
    }
}

record_line! {
    BeliefLine<'a>(
        words: &'a PerceptPhrases, at_ns: u64, mind: &PerspectiveRecord<'_>, belief: &'a Belief
    ) {
        at_ns: u64 = at_ns,
        perspective: u32 = mind.head.perspective,
        id: u64 = belief.id,
        robot_id: Option<u64> =
            if mind.head.perspective == 0 { Some(belief.id) } else { mind.robots(belief.id) },
        born_at_ns: u64 = belief.born_at_ns,
        perceived_at_ns: u64 = belief.perceived_at_ns,
        observations: u64 = belief.observations,
        held_by: Option<u16> = agent(belief.held_by),
        owner: Option<u16> = agent(belief.owner),
        percepts: Remembered<'a> = Remembered(words, belief),
    }
}

record_line! {
    DifferenceLine<'a>(words: &'a PerceptPhrases, at_ns: u64, perspective: u32, difference: &'a Difference) {
        at_ns: u64 = at_ns,
        perspective: u32 = perspective,
        robot_id: Option<u64> = difference.one(),
        partner_id: Option<u64> = difference.other(),
        percepts: Differing<'a> = Differing(words, difference.aspects()),
    }
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
    distance: Option<f64>,
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
}

impl BeliefReport for JsonLines {
    /// Appends the beliefs at the instant.
    fn append(&mut self, at_ns: u64, minds: &[PerspectiveRecord<'_>], out: &mut String) {
        for mind in minds {
            line(&PerspectiveLine::new("perspective", at_ns, mind.head, mind.beliefs.len()), out);
            for belief in mind.beliefs {
                line(&BeliefLine::new("belief", &self.words, at_ns, mind, belief), out);
            }
            for difference in mind.differences {
                let perspective = mind.head.perspective;
                line(&DifferenceLine::new("difference", &self.words, at_ns, perspective, difference), out);
            }
        }
    }

    /// Appends the summary.
    fn finish(&self, minds: &[PerspectiveRecord<'_>], summary: &Summary, out: &mut String) {
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
                distance: aspect.distance(),
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

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use config::Names;
use message::{Belief, NOBODY};
use quantity::distance;

use super::BeliefReport;
use super::perspective_record::PerspectiveRecord;
use super::phrases::{PerceptPhrases, place};
use super::summary::Summary;
use super::table;

/// A thing has moved when it is farther than this from its last reported position.
const MIN_MOTION_M: f64 = 0.03;
/// A thing is at rest when it has stayed within [`MAX_REST_MOTION_M`] for this long.
const MIN_REST: Duration = Duration::from_millis(200);
const MAX_REST_MOTION_M: f64 = 0.01;
/// A state has changed when its degree has changed by more than this.
const MIN_DEGREE_CHANGE: f32 = 0.25;

/// Reports the events in all perspectives for people: beliefs that are created, removed or changed, and differences
/// between a partner and the robot that begin or end. Times are relative to the first instant. The motion of a thing is
/// reported once it is at rest.
#[derive(Clone, Debug)]
pub struct Timeline {
    words: PerceptPhrases,
    first: Option<Instant>,
    minds: BTreeMap<u32, ReportedPerspective>,
}

/// The reported state of a perspective.
#[derive(Clone, Debug, Default)]
struct ReportedPerspective {
    present: bool,
    beliefs: BTreeMap<u64, ReportedBelief>,
    differences: BTreeMap<(Option<u64>, Option<u64>), Vec<u16>>,
}

/// The reported state of a belief.
#[derive(Clone, Debug)]
struct ReportedBelief {
    thing: String,
    place_m: Option<[f64; 3]>,
    /// Its recent position, and since when it has been there.
    recent_place: Option<([f64; 3], Instant)>,
    states: Vec<Option<f32>>,
    class: Vec<Option<u16>>,
    held_by: u16,
}

impl Timeline {
    /// An empty timeline.
    #[must_use]
    pub fn new(percepts: &Percepts) -> Self {
        Self { words: PerceptPhrases::of(percepts), first: None, minds: BTreeMap::new() }
    }

    /// The same, with the agents' names.
    #[must_use]
    pub fn with_names(self, names: &Names) -> Self {
        Self { words: self.words.with_names(names), ..self }
    }
}

impl BeliefReport for Timeline {
    /// Appends the new events.
    fn append(&mut self, at_ns: u64, minds: &[PerspectiveRecord<'_>], out: &mut String) {
        let at = Instant::from_nanos(at_ns);
        let first = *self.first.get_or_insert(at);
        let mut lines = Lines { since: at.since(first), names: self.words.names(), out };
        for mind in minds {
            let reported = self.minds.entry(mind.head.perspective).or_default();
            reported.presence(mind, &mut lines);
            reported.beliefs(&self.words, at, mind, &mut lines);
            reported.differences(&self.words, mind, &mut lines);
        }
    }

    /// Appends the final beliefs and the summary.
    fn finish(&self, minds: &[PerspectiveRecord<'_>], summary: &Summary, out: &mut String) {
        // Writing to a string cannot fail.
        let _ = table::write(&self.words, minds, summary, out);
    }
}

/// Lines of one instant.
struct Lines<'a> {
    since: Duration,
    names: &'a Names,
    out: &'a mut String,
}

impl Lines<'_> {
    fn write_line(&mut self, who: &PerspectiveRecord<'_>, words: &str) {
        // Writing to a string cannot fail.
        let _ =
            writeln!(self.out, "[{:7.2} s] {:<11} {words}", self.since.as_secs_f64(), who.name(self.names));
    }
}

impl ReportedPerspective {
    fn presence(&mut self, mind: &PerspectiveRecord<'_>, lines: &mut Lines<'_>) {
        let present = mind.head.present != 0;
        if self.present != present && mind.head.perspective != 0 {
            lines.write_line(mind, if present { "is there" } else { "is away: these beliefs are frozen" });
        }
        self.present = present;
    }

    fn beliefs(
        &mut self,
        words: &PerceptPhrases,
        at: Instant,
        mind: &PerspectiveRecord<'_>,
        lines: &mut Lines<'_>,
    ) {
        self.beliefs.retain(|id, reported| {
            let lives = mind.belief(*id).is_some();
            if !lives {
                lines.write_line(mind, &format!("no longer believes in {id}: {}", reported.thing));
            }
            lives
        });
        for belief in mind.beliefs {
            match self.beliefs.get_mut(&belief.id) {
                Some(reported) => {
                    reported.update(words, at, mind, belief, |change| {
                        lines.write_line(mind, &format!("{}: {change}", belief.id));
                    });
                }
                None => {
                    let reported = ReportedBelief::new(words, at, mind, belief);
                    let text = table::describe(words, mind, belief);
                    lines.write_line(mind, &format!("believes in {}: {text}", belief.id));
                    self.beliefs.insert(belief.id, reported);
                }
            }
        }
    }

    fn differences(&mut self, words: &PerceptPhrases, mind: &PerspectiveRecord<'_>, lines: &mut Lines<'_>) {
        let now: BTreeMap<_, Vec<u16>> = mind
            .differences
            .iter()
            .map(|difference| {
                let about = difference.aspects().iter().map(|aspect| aspect.percept).collect();
                ((difference.one(), difference.other()), about)
            })
            .collect();
        for (pair, about) in &now {
            if self.differences.get(pair) == Some(about) {
                continue;
            }
            let names: Vec<&str> = about.iter().map(|percept| words.name(*percept)).collect();
            let names = names.join(", ");
            lines.write_line(
                mind,
                &match pair {
                    (Some(robots), Some(his)) => format!("{his} differs from Leo's {robots}: {names}"),
                    (Some(robots), None) => format!("does not know of Leo's {robots}"),
                    (None, his) => format!("alone believes in {}", his.unwrap_or(0)),
                },
            );
        }
        // Another belief of the partner may have resolved the difference of either belief.
        let settled = |(one, other): &(Option<u64>, Option<u64>)| {
            let pair = mind.pairs.iter().find(|(own, his)| Some(*own) == *one || Some(*his) == *other);
            pair.filter(|(own, his)| !now.contains_key(&(Some(*own), Some(*his))))
        };
        let over = self.differences.keys().filter(|pair| !now.contains_key(*pair));
        let agreed: BTreeSet<_> = over.filter_map(settled).collect();
        for (robots, his) in agreed {
            lines.write_line(mind, &format!("{his} agrees with Leo's {robots}"));
        }
        self.differences = now;
    }
}

impl ReportedBelief {
    fn new(words: &PerceptPhrases, at: Instant, mind: &PerspectiveRecord<'_>, belief: &Belief) -> Self {
        let place_m = mind.place_m(belief, words.position);
        Self {
            thing: words.thing(belief),
            place_m,
            recent_place: place_m.map(|place| (place, at)),
            states: words.states().iter().map(|percept| belief.number(*percept)).collect(),
            class: words.class().iter().map(|percept| belief.symbol(*percept)).collect(),
            held_by: belief.held_by,
        }
    }

    /// Reports the changes of a belief.
    fn update(
        &mut self,
        words: &PerceptPhrases,
        at: Instant,
        mind: &PerspectiveRecord<'_>,
        belief: &Belief,
        mut tell: impl FnMut(&str),
    ) {
        let class: Vec<_> = words.class().iter().map(|percept| belief.symbol(*percept)).collect();
        if class != self.class {
            let thing = words.thing(belief);
            let contradicts = self.class.iter().zip(&class).any(|(was, is)| was.is_some() && was != is);
            // What was unknown before is no mistake.
            tell(&if contradicts {
                format!("is a {thing}, not a {}", self.thing)
            } else {
                format!("is a {thing}")
            });
            (self.class, self.thing) = (class, thing);
        }
        if let Some(place_m) = self.moved(at, mind.place_m(belief, words.position)) {
            tell(&format!("moved to {}", place(place_m)));
        }
        for (reported, percept) in self.states.iter_mut().zip(words.states()) {
            let now = belief.number(*percept);
            let changed = match (*reported, now) {
                (Some(reported), Some(now)) => (reported - now).abs() > MIN_DEGREE_CHANGE,
                (None, Some(_)) => true,
                (_, None) => false,
            };
            if changed {
                *reported = now;
                tell(&words.state(*percept, belief).unwrap_or_default());
            }
        }
        if belief.held_by != self.held_by {
            self.held_by = belief.held_by;
            tell(&match belief.held_by {
                NOBODY => "nobody holds it".to_owned(),
                holder => format!("{} holds it", words.names().of(holder)),
            });
        }
    }

    /// The position where it has come to rest, if that differs from the reported one.
    fn moved(&mut self, at: Instant, place_m: Option<[f64; 3]>) -> Option<[f64; 3]> {
        let place_m = place_m?;
        let far = |from: &[f64; 3]| distance(from, &place_m);
        let since = match self.recent_place {
            Some((place, since)) if far(&place) <= MAX_REST_MOTION_M => since,
            _ => {
                self.recent_place = Some((place_m, at));
                at
            }
        };
        let rests = at.since(since) >= MIN_REST;
        if rests && self.place_m.is_none_or(|reported| far(&reported) > MIN_MOTION_M) {
            self.place_m = Some(place_m);
            return Some(place_m);
        }
        None
    }
}

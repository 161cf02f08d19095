use std::collections::BTreeMap;

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use message::{Belief, Difference};

use super::phrases::PerceptPhrases;

/// A change is reported once it has lasted this long. So a thing that is being carried, or that one agent sees a moment
/// later than the other, is not reported.
const MIN_DURATION: Duration = Duration::from_millis(500);

/// Reports in sentences when a partner's beliefs begin or cease to diverge from the robot's.
#[derive(Clone, Debug)]
pub struct DivergenceReporter {
    words: PerceptPhrases,
    /// Display name of the partner.
    partner: String,
    things: BTreeMap<ThingKey, ReportedThing>,
}

/// A thing, identified by the robot's belief, or if it has none, by the partner's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum ThingKey {
    OfRobot(u64),
    OfPartner(u64),
}

/// The state of the report about a thing.
#[derive(Clone, Debug)]
struct ReportedThing {
    name: String,
    /// The sentence reported last; `None` if none was, or if it was that they agree.
    reported: Option<String>,
    /// The sentence that applies now, and since when.
    now: Option<String>,
    since: Instant,
}

impl DivergenceReporter {
    /// A reporter for the partner of this name.
    #[must_use]
    pub fn new(percepts: &Percepts, partner: &str) -> Self {
        Self { words: PerceptPhrases::of(percepts), partner: partner.to_owned(), things: BTreeMap::new() }
    }

    /// Processes the differences between partner and robot at an instant, with the current beliefs of both, and passes
    /// new sentences to `tell`.
    pub fn update(
        &mut self,
        at_ns: u64,
        differences: &[Difference],
        robots: &[Belief],
        his: &[Belief],
        mut tell: impl FnMut(&str),
    ) {
        let at = Instant::from_nanos(at_ns);
        let who = self.partner.clone();
        let mut now: BTreeMap<ThingKey, (String, String)> = differences
            .iter()
            .filter_map(|difference| {
                let (thing, belief) = thing(difference, robots, his)?;
                let name = self.words.thing(belief);
                let sentence = self.words.divergence(&who, &name, difference);
                Some((thing, (name, sentence)))
            })
            .collect();
        self.things.retain(|thing, about| {
            let sentence = now.remove(thing).map(|(_, sentence)| sentence);
            if about.now != sentence {
                (about.now, about.since) = (sentence, at);
            }
            if about.now != about.reported && at.since(about.since) >= MIN_DURATION {
                let resolved = || thing.resolved(&who, &about.name, robots, his);
                if let Some(news) = about.now.clone().or_else(resolved) {
                    tell(&news);
                }
                about.reported.clone_from(&about.now);
            }
            about.now.is_some() || about.reported.is_some()
        });
        self.things.extend(now.into_iter().map(|(thing, (name, sentence))| {
            (thing, ReportedThing { name, reported: None, now: Some(sentence), since: at })
        }));
    }

    /// Clears the state, because the identities that follow are from another run of the belief process.
    pub fn reset(&mut self) {
        self.things.clear();
    }
}

impl ThingKey {
    /// The sentence for a difference that has ended; `None` if the robot no longer has the belief.
    fn resolved(self, who: &str, name: &str, robots: &[Belief], his: &[Belief]) -> Option<String> {
        let agree = || format!("{who} and Leo agree about the {name}");
        let lives = |beliefs: &[Belief], id| beliefs.iter().any(|belief| belief.id == id);
        match self {
            Self::OfRobot(id) => lives(robots, id).then(agree),
            Self::OfPartner(id) if lives(his, id) => Some(agree()),
            Self::OfPartner(_) => Some(format!("{who} no longer believes in that {name}")),
        }
    }
}

/// The thing of a difference, and a belief about it; `None` if there is no such belief any more.
fn thing<'a>(
    difference: &Difference,
    robots: &'a [Belief],
    his: &'a [Belief],
) -> Option<(ThingKey, &'a Belief)> {
    let find = |beliefs: &'a [Belief], id: u64| beliefs.iter().find(|belief| belief.id == id);
    match (difference.one(), difference.other()) {
        (Some(id), _) => Some((ThingKey::OfRobot(id), find(robots, id)?)),
        (None, Some(id)) => Some((ThingKey::OfPartner(id), find(his, id)?)),
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use message::{Aspect, Feature, NOBODY, Remembered};

    use super::*;

    fn blue_square(id: u64) -> Belief {
        let percepts = Percepts::builtin();
        let mut belief = Belief::new(id, 0, 0, 1, NOBODY);
        for (percept, symbol) in [("shape", "square"), ("colour", "blue")] {
            let number = percepts.index(percept).unwrap();
            let symbols: Vec<&str> = percepts.percepts[usize::from(number)].symbols().collect();
            let symbol = symbols.iter().position(|known| *known == symbol).unwrap();
            let feature = Feature::Symbol(u16::try_from(symbol).unwrap());
            assert!(belief.push(Remembered::new(number, 0, 1.0, 1.0, feature)));
        }
        belief
    }

    /// The reports for these differences, each with the time in milliseconds at which it is processed.
    fn reported(story: &[(u64, &[Difference])]) -> Vec<String> {
        let mut reporter = DivergenceReporter::new(&Percepts::builtin(), "partner 1");
        let mut lines = Vec::new();
        let alone = story
            .iter()
            .flat_map(|(_, differences)| *differences)
            .all(|difference| difference.aspects().is_empty());
        for (at_ms, differences) in story {
            let beliefs = |ids: &[u64]| ids.iter().map(|id| blue_square(*id)).collect::<Vec<_>>();
            // At the end, a thing that only one of them believed in has no belief any more.
            let gone = differences.is_empty() && alone;
            let (robots, his) =
                if gone { (beliefs(&[]), beliefs(&[])) } else { (beliefs(&[3]), beliefs(&[8])) };
            reporter.update(at_ms * 1_000_000, differences, &robots, &his, |line| {
                lines.push(format!("{at_ms} {line}"));
            });
        }
        lines
    }

    fn about(percepts: &[&str]) -> Difference {
        let mut difference = Difference::new(Some(3), Some(8));
        for name in percepts {
            let percept = Percepts::builtin().index(name).unwrap();
            assert!(difference.push(Aspect::new(percept, None, None, None)));
        }
        difference
    }

    /// The times in the lines of `reported`.
    fn times(lines: &[String]) -> Vec<u64> {
        lines.iter().filter_map(|line| line.split(' ').next()?.parse().ok()).collect()
    }

    #[test]
    fn a_lasting_difference_is_reported_once_and_so_is_its_end() {
        let moved = [about(&["position"])];
        let lines =
            reported(&[(0, &moved), (400, &moved), (600, &moved), (900, &moved), (1000, &[]), (1600, &[])]);
        assert_eq!(times(&lines), [600, 1600]);
        insta::assert_snapshot!(lines.join("\n"));
        assert!(reported(&[(0, &moved), (400, &[]), (1000, &[]), (2000, &moved)]).is_empty());
    }

    #[test]
    fn a_belief_of_one_side_only_is_reported_as_such() {
        let hidden = [Difference::new(Some(3), None)];
        // When the robot no longer has the belief either, nothing is reported.
        let unknown = reported(&[(0, &hidden), (500, &hidden), (600, &[]), (1100, &[])]);
        assert_eq!(times(&unknown), [500]);
        let gone = [Difference::new(None, Some(8))];
        let alone = reported(&[(0, &gone), (500, &gone), (600, &[]), (1100, &[])]);
        assert_eq!(times(&alone), [500, 1100]);
        insta::assert_snapshot!([unknown, alone].concat().join("\n"));
    }

    #[test]
    fn a_difference_of_another_kind_is_reported_again() {
        let (hidden, known) = ([Difference::new(Some(3), None)], [about(&["position", "filled"])]);
        let lines = reported(&[(0, &hidden), (500, &hidden), (600, &known), (1100, &known)]);
        assert_eq!(times(&lines), [500, 1100]);
        assert!(lines[1].ends_with("position, filled"), "{lines:?}");
        insta::assert_snapshot!(lines.join("\n"));
    }
}

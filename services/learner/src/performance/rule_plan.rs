use std::collections::{BTreeMap, BTreeSet};

use geometry::Position;
use motion::Skill;
use quantity::number::{counted, saturating_u32};
use tasks::{Learned, Object, Rule, Snapshot, describe_object, listed};

use super::{
    BLOCK_HALF_HEIGHT_M, MARKER_HALF_HEIGHT_M, PEG_HALF_HEIGHT_M, Plan, SAME_PLACE_M, Step, half_height_m,
};
use crate::report::{expectation, with_expectation};
use crate::vocabulary::{Insertion, Vocabulary, no_skill};

/// Works through the objects that violate the rules, nearest first.
#[derive(Debug)]
pub(super) struct RulePlan {
    rules: Vec<Rule>,
    /// The class features of the pegs and markers that the teachers used.
    kinds: BTreeSet<BTreeMap<String, String>>,
    /// The rule of the step selected last.
    chosen: Option<Rule>,
    /// Positions of objects that were given up.
    given_up: Vec<[f64; 3]>,
}

impl RulePlan {
    pub(super) fn new(learned: &Learned) -> Self {
        Self {
            rules: learned.primary().cloned().collect(),
            kinds: learned.means.iter().flat_map(|means| means.kinds.iter().cloned()).collect(),
            chosen: None,
            given_up: Vec::new(),
        }
    }

    fn is_given_up(&self, object: &Object) -> bool {
        self.given_up
            .iter()
            .any(|place| object.distance(*place).is_some_and(|distance| distance < SAME_PLACE_M))
    }

    /// The nearest unused peg or marker of a kind that the teachers used. Each retry takes the next one, because the
    /// first may be out of reach.
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
}

impl Plan for RulePlan {
    fn wanted(&self) -> String {
        let wanted: BTreeSet<String> = self.rules.iter().map(expectation).collect();
        wanted.into_iter().collect::<Vec<_>>().join(", ")
    }

    /// Selects the unfinished object nearest to the robot.
    fn choose(&mut self, vocabulary: &Vocabulary, own: &Snapshot) -> Result<Option<Step>, String> {
        // An object that cannot be worked on does not count towards a number.
        let is_excluded = |object: &Object| object.position_m.is_none() || self.is_given_up(object);
        let open = |rule| Rule::open(rule, own, is_excluded).map(move |object| (rule, object));
        let nearest = self
            .rules
            .iter()
            .flat_map(open)
            .filter_map(|(rule, object)| Some((object.distance([0.0; 3])?, object.position_m?, rule, object)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, place_m, rule, object)) = nearest else { return Ok(None) };
        let like = own.objects.iter().filter(|other| other.states.keys().eq(object.states.keys()));
        let step = Step {
            name: describe_object(&vocabulary.language, object, like),
            features: object.features.clone(),
            place_m,
            wanted: expectation(rule),
            retries: 0,
        };
        self.chosen = Some(rule.clone());
        Ok(Some(step))
    }

    fn is_done(&self, step: &Step, own: &Snapshot) -> Option<bool> {
        let object = own.nearest(&step.features, step.place_m, SAME_PLACE_M)?;
        Some(self.chosen.as_ref().is_some_and(|rule| rule.is_done(object)))
    }

    fn done(&mut self) {}

    fn give_up(&mut self, step: &Step) {
        self.given_up.push(step.place_m);
    }

    fn missing(&self, own: &Snapshot) -> Option<String> {
        let parts = self.rules.iter().filter(|rule| rule.lacks_objects(own)).map(|rule| {
            let few = match saturating_u32(rule.members(own).len()) {
                0 => "nothing".to_owned(),
                few => format!("only {}", counted(few, "thing")),
            };
            format!("I see {few} that \"{}\" is about", with_expectation(rule))
        });
        let parts: Vec<String> = parts.collect();
        (!parts.is_empty()).then(|| listed(&parts))
    }

    fn skill(&self, vocabulary: &Vocabulary, step: &Step, own: &Snapshot) -> Result<Skill, String> {
        let block = own
            .nearest(&step.features, step.place_m, SAME_PLACE_M)
            .ok_or_else(|| format!("the {} is no longer where it was", step.name))?;
        let lost = || "I do not know where things are".to_owned();
        let [x, y, z] = block.position().ok_or_else(lost)?.to_array();
        let top_m = z + half_height_m(block).unwrap_or(BLOCK_HALF_HEIGHT_M);
        let expected = self.chosen.as_ref().map(|rule| &rule.expectation);
        if let Some(Insertion { inserted, .. }) = expected.and_then(|expected| vocabulary.fills(expected)) {
            let is_loose = |object: &Object| object.states.get(inserted) == Some(&false);
            let peg = self.means(own, step, is_loose);
            let peg = peg.ok_or_else(|| format!("I see nothing that could still be {inserted}"))?;
            return Ok(Skill::Insert {
                thing: peg.position().ok_or_else(lost)?,
                half_height_m: half_height_m(peg).unwrap_or(PEG_HALF_HEIGHT_M),
                hole: Position::new(x, y, top_m),
            });
        }
        if let Some(marked) = expected.and_then(|expected| vocabulary.marks(expected)) {
            // A marker on top of a marked object is in use.
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
            let half_height_m = half_height_m(marker).unwrap_or(MARKER_HALF_HEIGHT_M);
            return Ok(Skill::Place {
                thing: marker.position().ok_or_else(lost)?,
                half_height_m,
                to: Position::new(x, y, top_m + half_height_m),
                turn: None,
            });
        }
        Err(no_skill(&step.wanted))
    }
}

#[cfg(test)]
mod tests {
    use belief::percepts::Percepts;
    use tasks::{Effect, Selection, Signature, Standing};

    use super::*;

    /// Work on a selection of the squares.
    fn work(selection: Selection) -> RulePlan {
        let expectation = Signature::from([Effect::State { name: "filled".to_owned(), on: true }]);
        let rule = Rule {
            expectation,
            template: Vec::new(),
            classes: BTreeSet::from([Vec::new()]),
            selection,
            standing: Standing::default(),
            name: "some of them".to_owned(),
        };
        let learned = Learned { goals: vec![vec![rule]], ..Learned::default() };
        RulePlan::new(&learned)
    }

    /// A row of squares along the robot's x axis.
    fn row(filled: &[bool]) -> Snapshot {
        let object = |(id, &on): (u64, &bool)| Object {
            id,
            features: BTreeMap::from([("colour".to_owned(), "red".to_owned())]),
            states: BTreeMap::from([("filled".to_owned(), on)]),
            position_m: Some([0.1 * quantity::number::float(id), 0.0, 0.0]),
            ..Object::default()
        };
        Snapshot { objects: (1..).zip(filled).map(object).collect(), ..Snapshot::default() }
    }

    /// The squares that are attempted, if only those in `fillable` can be filled.
    fn tried(selection: Selection, squares: usize, fillable: &[usize]) -> Vec<usize> {
        let vocabulary = Vocabulary::of(&Percepts::builtin()).unwrap();
        let (mut work, mut filled, mut tried) = (work(selection), vec![false; squares], Vec::new());
        while let Some(step) = work.choose(&vocabulary, &row(&filled)).unwrap() {
            let square = (0..squares).find(|&at| row(&filled).objects[at].position_m == Some(step.place_m));
            let square = square.unwrap();
            tried.push(square);
            if fillable.contains(&square) {
                filled[square] = true;
                work.done();
            } else {
                work.give_up(&step);
            }
        }
        tried
    }

    #[test]
    fn too_few_objects_for_a_counted_rule_are_reported() {
        let missing = |selection, squares: usize| work(selection).missing(&row(&vec![true; squares]));
        let parts = "I see only 2 things that \"some of them filled\" is about";
        assert_eq!(missing(Selection::Exactly(3), 2).as_deref(), Some(parts));
        assert_eq!(missing(Selection::AllBut(2), 2).as_deref(), Some(parts));
        assert_eq!(missing(Selection::Exactly(3), 3), None);
        assert_eq!(missing(Selection::AllBut(2), 3), None);
        assert_eq!(missing(Selection::All, 1), None);
    }

    #[test]
    fn a_failed_step_is_replaced_by_another_of_the_same_number() {
        assert_eq!(tried(Selection::Exactly(3), 5, &[0, 1, 2, 3, 4]), [0, 1, 2]);
        assert_eq!(tried(Selection::Exactly(3), 5, &[0, 2, 3, 4]), [0, 1, 2, 3]);
        assert_eq!(tried(Selection::AllBut(2), 5, &[1, 2, 4]), [0, 1, 2, 3, 4]);
        assert_eq!(
            tried(Selection::AllBut(2), 5, &[1, 2, 3]),
            [0, 1, 2, 3],
            "two are left, as they should be"
        );
        assert_eq!(tried(Selection::All, 3, &[1]), [0, 1, 2]);
    }
}

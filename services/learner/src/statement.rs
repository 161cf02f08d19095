//! What a sentence about a rule says: its words resolved in the speaker's perspective.

use std::collections::{BTreeMap, BTreeSet};

use geometry::{Base, Person, Pose};
use language::{Act, ActKind, Scope};
use tasks::{
    Description, KnownBy, Language, MAX_COUNT, Object, Snapshot, Statement, describe_object, listed,
};

/// Objects nearer to the middle of a perspective than this are on neither side, in metres.
const SIDE_M: f64 = 0.01;

/// Why a sentence about a rule says nothing that can be learned from.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum UnclearError {
    /// It is about a number of objects.
    #[error(
        "I only learn rules about kinds of things, not about numbers: my `learner.language` is \"paper\""
    )]
    Number,
    /// It is about a number of objects of a kind.
    #[error(
        "I can learn \"{count} of them\", and not a number of one kind: please show me, and say \"I'm done\""
    )]
    NumberOfKind {
        /// The number.
        count: u32,
    },
    /// It says something else about the rule.
    #[error(
        "I do not know what that says about the rule. You can say \"Only the {example} ones\", \"Not the {example} one\" or \
         \"It does not matter which {feature}\""
    )]
    Other {
        /// A value of a feature.
        example: String,
        /// A feature.
        feature: String,
    },
    /// It names no number that a rule can have.
    #[error("I can only learn numbers from 1 to {MAX_COUNT}: please show me, and say \"I'm done\"")]
    NumberOutOfRange,
    /// The side of a person whose point of view is unknown, or is no valid pose.
    #[error(
        "I do not know where that is: I do not take your perspective. Please say which colour or shape you mean"
    )]
    NoPerspective,
    /// No object is there.
    #[error("I know of nothing {place}")]
    Nothing {
        /// The place in words.
        place: String,
    },
    /// A single object is meant, and several are there.
    #[error("which one do you mean: {}?", or(candidates))]
    Ambiguous {
        /// The objects in words.
        candidates: Vec<String>,
    },
}

/// What the speaker and the robot know when the sentence is said.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hearing<'a> {
    pub(crate) language: &'a Language,
    /// What the speaker knows of, as the robot believes; `None` if that perspective is not simulated.
    pub(crate) speakers: Option<&'a Snapshot>,
    pub(crate) own: Option<&'a Snapshot>,
    /// The states that the objects can have; every object if it is empty.
    pub(crate) states: &'a BTreeSet<String>,
    /// Whether rules can have numbers.
    pub(crate) has_numbers: bool,
}

impl Hearing<'_> {
    /// What an act says about a rule.
    pub(crate) fn statement(&self, act: &Act) -> Result<Statement, UnclearError> {
        if act.kind == ActKind::TellIrrelevant {
            return act.feature.clone().map(Statement::Irrelevant).ok_or_else(|| self.other());
        }
        if let (ActKind::TellCount, Some(count)) = (act.kind, act.count) {
            return match usize::try_from(count) {
                _ if !self.has_numbers => Err(UnclearError::Number),
                _ if !act.objects.is_empty() => Err(UnclearError::NumberOfKind { count }),
                Ok(count) if (1..=MAX_COUNT).contains(&count) => Ok(Statement::Exactly(count)),
                Ok(_) | Err(_) => Err(UnclearError::NumberOutOfRange),
            };
        }
        let says = [
            (ActKind::TellOnly, Statement::Only as fn(Vec<Description>) -> Statement),
            (ActKind::TellAlso, Statement::Also),
            (ActKind::TellAll, Statement::Also),
            (ActKind::TellNot, Statement::Not),
            (ActKind::TellAllBut, Statement::AllBut),
        ];
        let says = says.into_iter().find(|(kind, _)| *kind == act.kind).map(|(_, says)| says);
        Ok(says.ok_or_else(|| self.other())?(self.descriptions(act)?))
    }

    fn descriptions(&self, act: &Act) -> Result<Vec<Description>, UnclearError> {
        let named = self.named(&act.objects);
        let known = match act.scope {
            Some(Scope::ISee) => Some(KnownBy::Speaker),
            // "All of them, also those that I cannot see" are all that the robot knows of.
            Some(Scope::IDoNotSee) if act.kind == ActKind::TellAll => Some(KnownBy::Robot),
            Some(Scope::IDoNotSee) => Some(KnownBy::NotSpeaker),
            Some(Scope::YouSee) => Some(KnownBy::Robot),
            Some(Scope::MyLeft | Scope::MyRight | Scope::YourLeft | Scope::YourRight) => {
                return self.on_a_side(act, &named);
            }
            None if act.kind == ActKind::TellAll => Some(KnownBy::Speaker),
            None => None,
        };
        if named.is_empty() && known.is_none() {
            return Err(self.other());
        }
        let features = if named.is_empty() { vec![BTreeMap::new()] } else { named };
        Ok(features.into_iter().map(|features| Description { features, known }).collect())
    }

    /// The features of each object that a sentence names. A noun at the end belongs to all of them: "red and green
    /// squares". Two values of one feature are two objects: "red green ones".
    fn named(&self, objects: &[Vec<String>]) -> Vec<BTreeMap<String, String>> {
        let mut named: Vec<BTreeMap<String, String>> = Vec::new();
        for object in objects {
            let mut features = BTreeMap::new();
            for value in object {
                let is_it = |words: &&tasks::FeatureWords| words.values.contains(value);
                let Some(feature) = self.language.features.iter().find(is_it) else { continue };
                if features.contains_key(&feature.name) {
                    named.push(std::mem::take(&mut features));
                }
                features.insert(feature.name.clone(), value.clone());
            }
            named.push(features);
        }
        named.retain(|features| !features.is_empty());
        let noun = self.language.features.last().map(|noun| &noun.name);
        let last =
            noun.zip(named.last()).and_then(|(noun, last)| Some((noun.clone(), last.get(noun)?.clone())));
        if let Some((noun, value)) = last
            && named.iter().rev().skip(1).all(|features| !features.contains_key(&noun))
        {
            for features in &mut named {
                features.insert(noun.clone(), value.clone());
            }
        }
        named
    }

    /// The kinds of the objects on a side of a person.
    fn on_a_side(
        &self,
        act: &Act,
        named: &[BTreeMap<String, String>],
    ) -> Result<Vec<Description>, UnclearError> {
        let is_left = matches!(act.scope, Some(Scope::MyLeft | Scope::YourLeft));
        let is_speakers = matches!(act.scope, Some(Scope::MyLeft | Scope::MyRight));
        // The speaker can only mean what they know of, wherever they say that it is.
        let objects = self.speakers.or(self.own).map_or(&[][..], |view| &view.objects);
        let frame = if is_speakers { self.speakers } else { self.own };
        let x_base_person = frame.and_then(|view| {
            Pose::<Base, Person>::from_parts(view.frame_position_m, view.frame_orientation_xyzw)
        });
        let x_person_base: Pose<Person, Base> = x_base_person.ok_or(UnclearError::NoPerspective)?.inverse();
        let is_there = |object: &&Object| {
            let left_m = object.position().map(|place| (x_person_base * place).to_array()[1]);
            left_m.is_some_and(|left_m| if is_left { left_m > SIDE_M } else { left_m < -SIDE_M })
        };
        let is_meant = |object: &&Object| {
            let has = |features: &BTreeMap<String, String>| {
                features.iter().all(|(name, value)| object.features.get(name) == Some(value))
            };
            let is_eligible =
                self.states.is_empty() || object.states.keys().any(|state| self.states.contains(state));
            is_eligible && (named.is_empty() || named.iter().any(has))
        };
        let found: Vec<&Object> = objects.iter().filter(is_there).filter(is_meant).collect();
        let kinds: BTreeSet<&BTreeMap<String, String>> =
            found.iter().map(|object| &object.features).collect();
        if kinds.is_empty() {
            return Err(UnclearError::Nothing { place: side(is_left, is_speakers).to_owned() });
        }
        if act.is_single && kinds.len() > 1 {
            let name = |object: &&Object| {
                format!("the {}", describe_object(self.language, object, found.iter().copied()))
            };
            let candidates: BTreeSet<String> = found.iter().map(name).collect();
            return Err(UnclearError::Ambiguous { candidates: candidates.into_iter().collect() });
        }
        Ok(kinds
            .into_iter()
            .map(|features| Description { features: features.clone(), known: None })
            .collect())
    }

    fn other(&self) -> UnclearError {
        let feature = self.language.features.iter().find(|feature| !feature.values.is_empty());
        let example = feature.and_then(|feature| feature.values.first());
        UnclearError::Other {
            example: example.cloned().unwrap_or_default(),
            feature: feature.map(|feature| feature.name.clone()).unwrap_or_default(),
        }
    }
}

/// A side of a person, said to the speaker.
const fn side(is_left: bool, is_speakers: bool) -> &'static str {
    match (is_left, is_speakers) {
        (true, true) => "on your left",
        (false, true) => "on your right",
        (true, false) => "on my left",
        (false, false) => "on my right",
    }
}

/// "a, b or c".
fn or(items: &[String]) -> String {
    match items {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => listed(items),
    }
}

//! What a teacher says about the rule of a task.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::snapshot::Object;
use crate::language::{Language, in_words, listed};

/// The class features of an object, by name.
pub(crate) type Kind = BTreeMap<String, String>;

/// A sentence about the rule of a task, as evidence beside its demonstrations.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Telling {
    /// The speaker: partner 1, 2, …
    pub speaker: u16,
    /// What it says about the rule.
    pub statement: Statement,
    /// The number of the first examples over which it prevails where they contradict it: the teacher confirmed it after
    /// Leo had asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prevails: Option<usize>,
}

/// What a sentence says about the objects that a rule applies to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Statement {
    /// "Only the red ones": to these and to no others.
    Only(Vec<Description>),
    /// "Also the red ones": to these; nothing about others.
    Also(Vec<Description>),
    /// "Not the blue one": not to these; nothing about others.
    Not(Vec<Description>),
    /// "All but the blue ones": to all others, and not to these.
    AllBut(Vec<Description>),
    /// "It does not matter which colour": what holds for an object holds for all that differ in this feature alone.
    Irrelevant(String),
    /// "Three of them": to this number of objects, whichever they are.
    Exactly(usize),
}

/// A description of objects.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Description {
    /// The class features that it names.
    #[serde(default)]
    pub features: BTreeMap<String, String>,
    /// The agent that has to know of the objects; `None` if it makes no difference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known: Option<KnownBy>,
}

/// Who knows of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KnownBy {
    /// The speaker: "the ones I can see".
    Speaker,
    /// Not the speaker, but the robot: "the ones behind the wall".
    NotSpeaker,
    /// The robot: "the ones you can see".
    Robot,
}

/// The kinds of objects that the speaker and the robot know of.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownKinds {
    pub(crate) speaker: BTreeSet<Kind>,
    pub(crate) robot: BTreeSet<Kind>,
}

impl Description {
    /// Whether it describes a kind; `None` if the kind lacks a feature that it names.
    fn matches(&self, kind: &Kind, known: &KnownKinds) -> Option<bool> {
        let is_known = self.known.is_none_or(|by| match by {
            KnownBy::Speaker => known.speaker.contains(kind),
            KnownBy::NotSpeaker => known.robot.contains(kind) && !known.speaker.contains(kind),
            KnownBy::Robot => known.robot.contains(kind),
        });
        let values = self.features.iter().map(|(name, value)| Some(kind.get(name)? == value));
        let all: Vec<Option<bool>> = values.chain([Some(is_known)]).collect();
        // What differs in one feature is another kind, whatever else is unknown.
        if all.contains(&Some(false)) { Some(false) } else { (!all.contains(&None)).then_some(true) }
    }

    /// It in words, said to the speaker: "red squares", "ones that you can see".
    fn words(&self, language: &Language) -> String {
        let object = Object { features: self.features.clone(), ..Object::default() };
        let order = language.features.iter().filter_map(|feature| object.features.get(&feature.name));
        let has_noun = language.features.last().is_some_and(|noun| self.features.contains_key(&noun.name));
        let mut words: Vec<&str> = order.map(String::as_str).collect();
        if !has_noun {
            words.push("ones");
        }
        let words = words.join(" ") + if has_noun { "s" } else { "" };
        match self.known {
            None => words,
            Some(KnownBy::Speaker) => format!("{words} that you can see"),
            Some(KnownBy::NotSpeaker) => format!("{words} that you cannot see"),
            Some(KnownBy::Robot) => format!("{words} that I can see"),
        }
    }
}

impl Statement {
    /// What it says about a kind: whether the rule applies; `None` if it says nothing. What is said of a feature that
    /// does not matter depends on the demonstrations.
    pub(crate) fn label(&self, kind: &Kind, known: &KnownKinds) -> Option<bool> {
        let (Self::Only(which) | Self::Also(which) | Self::Not(which) | Self::AllBut(which)) = self else {
            return None;
        };
        let found = which.iter().map(|description| description.matches(kind, known));
        let is_meant = found.clone().any(|matches| matches == Some(true));
        let is_other = found.clone().all(|matches| matches == Some(false));
        match self {
            Self::Only(_) => is_meant.then_some(true).or_else(|| is_other.then_some(false)),
            Self::Also(_) => is_meant.then_some(true),
            Self::Not(_) => is_meant.then_some(false),
            Self::AllBut(_) => is_meant.then_some(false).or_else(|| is_other.then_some(true)),
            Self::Irrelevant(_) | Self::Exactly(_) => None,
        }
    }

    /// The features by which it names objects.
    pub(crate) fn named(&self) -> impl Iterator<Item = &Kind> {
        let which = match self {
            Self::Only(which) | Self::Also(which) | Self::Not(which) | Self::AllBut(which) => {
                which.as_slice()
            }
            Self::Irrelevant(_) | Self::Exactly(_) => &[],
        };
        which.iter().filter(|which| which.known.is_none()).map(|which| &which.features)
    }

    /// Whether it names a kind, so that its speaker knows that there are such objects.
    pub(crate) fn names(&self, kind: &Kind, known: &KnownKinds) -> bool {
        let (Self::Only(which) | Self::Also(which) | Self::Not(which) | Self::AllBut(which)) = self else {
            return false;
        };
        let is_named = |which: &&Description| {
            !which.features.is_empty() || matches!(which.known, Some(KnownBy::NotSpeaker | KnownBy::Robot))
        };
        which.iter().filter(is_named).any(|description| description.matches(kind, known) == Some(true))
    }

    /// It in words, said to the speaker: "only the red ones".
    #[must_use]
    pub fn words(&self, language: &Language) -> String {
        let the = |which: &[Description]| {
            let named = which.iter().map(|description| format!("the {}", description.words(language)));
            listed(&named.collect::<Vec<_>>())
        };
        let is_everything = |which: &[Description]| which.iter().any(|which| which.features.is_empty());
        match self {
            Self::Also(which) if is_everything(which) => format!("all {}", the(which)),
            Self::Only(which) => format!("only {}", the(which)),
            Self::Also(which) => format!("also {}", the(which)),
            Self::Not(which) => format!("not {}", the(which)),
            Self::AllBut(which) => format!("all except {}", the(which)),
            Self::Irrelevant(feature) => format!("the {feature} does not matter"),
            Self::Exactly(count) => format!("exactly {} of them", in_words(*count)),
        }
    }
}

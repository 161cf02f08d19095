use serde::Deserialize;

/// What a person wants with a sentence, with the names in it.
///
/// `None` for a task means that the sentence names none, and the dialogue has no current one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Act {
    /// The kind of act.
    pub kind: ActKind,
    /// The task that it is about: as the dialogue knows it, or as the person spelled a new one.
    pub task: Option<String>,
    /// The new name that it gives.
    pub name: Option<String>,
    /// The objects that it is about, each by its features as the context spells them. "The red square and the blue one"
    /// has two.
    pub objects: Vec<Vec<String>>,
    /// Which of the objects: those on a side, or those that a person sees.
    pub scope: Option<Scope>,
    /// The feature that it is about, as the context spells it: "colour".
    pub feature: Option<String>,
    /// The number of objects.
    pub count: Option<u32>,
    /// Whether it is about a single object: "the one on my left".
    pub is_single: bool,
}

/// Objects on a side of a person, or those that a person sees. A rule of a language file whose name is `scope_` and one of these in snake case
/// means it.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// "That I can see".
    ISee,
    /// "That I can't see", "behind the wall".
    IDoNotSee,
    /// "That you can see".
    YouSee,
    /// "On my left".
    MyLeft,
    /// "On my right".
    MyRight,
    /// "On your left".
    YourLeft,
    /// "On your right".
    YourRight,
}

impl Scope {
    /// The scope of a name in a language file.
    pub(crate) fn named(name: &str) -> Option<Self> {
        let name = serde::de::value::StrDeserializer::<serde::de::value::Error>::new(name);
        Self::deserialize(name).ok()
    }
}

impl Act {
    /// An act about nothing in particular.
    #[must_use]
    pub fn new(kind: ActKind) -> Self {
        Self {
            kind,
            task: None,
            name: None,
            objects: Vec::new(),
            scope: None,
            feature: None,
            count: None,
            is_single: false,
        }
    }
}

/// The kinds of acts. A language file names them in snake case.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[serde(rename_all = "snake_case")]
pub enum ActKind {
    /// "Stop": hold still.
    Stop,
    /// "Don't stop": goes on with what is in progress, and starts nothing.
    KeepOn,
    /// "Hello".
    Greet,
    /// "Goodbye".
    Farewell,
    /// "Help", "What can I say?"
    Help,
    /// "Thank you".
    Thank,
    /// "Well done".
    Praise,
    /// "Yes", "That's right".
    Confirm,
    /// "No", "That was wrong".
    Deny,
    /// "Let me show you filling": begins a demonstration.
    Teach,
    /// "This is called filling": names what is being shown.
    Name,
    /// "Rename task 1 to filling".
    Rename,
    /// "I'm done", "Filling is done": ends the demonstration.
    End,
    /// "Cancel": drops the demonstration.
    Cancel,
    /// "Go on".
    GoOn,
    /// "Do filling": performs a task.
    Do,
    /// "Do it again".
    Again,
    /// "Can you do filling?", without a request.
    Can,
    /// "Undo the last step".
    Undo,
    /// "No, like this": shows it anew.
    LikeThis,
    /// "Not that one": leaves the present object alone.
    NotThatOne,
    /// "Forget filling".
    Forget,
    /// "Which tasks do you know?"
    ListTasks,
    /// "What did you learn?"
    Learned,
    /// "What do you see?"
    SeeLeo,
    /// "What do you know?", "Where is the blue square?"
    KnowLeo,
    /// "What do you think I see?"
    SeeMe,
    /// "What do you think I know?"
    KnowMe,
    /// "Why?"
    Why,
    /// "How sure are you?"
    HowSure,
    /// "What next?"
    WhatNext,
    /// "What would settle it?"
    WhatSettles,
    /// "Only the red ones": tells which objects a rule is about.
    TellOnly,
    /// "Also the red ones".
    TellAlso,
    /// "Not the blue one".
    TellNot,
    /// "All but the blue ones".
    TellAllBut,
    /// "All of them".
    TellAll,
    /// "It does not matter which colour".
    TellIrrelevant,
    /// "Three of them".
    TellCount,
    /// Tells something about a rule in other words.
    Tell,
}

impl ActKind {
    /// Whether the act can start a movement.
    #[must_use]
    pub const fn is_movement(self) -> bool {
        matches!(self, Self::Do | Self::Again | Self::GoOn)
    }

    /// Whether the act tells something about a rule.
    #[must_use]
    pub const fn is_telling(self) -> bool {
        matches!(
            self,
            Self::TellOnly
                | Self::TellAlso
                | Self::TellNot
                | Self::TellAllBut
                | Self::TellAll
                | Self::TellIrrelevant
                | Self::TellCount
                | Self::Tell
        )
    }

    /// Whether the act asks something.
    #[must_use]
    pub const fn is_question(self) -> bool {
        matches!(
            self,
            Self::Help
                | Self::Can
                | Self::ListTasks
                | Self::Learned
                | Self::SeeLeo
                | Self::KnowLeo
                | Self::SeeMe
                | Self::KnowMe
                | Self::Why
                | Self::HowSure
                | Self::WhatNext
                | Self::WhatSettles
        )
    }
}

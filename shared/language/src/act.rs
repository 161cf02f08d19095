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
    /// The features of the object that it is about, as the context spells them; empty if it is about no single one.
    pub object: Vec<String>,
}

impl Act {
    /// An act about nothing in particular.
    #[must_use]
    pub fn new(kind: ActKind) -> Self {
        Self { kind, task: None, name: None, object: Vec::new() }
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
    /// "Only the red ones": tells a rule.
    Tell,
}

impl ActKind {
    /// Whether the act can start a movement.
    #[must_use]
    pub const fn is_movement(self) -> bool {
        matches!(self, Self::Do | Self::Again | Self::GoOn)
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

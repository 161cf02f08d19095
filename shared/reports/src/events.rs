//! An event of the learner as text.

use config::Names;
use message::{Event, EventKind};
use quantity::number::counted;

/// The category of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineKind {
    /// An utterance.
    Said,
    /// An event of a task, or a note about the robot.
    Note,
    /// What a perspective sees.
    Sees,
    /// A recognised action.
    Saw,
    /// A hypothesis.
    Thinks,
    /// The rule that was chosen.
    Rule,
    /// An explanation.
    Why,
    /// A step begins.
    Does,
    /// A step succeeded.
    Done,
    /// A step failed.
    Failed,
    /// The outcome of a performance.
    Result,
    /// A difference between the beliefs of a partner and Leo.
    Knows,
}

impl LineKind {
    /// The serialised name.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Said => "said",
            Self::Note => "note",
            Self::Sees => "sees",
            Self::Saw => "saw",
            Self::Thinks => "thinks",
            Self::Rule => "rule",
            Self::Why => "why",
            Self::Does => "does",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Result => "result",
            Self::Knows => "knows",
        }
    }
}

/// The category and the text of an event; `None` if the event is malformed.
#[must_use]
pub fn event_text(names: &Names, event: &Event) -> Option<(LineKind, String)> {
    let (text, task) = (event.text.as_str(), event.task.as_str());
    let whose = match event.perspective {
        0 => "Leo's own view".to_owned(),
        partner => format!("{}'s view", names.of(partner)),
    };
    Some(match event.kind()? {
        EventKind::Said => (LineKind::Said, text.to_owned()),
        EventKind::TeachingStarted => (LineKind::Note, format!("watches how to do {task}")),
        EventKind::Seen => (LineKind::Sees, format!("{text} ({whose})")),
        EventKind::MovementSeen => (LineKind::Sees, text.to_owned()),
        EventKind::ActionSeen => (LineKind::Saw, text.to_owned()),
        EventKind::DemonstrationEnded | EventKind::Answered | EventKind::Told => {
            (LineKind::Note, format!("{} of {task} so far", counted(event.examples, "example")))
        }
        EventKind::Hypothesis => {
            let Event { posterior, tally, examples, .. } = event;
            let sure = format!("posterior {posterior:.4}, tally {tally}/{examples}");
            (LineKind::Thinks, format!("{text:<28} in {whose}: {sure}"))
        }
        EventKind::RuleChosen => (LineKind::Rule, format!("{} ({whose})", text.to_uppercase())),
        EventKind::Explained => (LineKind::Why, text.to_owned()),
        EventKind::PerformanceStarted => (LineKind::Note, format!("performs {task}")),
        EventKind::StepStarted => (LineKind::Does, text.to_owned()),
        EventKind::StepDone => (LineKind::Done, text.to_owned()),
        EventKind::StepFailed => (LineKind::Failed, text.to_owned()),
        EventKind::PerformanceEnded => (LineKind::Result, text.to_owned()),
        EventKind::ContinuityBroken => (LineKind::Note, text.to_owned()),
        EventKind::Declined => (LineKind::Note, format!("declines: {text}")),
        EventKind::Renamed => (LineKind::Note, format!("calls {task} {text} now")),
        EventKind::Forgotten => (LineKind::Note, format!("forgets {task}")),
        EventKind::Remembered => {
            (LineKind::Note, format!("remembers {task}: {}", counted(event.examples, "example")))
        }
    })
}

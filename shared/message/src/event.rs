use crate::bytes::message;
use crate::{Text, ZeroCopySend, wire_enum};

wire_enum! {
    /// Kind of an event of the learner.
    EventKind: u16 {
        /// Leo said something; the text is the sentence.
        Said = 1,
        /// A lesson about a task began; the text is its name.
        TeachingStarted = 2,
        /// An action was recognised; the text names actor and action.
        ActionSeen = 3,
        /// A demonstration ended and became an example; the text is the task's name.
        DemonstrationEnded = 4,
        /// A hypothesis with its posterior, tally and rank; the text is its computed name.
        Hypothesis = 5,
        /// The primary hypothesis of a task was chosen; the text is its computed name.
        RuleChosen = 6,
        /// Why the hypotheses of two perspectives differ; the text explains it.
        Explained = 7,
        /// Leo began to perform a task; the text is its name.
        PerformanceStarted = 8,
        /// A step of the performance began; the text names it.
        StepStarted = 9,
        /// A step ended, and the robot's beliefs confirm it; the text names it.
        StepDone = 10,
        /// A step ended without its expected effect; the text gives the reason.
        StepFailed = 11,
        /// The performance ended; the text gives the result.
        PerformanceEnded = 12,
        /// The continuity of the belief buffer was broken, because its process restarted.
        ContinuityBroken = 13,
        /// The objects in a perspective when a demonstration or a performance begins; the text lists them.
        Seen = 14,
        /// Leo refused to perform a task; the text is its reply.
        Declined = 15,
        /// Leo's question about a task was answered, and the answer became an example; the text is "yes" or "no".
        Answered = 16,
        /// An agent's movement matched one of Leo's own movements; the text names agent and expected action.
        MovementSeen = 17,
        /// A task from memory, followed by its hypotheses; sent to new subscribers.
        Remembered = 18,
        /// A teacher said something about a task's rule, and the sentence became an example; the text is what Leo
        /// understood.
        Told = 19,
        /// A task has another name now: the text.
        Renamed = 20,
        /// A task was forgotten; the text is its name.
        Forgotten = 21,
    }
}

message! {
    /// An event of the learner.
    #[derive(Debug, Default, PartialEq)]
    pub struct Event as "leo/Event/1" {
        /// Posterior probability of a hypothesis within its perspective, in [0, 1].
        pub posterior: f64,
        /// An [`EventKind`].
        pub kind: u16,
        /// The perspective it belongs to: 0 the robot's, n partner n's.
        pub perspective: u16,
        /// Rank of a hypothesis from 1; hypotheses that tie share their rank.
        pub rank: u32,
        /// Examples that a hypothesis is consistent with.
        pub tally: u32,
        /// Examples seen.
        pub examples: u32,
        /// Whether it is a high-likelihood hypothesis: 1 yes, 0 no.
        pub high_likelihood: u32,
        /// Steps of a performance that succeeded.
        pub succeeded: u32,
        /// The task that the event is about.
        pub task: Text,
        /// The text of the event.
        pub text: Text,
    }
}

impl Event {
    /// An event of a kind about a task; all other fields are zero.
    #[must_use]
    pub fn new(kind: EventKind, task: &str, text: &str) -> Self {
        Self { kind: kind.raw(), task: Text::new(task), text: Text::new(text), ..Self::default() }
    }

    /// The kind; `None` if the number is invalid.
    #[must_use]
    pub fn kind(&self) -> Option<EventKind> {
        EventKind::from_raw(self.kind)
    }
}

use config::Names;
use message::{Event, EventKind, NOBODY, Utterance};
use reports::events::{LineKind, event_text};

/// An event as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Time of the event, in nanoseconds of the monotonic clock.
    pub at_ns: u64,
    /// The speaker of an utterance.
    pub who: Option<String>,
    /// The category.
    pub kind: LineKind,
    /// The text.
    pub text: String,
}

/// Converts events into lines of text.
#[derive(Clone, Debug, Default)]
pub struct Narrator {
    names: Names,
    /// Whether the current events repeat a remembered task; those were reported when it was learned.
    recalls: bool,
}

impl Narrator {
    /// A narrator that uses the given names of agents.
    #[must_use]
    pub fn new(names: &Names) -> Self {
        Self { names: names.clone(), recalls: false }
    }

    /// A line about a teacher's utterance at `at_ns`.
    #[must_use]
    pub fn utterance(&self, at_ns: u64, utterance: &Utterance) -> Line {
        let speaker = u16::try_from(utterance.speaker).unwrap_or(NOBODY);
        let text = utterance.text.as_str().to_owned();
        Line { at_ns, who: Some(self.names.of(speaker)), kind: LineKind::Said, text }
    }

    /// A line about an event of the learner at `at_ns`. `None` if the event is malformed or not shown to people.
    #[must_use]
    pub fn event(&mut self, at_ns: u64, event: &Event) -> Option<Line> {
        let kind = event.kind()?;
        let is_verdict = matches!(kind, EventKind::Hypothesis | EventKind::RuleChosen | EventKind::Explained);
        self.recalls = kind == EventKind::Remembered || self.recalls && is_verdict;
        let is_unlikely = kind == EventKind::Hypothesis && event.high_likelihood == 0;
        if self.recalls && is_verdict || is_unlikely || kind == EventKind::Declined {
            return None;
        }
        let who = (kind == EventKind::Said).then(|| self.names.of(0));
        let (kind, text) = event_text(&self.names, event)?;
        Some(Line { at_ns, who, kind, text })
    }

    /// A line about the robot itself, at `at_ns`.
    #[must_use]
    pub fn note(&self, at_ns: u64, words: &str) -> Line {
        Line { at_ns, who: None, kind: LineKind::Note, text: words.to_owned() }
    }

    /// A line about a difference between a partner and Leo that begins or ends at `at_ns`.
    #[must_use]
    pub fn divide(&self, at_ns: u64, words: &str) -> Line {
        Line { at_ns, who: None, kind: LineKind::Knows, text: words.to_owned() }
    }
}

/// Formats lines as text, with the seconds since the first line.
#[derive(Clone, Copy, Debug, Default)]
pub struct Transcript {
    first_ns: Option<u64>,
}

impl Transcript {
    /// A line as text, including the line feed.
    pub fn text(&mut self, line: &Line) -> String {
        let first = *self.first_ns.get_or_insert(line.at_ns);
        let since = clock::Instant::from_nanos(line.at_ns).since(clock::Instant::from_nanos(first));
        let text = &line.text;
        let words = match (line.kind, &line.who) {
            // Leo's utterances are aligned with the lines about its actions.
            (LineKind::Said, Some(who)) => {
                let who = if who == "Leo" { "Leo:    " } else { &format!("{who}:") };
                format!("{who} \"{}\"", text.replace('"', "'"))
            }
            (LineKind::Note, _) => format!("         {text}"),
            (LineKind::Failed, _) => format!("  FAILED {text}"),
            (kind, _) => format!("  {:<6} {text}", kind.word()),
        };
        format!("[{:7.2} s] {words}\n", since.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(transcript: &mut Transcript, at_ns: u64, event: &Event) -> String {
        Narrator::default().event(at_ns, event).map_or(String::new(), |line| transcript.text(&line))
    }

    #[test]
    fn an_event_becomes_one_line_with_its_time() {
        let mut transcript = Transcript::default();
        let said = Event::new(EventKind::Said, "", "I am ready");
        assert_eq!(text(&mut transcript, 5_000_000_000, &said), "[   0.00 s] Leo:     \"I am ready\"\n");
        let said = Event::new(EventKind::Said, "", "say \"task 1 is done\"");
        assert_eq!(
            text(&mut transcript, 5_000_000_000, &said),
            "[   0.00 s] Leo:     \"say 'task 1 is done'\"\n"
        );
        let done = Event::new(EventKind::StepDone, "task 1", "a peg");
        assert_eq!(text(&mut transcript, 6_500_000_000, &done), "[   1.50 s]   done   a peg\n");
    }

    #[test]
    fn events_of_a_remembered_task_are_not_repeated() {
        let (mut narrator, mut transcript) = (Narrator::default(), Transcript::default());
        let mut text = |event: &Event| narrator.event(1, event).map(|line| transcript.text(&line));
        let rule = Event::new(EventKind::RuleChosen, "task 1", "all");
        assert!(text(&rule).is_some());
        let remembered = Event { examples: 2, ..Event::new(EventKind::Remembered, "task 1", "task 1") };
        let told = text(&remembered).unwrap_or_default();
        assert!(told.ends_with("remembers task 1: 2 examples\n"), "{told}");
        assert_eq!(text(&rule), None);
        assert!(text(&Event::new(EventKind::DemonstrationEnded, "task 1", "task 1")).is_some());
        assert!(text(&rule).is_some());
    }

    #[test]
    fn a_malformed_event_gives_no_line() {
        let lie = Event { kind: 999, ..Event::new(EventKind::Said, "", "x") };
        assert_eq!(text(&mut Transcript::default(), 1, &lie), "");
    }
}

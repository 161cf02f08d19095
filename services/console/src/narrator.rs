use std::fmt::Write as _;

use config::Names;
use message::{Event, EventKind, NOBODY, Utterance};

/// Puts events into words, with the seconds since the first one before them.
#[derive(Clone, Debug, Default)]
pub struct Narrator {
    names: Names,
    first_ns: Option<u64>,
}

impl Narrator {
    /// Nothing told yet, by people who are called so.
    #[must_use]
    pub fn new(names: &Names) -> Self {
        Self { names: names.clone(), first_ns: None }
    }

    /// A line about what a teacher said at `at_ns`.
    pub fn utterance(&mut self, at_ns: u64, utterance: &Utterance, out: &mut String) {
        let speaker = u16::try_from(utterance.speaker).unwrap_or(NOBODY);
        let words = format!("{}: \"{}\"", self.names.of(speaker), utterance.text.as_str());
        self.line(at_ns, &words, out);
    }

    /// A line about an event of the learner at `at_ns`; none where the numbers are no event.
    pub fn event(&mut self, at_ns: u64, event: &Event, out: &mut String) {
        let text = event.text.as_str();
        let task = event.task.as_str();
        let whose = match event.perspective {
            0 => "Leo's own view".to_owned(),
            partner => format!("{}'s view", self.names.of(partner)),
        };
        let words = match event.kind() {
            Some(EventKind::Said) => format!("Leo:     \"{text}\""),
            Some(EventKind::TeachingStarted) => format!("         watches how to do {task}"),
            Some(EventKind::Seen) => format!("  sees   {text} ({whose})"),
            Some(EventKind::ActionSeen) => format!("  saw    {text}"),
            Some(EventKind::DemonstrationEnded) => {
                let plural = if event.examples == 1 { "" } else { "s" };
                format!("         {} example{plural} of {task} so far", event.examples)
            }
            Some(EventKind::Hypothesis) if event.high_likelihood != 0 => format!(
                "  thinks {text:<28} in {whose}: posterior {:.4}, tally {}/{}",
                event.posterior, event.tally, event.examples
            ),
            Some(EventKind::RuleChosen) => format!("  rule   {} ({whose})", text.to_uppercase()),
            Some(EventKind::Explained) => format!("  why    {text}"),
            Some(EventKind::PerformanceStarted) => format!("         performs {task}"),
            Some(EventKind::StepStarted) => format!("  does   {text}"),
            Some(EventKind::StepDone) => format!("  done   {text}"),
            Some(EventKind::StepFailed) => format!("  FAILED {text}"),
            Some(EventKind::PerformanceEnded) => format!("  result {text}"),
            Some(EventKind::ContinuityBroken) => format!("  note   {text}"),
            Some(EventKind::Hypothesis | EventKind::Declined) | None => return,
        };
        self.line(at_ns, &words, out);
    }

    /// A line about how somebody and Leo differ, or no longer differ, at `at_ns`.
    pub fn divide(&mut self, at_ns: u64, words: &str, out: &mut String) {
        self.line(at_ns, &format!("  knows  {words}"), out);
    }

    fn line(&mut self, at_ns: u64, words: &str, out: &mut String) {
        let first = *self.first_ns.get_or_insert(at_ns);
        let since = clock::Instant::from_nanos(at_ns).since(clock::Instant::from_nanos(first));
        // Writing to a string cannot fail.
        let _ = writeln!(out, "[{:7.2} s] {words}", since.as_secs_f64());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_becomes_one_line_with_its_time() {
        let mut narrator = Narrator::default();
        let mut out = String::new();
        narrator.event(5_000_000_000, &Event::new(EventKind::Said, "", "I am ready"), &mut out);
        narrator.event(6_500_000_000, &Event::new(EventKind::StepDone, "task 1", "a peg"), &mut out);
        assert_eq!(out, "[   0.00 s] Leo:     \"I am ready\"\n[   1.50 s]   done   a peg\n");
    }

    #[test]
    fn nonsense_becomes_no_line() {
        let mut out = String::new();
        let lie = Event { kind: 999, ..Event::new(EventKind::Said, "", "x") };
        Narrator::default().event(1, &lie, &mut out);
        assert_eq!(out, "");
    }
}

use std::collections::VecDeque;

use message::Event;

/// A queue of events in order. Events about examples that are not durable yet are held back, and so are all later ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct EventQueue {
    waiting: VecDeque<Report>,
}

/// The events of an instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Report {
    pub(crate) at_ns: u64,
    pub(crate) events: Vec<Event>,
    /// Number of its examples that are not durable yet.
    unsaved: usize,
}

impl EventQueue {
    /// Appends events, to be released after `unsaved` more examples are durable.
    pub(crate) fn push(&mut self, at_ns: u64, unsaved: usize, events: Vec<Event>) {
        if !events.is_empty() || unsaved > 0 {
            self.waiting.push_back(Report { at_ns, events, unsaved });
        }
    }

    /// The oldest pending example is durable, or failed; then `complaint` is appended to its events.
    pub(crate) fn saved(&mut self, complaint: Option<Event>) {
        if let Some(report) = self.waiting.iter_mut().find(|report| report.unsaved > 0) {
            report.unsaved -= 1;
            report.events.extend(complaint);
        }
    }

    /// The next report that is ready for release.
    pub(crate) fn next(&mut self) -> Option<Report> {
        let may_be_told = self.waiting.front().is_some_and(|report| report.unsaved == 0);
        if may_be_told { self.waiting.pop_front() } else { None }
    }
}

#[cfg(test)]
mod tests {
    use message::EventKind;

    use super::*;

    fn told(reports: &mut EventQueue) -> Vec<String> {
        std::iter::from_fn(|| reports.next())
            .flat_map(|report| report.events)
            .map(|event| event.text.as_str().to_owned())
            .collect()
    }

    fn said(text: &str) -> Event {
        Event::new(EventKind::Said, "", text)
    }

    #[test]
    fn learned_examples_are_reported_in_order_once_durable() {
        let mut reports = EventQueue::default();
        reports.push(1, 0, vec![said("a")]);
        reports.push(2, 2, vec![said("learned")]);
        reports.push(3, 0, vec![said("b")]);
        reports.push(4, 1, vec![said("learned more")]);
        assert_eq!(told(&mut reports), ["a"]);
        reports.saved(None);
        assert_eq!(told(&mut reports), [""; 0]);
        reports.saved(Some(said("sorry")));
        assert_eq!(told(&mut reports), ["learned", "sorry", "b"]);
        reports.saved(None);
        assert_eq!(told(&mut reports), ["learned more"]);
        // No report is pending.
        reports.saved(None);
        reports.push(5, 0, Vec::new());
        assert!(reports.next().is_none());
    }
}

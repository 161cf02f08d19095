//! Failure detection for the black box.

use std::collections::{BTreeMap, BTreeSet};

use message::{Process, Roster};

/// A failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FailureEvent {
    /// The word for the dump's file name.
    pub(crate) word: String,
    /// Description for the operator.
    pub(crate) what: String,
}

/// Detects new failures. The first reading is the baseline and reports none.
#[derive(Debug, Default)]
pub(crate) struct FailureDetector {
    incarnations: BTreeMap<Process, u64>,
    /// Joints that have ever been quarantined: each is reported once.
    quarantined: BTreeSet<u32>,
    is_stopped: Option<bool>,
}

impl FailureDetector {
    /// Compares the incarnations of the processes. A higher one means that the process died unexpectedly.
    pub(crate) fn check_processes(&mut self, roster: &Roster) -> Vec<FailureEvent> {
        let is_first = self.incarnations.is_empty();
        let mut failed = Vec::new();
        for &process in Process::ALL {
            let Some(incarnation) = roster.incarnation(process) else { continue };
            // A process that was absent before is expected to be in its first incarnation.
            let known = self.incarnations.insert(process, incarnation).unwrap_or(if is_first {
                incarnation
            } else {
                1
            });
            if incarnation > known {
                let what = format!("{process} died and was restarted (incarnation {incarnation})");
                failed.push(FailureEvent { word: process.name().to_owned(), what });
            }
        }
        failed
    }

    /// Reports newly quarantined joints.
    pub(crate) fn check_joints(&mut self, quarantined: &[u32], names: &[String]) -> Vec<FailureEvent> {
        let new: Vec<u32> =
            quarantined.iter().copied().filter(|joint| self.quarantined.insert(*joint)).collect();
        let Some(first) = new.first() else { return Vec::new() };
        let name = |joint: u32| {
            let name = usize::try_from(joint).ok().and_then(|joint| names.get(joint));
            name.cloned().unwrap_or_else(|| format!("joint {joint}"))
        };
        let what = match new.len() {
            1 => format!("{} is quarantined", name(*first)),
            count => format!("{} and {} further joints are quarantined", name(*first), count - 1),
        };
        vec![FailureEvent { word: "quarantine".to_owned(), what }]
    }

    /// Reports that the emergency stop was raised.
    pub(crate) fn check_emergency_stop(&mut self, is_raised: bool) -> Vec<FailureEvent> {
        let was = self.is_stopped.replace(is_raised);
        if !is_raised || was != Some(false) {
            return Vec::new();
        }
        vec![FailureEvent {
            word: "emergency-stop".to_owned(),
            what: "the emergency stop was raised".to_owned(),
        }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(failed: &[FailureEvent]) -> Vec<&str> {
        failed.iter().map(|failed| failed.word.as_str()).collect()
    }

    #[test]
    fn a_restart_is_a_failure_and_a_first_start_is_not() {
        let mut failures = FailureDetector::default();
        let mut roster = Roster::default();
        roster.set_incarnation(Process::Console, 3);
        assert!(
            failures.check_processes(&roster).is_empty(),
            "who looks for the first time knows of no death"
        );
        roster.set_incarnation(Process::Belief, 1);
        assert!(failures.check_processes(&roster).is_empty());
        roster.set_incarnation(Process::Motor, 2);
        roster.set_incarnation(Process::Belief, 4);
        assert_eq!(words(&failures.check_processes(&roster)), ["belief", "motor"]);
        assert!(failures.check_processes(&roster).is_empty());
    }

    #[test]
    fn a_quarantined_joint_is_reported_once() {
        let mut failures = FailureDetector::default();
        let names = ["neck".to_owned()];
        let first = failures.check_joints(&[0, 7], &names)[0].what.clone();
        assert!(first.contains("neck") && first.contains("1 further"), "{first}");
        assert!(failures.check_joints(&[], &names).is_empty());
        assert!(failures.check_joints(&[0], &names).is_empty());
        let second = &failures.check_joints(&[0, 8], &names)[0].what;
        assert!(second.contains("joint 8"), "{second}");
        insta::assert_snapshot!(format!("{first}\n{second}"));
    }

    #[test]
    fn an_emergency_stop_counts_as_it_is_raised() {
        let mut failures = FailureDetector::default();
        assert!(failures.check_emergency_stop(true).is_empty(), "it was raised before anybody looked");
        assert!(failures.check_emergency_stop(false).is_empty());
        assert_eq!(words(&failures.check_emergency_stop(true)), ["emergency-stop"]);
        assert!(failures.check_emergency_stop(true).is_empty());
    }
}

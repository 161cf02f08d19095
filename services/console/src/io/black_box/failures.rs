//! Failure detection for the black box.

use std::collections::{BTreeMap, BTreeSet};

use message::{Process, Roster};

/// A failure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failed {
    /// The word for the dump's file name.
    pub(crate) word: String,
    /// Description for the operator.
    pub(crate) what: String,
}

/// Detects new failures. The first reading is the baseline and reports none.
#[derive(Debug, Default)]
pub(crate) struct Failures {
    lives: BTreeMap<Process, u64>,
    /// Joints that have ever been quarantined: each is reported once.
    quarantined: BTreeSet<u32>,
    is_stopped: Option<bool>,
}

impl Failures {
    /// Compares the incarnations of the processes. A higher one means that the process died unexpectedly.
    pub(crate) fn of_processes(&mut self, roster: &Roster) -> Vec<Failed> {
        let is_first = self.lives.is_empty();
        let mut failed = Vec::new();
        for &process in Process::ALL {
            let Some(life) = roster.incarnation(process) else { continue };
            // A process that was absent before is expected to be in its first incarnation.
            let known = self.lives.insert(process, life).unwrap_or(if is_first { life } else { 1 });
            if life > known {
                let what = format!("{process} died, and its life {life} began");
                failed.push(Failed { word: process.name().to_owned(), what });
            }
        }
        failed
    }

    /// Reports newly quarantined joints.
    pub(crate) fn of_joints(&mut self, quarantined: &[u32], names: &[String]) -> Vec<Failed> {
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
        vec![Failed { word: "quarantine".to_owned(), what }]
    }

    /// Reports that the emergency stop was raised.
    pub(crate) fn of_emergency(&mut self, is_raised: bool) -> Vec<Failed> {
        let was = self.is_stopped.replace(is_raised);
        if !is_raised || was != Some(false) {
            return Vec::new();
        }
        vec![Failed { word: "emergency-stop".to_owned(), what: "the emergency stop was raised".to_owned() }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(failed: &[Failed]) -> Vec<&str> {
        failed.iter().map(|failed| failed.word.as_str()).collect()
    }

    #[test]
    fn a_further_life_is_a_failure_and_a_first_one_is_not() {
        let mut failures = Failures::default();
        let mut roster = Roster::default();
        roster.set_incarnation(Process::Console, 3);
        assert!(failures.of_processes(&roster).is_empty(), "who looks for the first time knows of no death");
        roster.set_incarnation(Process::Belief, 1);
        assert!(failures.of_processes(&roster).is_empty());
        roster.set_incarnation(Process::Motor, 2);
        roster.set_incarnation(Process::Belief, 4);
        assert_eq!(words(&failures.of_processes(&roster)), ["belief", "motor"]);
        assert!(failures.of_processes(&roster).is_empty());
    }

    #[test]
    fn a_joint_is_told_of_once_however_often_it_comes_and_goes() {
        let mut failures = Failures::default();
        let names = ["neck".to_owned()];
        assert_eq!(failures.of_joints(&[0, 7], &names)[0].what, "neck and 1 further joints are quarantined");
        assert!(failures.of_joints(&[], &names).is_empty());
        assert!(failures.of_joints(&[0], &names).is_empty());
        assert_eq!(failures.of_joints(&[0, 8], &names)[0].what, "joint 8 is quarantined");
    }

    #[test]
    fn an_emergency_stop_counts_as_it_is_raised() {
        let mut failures = Failures::default();
        assert!(failures.of_emergency(true).is_empty(), "it was raised before anybody looked");
        assert!(failures.of_emergency(false).is_empty());
        assert_eq!(words(&failures.of_emergency(true)), ["emergency-stop"]);
        assert!(failures.of_emergency(true).is_empty());
    }
}

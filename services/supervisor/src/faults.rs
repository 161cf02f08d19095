use clock::{Duration, Instant};
use config::campaign::{ProcessFault, ProcessFaultKind};
use message::Process;

/// Default duration of a fault.
const DEFAULT_DURATION: Duration = Duration::from_millis(500);
/// A slowed process alternates between this long stopped and this long running.
const SLOW_INTERVAL: Duration = Duration::from_millis(5);

/// A fault names an unknown process.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a process: use one of {names}", names = known())]
pub struct UnknownProcessError(String);

fn known() -> String {
    let names: Vec<_> = crate::ORDER.iter().map(|process| process.name()).collect();
    names.join(", ")
}

fn find(name: &str) -> Result<Process, UnknownProcessError> {
    let process = crate::ORDER.into_iter().find(|process| process.name() == name);
    process.ok_or_else(|| UnknownProcessError(name.to_owned()))
}

/// Effect of a fault on a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FaultAction {
    Kill,
    Freeze,
    Thaw,
}

#[derive(Clone, Debug)]
struct ScheduledFault {
    process: Process,
    kind: ProcessFaultKind,
    until: Duration,
    /// Whether the process is stopped now.
    still: bool,
    /// When the fault acts next.
    next: Option<Duration>,
}

/// Injects faults into processes at given times. Pure: receives the time and returns the actions due.
#[derive(Clone, Debug, Default)]
pub struct ProcessFaults {
    planned: Vec<ScheduledFault>,
    begun_at: Option<Instant>,
}

impl ProcessFaults {
    /// The process faults of a campaign.
    ///
    /// # Errors
    ///
    /// A fault names an unknown process.
    pub fn new(faults: &[ProcessFault]) -> Result<Self, UnknownProcessError> {
        let planned = faults.iter().map(|fault| {
            let at = Duration::from_secs_f64(fault.at_s.get());
            let lasts =
                fault.duration_s.map_or(DEFAULT_DURATION, |lasts| Duration::from_secs_f64(lasts.get()));
            Ok(ScheduledFault {
                process: find(fault.process.get_ref())?,
                kind: fault.kind,
                until: at + lasts,
                still: false,
                next: Some(at),
            })
        });
        Ok(Self { planned: planned.collect::<Result<_, _>>()?, begun_at: None })
    }

    /// Checks that a name is that of a process.
    ///
    /// # Errors
    ///
    /// It is not.
    pub fn check(name: &str) -> Result<(), UnknownProcessError> {
        find(name).map(drop)
    }

    /// Starts the clock of the campaign; called when all processes run.
    pub(crate) fn begin(&mut self, now: Instant) {
        self.begun_at.get_or_insert(now);
    }

    /// When the next action is due.
    pub(crate) fn next(&self) -> Option<Instant> {
        let begun_at = self.begun_at?;
        self.planned.iter().filter_map(|planned| planned.next).min().map(|next| begun_at + next)
    }

    /// The actions due now.
    pub(crate) fn due(&mut self, now: Instant) -> Vec<(Process, FaultAction)> {
        let Some(begun_at) = self.begun_at else { return Vec::new() };
        let after = now.since(begun_at);
        self.planned.iter_mut().filter_map(|planned| planned.step(after)).collect()
    }
}

impl ScheduledFault {
    fn step(&mut self, after: Duration) -> Option<(Process, FaultAction)> {
        if after < self.next? {
            return None;
        }
        let over = after >= self.until;
        let action = match self.kind {
            ProcessFaultKind::Kill => {
                self.next = None;
                Some(FaultAction::Kill)
            }
            ProcessFaultKind::Stop | ProcessFaultKind::Slow if over => {
                self.next = None;
                self.still.then_some(FaultAction::Thaw)
            }
            ProcessFaultKind::Stop => {
                self.still = true;
                self.next = Some(self.until);
                Some(FaultAction::Freeze)
            }
            ProcessFaultKind::Slow => {
                self.still = !self.still;
                self.next = Some(after + SLOW_INTERVAL);
                Some(if self.still { FaultAction::Freeze } else { FaultAction::Thaw })
            }
        };
        action.map(|action| (self.process, action))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use config::campaign::Campaign;

    fn faults(text: &str) -> Result<ProcessFaults, UnknownProcessError> {
        ProcessFaults::new(&config::parse::<Campaign>(text, "c.toml".as_ref()).unwrap().processes)
    }

    /// The actions, with their times in milliseconds.
    fn deeds(text: &str) -> Vec<(u64, &'static str, FaultAction)> {
        let mut faults = faults(text).unwrap();
        let ms = Instant::from_nanos;
        assert!(faults.due(ms(0)).is_empty() && faults.next().is_none(), "not before all runs");
        faults.begin(ms(0));
        let mut done = Vec::new();
        for at in 0..3000 {
            let due = faults.due(ms(at * 1_000_000));
            done.extend(due.into_iter().map(|(process, action)| (at, process.name(), action)));
        }
        assert_eq!(faults.next(), None);
        done
    }

    #[test]
    fn a_process_is_killed_stopped_and_slowed_in_time() {
        let text = "[[processes]]\nkind = \"stop\"\nprocess = \"motor\"\nat_s = 0.2\nduration_s = 1\n\
                    [[processes]]\nkind = \"kill\"\nprocess = \"belief\"\nat_s = 0.5";
        let expected = [
            (200, "motor", FaultAction::Freeze),
            (500, "belief", FaultAction::Kill),
            (1200, "motor", FaultAction::Thaw),
        ];
        assert_eq!(deeds(text), expected);
        let slow = deeds("[[processes]]\nkind = \"slow\"\nprocess = \"learner\"\nat_s = 1\nduration_s = 0.1");
        assert_eq!(slow.len(), 20);
        assert_eq!(
            slow.last().map(|(_, _, action)| *action),
            Some(FaultAction::Thaw),
            "it is not left still"
        );
    }

    #[test]
    fn a_fault_on_an_unknown_process_is_refused() {
        let error = faults("[[processes]]\nkind = \"kill\"\nprocess = \"mind\"\nat_s = 1").unwrap_err();
        assert!(error.to_string().starts_with("`mind` "), "{error}");
        insta::assert_snapshot!(error);
    }
}

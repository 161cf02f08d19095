//! What is suspicious of a trace that was read: refused observations, and times that are no nanoseconds.

use std::path::Path;

use clock::Instant;
use quantity::number::{counted, counted_with, float};
use reports::beliefs::Refusal;

use crate::failure::CommandError;

/// The largest mean distance of instants that no clock in nanoseconds has: 10 000 instants a second.
const MIN_MEAN_GAP_NS: f64 = 100_000.0;
/// Minimum number of instants for a judgement.
const MIN_INSTANTS: u64 = 3;

/// The instants of a trace.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Instants {
    count: u64,
    first_ns: u64,
    last_ns: u64,
}

impl Instants {
    /// Adds an instant; instants do not run backwards.
    pub(crate) fn add(&mut self, at: Instant) {
        let at_ns = at.as_nanos();
        if self.count == 0 {
            self.first_ns = at_ns;
        } else if at_ns <= self.last_ns {
            return;
        }
        self.last_ns = at_ns;
        self.count += 1;
    }

    /// The advice for times that are not in nanoseconds; `None` for plausible ones.
    fn advice(&self) -> Option<String> {
        let gaps = self.count.checked_sub(1)?;
        let mean = float(self.last_ns - self.first_ns) / float(gaps);
        if self.count < MIN_INSTANTS || mean > MIN_MEAN_GAP_NS {
            return None;
        }
        // Seconds and milliseconds since 1970 are known by their size; otherwise the distance decides.
        let (unit, factor) = match self.last_ns {
            1_000_000_000..10_000_000_000 => ("seconds", 1_000_000_000_u64),
            1_000_000_000_000..10_000_000_000_000 => ("milliseconds", 1_000_000),
            1_000_000_000_000_000..10_000_000_000_000_000 => ("microseconds", 1000),
            _ if mean < 5.0 => ("seconds", 1_000_000_000),
            _ if mean < 5000.0 => ("milliseconds", 1_000_000),
            _ => ("microseconds", 1000),
        };
        let apart = if mean < 10.0 { format!("{mean:.1}") } else { format!("{mean:.0}") };
        Some(format!(
            "its instants are {apart} ns apart: are its times in {unit}? `at_ns` is in nanoseconds, so multiply them by \
             {factor}"
        ))
    }
}

/// Warns on standard error of what is suspicious of a trace that was read. Of one that is cut short, `is_cut`, the reader
/// was warned already.
///
/// # Errors
///
/// Every observation was refused.
pub(crate) fn judge(
    trace: &Path,
    instants: &Instants,
    used: u64,
    refused: &[Refusal],
    is_cut: bool,
) -> Result<(), CommandError> {
    let name =
        if trace == Path::new("-") { "standard input".to_owned() } else { trace.display().to_string() };
    if let Some(advice) = instants.advice() {
        tracing::warn!("{name}: {advice}");
    }
    let all = refused.iter().map(|refusal| refusal.observations).sum::<u64>();
    if instants.count == 0 && all == 0 && !is_cut {
        tracing::warn!("{name}: it has no frames; is it the right file, and was all of it written?");
    }
    let Some(Refusal { reason, first, .. }) = refused.first().filter(|_| all > 0) else { return Ok(()) };
    if used == 0 {
        return Err(CommandError::runtime(format!(
            "{name}: {} refused, and none was used: {reason} (the first: {first})",
            counted_with(all, "observation was", "observations were")
        )));
    }
    let of = counted(all.saturating_add(used), "observation");
    let were = if all == 1 { "was" } else { "were" };
    tracing::warn!("{name}: {all} of {of} {were} refused: {reason} (the first: {first})");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advice(at_ns: impl IntoIterator<Item = u64>) -> String {
        let mut instants = Instants::default();
        at_ns.into_iter().for_each(|at_ns| instants.add(Instant::from_nanos(at_ns)));
        instants.advice().unwrap_or_default()
    }

    #[test]
    fn times_in_other_units_are_recognised() {
        for (begin, gap, unit) in [
            (0, 1, "in seconds?"),
            (1_700_000_000, 1, "in seconds?"),
            (0, 50, "in milliseconds?"),
            (1_700_000_000_000, 33, "in milliseconds?"),
            (0, 50_000, "in microseconds?"),
            (1_700_000_000_000_000, 1000, "in microseconds?"),
        ] {
            let said = advice((0..20).map(|frame| begin + frame * gap));
            assert!(said.contains(unit) && said.contains("multiply"), "{begin} {gap}: {said}");
        }
    }

    #[test]
    fn plausible_times_are_accepted() {
        for (begin, gap) in [(0, 5_000_000), (1_700_000_000_000_000_000, 50_000_000), (5, 200_000)] {
            assert_eq!(advice((0..20).map(|frame| begin + frame * gap)), "", "{begin} {gap}");
        }
        assert_eq!(advice([]), "");
        assert_eq!(advice([1, 2]), "");
    }

    #[test]
    fn only_a_trace_without_any_usable_observation_is_an_error() {
        let refused = [Refusal { reason: "no".to_owned(), observations: 1, first: "line 2".to_owned() }];
        let judged = |used, refused: &[Refusal]| {
            judge(Path::new("a.jsonl"), &Instants::default(), used, refused, false)
        };
        assert!(judged(0, &[]).is_ok() && judged(1, &refused).is_ok());
        let error = judged(0, &refused).unwrap_err();
        assert_eq!(
            error.text,
            "a.jsonl: 1 observation was refused, and none was used: no (the first: line 2)"
        );
    }
}

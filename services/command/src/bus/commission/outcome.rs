//! What a trial measured, and its result.

use std::fmt::Write as _;

/// The measurements of a trial, and deviations from the expectation.
#[derive(Debug, Default)]
pub(super) struct Measured {
    pub(super) notes: Vec<String>,
    pub(super) wrong: Vec<String>,
    /// Whether a person skipped it.
    pub(super) skipped: bool,
}

impl Measured {
    pub(super) fn skipped() -> Self {
        Self { skipped: true, ..Self::default() }
    }

    pub(super) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Adds a deviation.
    pub(super) fn wrong(&mut self, wrong: impl Into<String>) {
        self.wrong.push(wrong.into());
    }

    /// Adds a measurement if it is good, otherwise a deviation.
    pub(super) fn check(&mut self, good: bool, what: String) {
        if good { self.note(what) } else { self.wrong(what) }
    }
}

/// The result of a trial.
#[derive(Debug)]
pub(super) struct Outcome {
    pub(super) word: &'static str,
    pub(super) measured: Measured,
}

impl Outcome {
    pub(super) const PASSED: &'static str = "passed";
    pub(super) const FAILED: &'static str = "failed";
    pub(super) const SKIPPED: &'static str = "skipped";

    /// Derives the result from the measurements.
    pub(super) const fn of(measured: Measured) -> Self {
        let word = if !measured.wrong.is_empty() {
            Self::FAILED
        } else if measured.skipped {
            Self::SKIPPED
        } else {
            Self::PASSED
        };
        Self { word, measured }
    }

    /// The result as text.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for note in &self.measured.notes {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "  measured: {note}");
        }
        for wrong in &self.measured.wrong {
            let _ = writeln!(text, "  WRONG:    {wrong}");
        }
        let _ = writeln!(
            text,
            "  {}",
            match self.word {
                Self::PASSED => "PASS",
                Self::FAILED => "FAIL",
                _ => "SKIPPED",
            }
        );
        text
    }
}

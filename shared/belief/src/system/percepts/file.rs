//! Reads the file: its raw form, and how its names are resolved.

use std::path::Path;
use std::time::Duration;

use message::MAX_PERCEPTS;
use perception::percepts::check_name;
use serde::Deserialize;
use settings::number::{Milliseconds, NotNegative, UnitInterval};
use settings::{SettingsError, Spanned, SpannedError};

use super::{
    Belief, Carrying, Cull, Distance, History, Kernel, Measure, NoTermApplies, Percept, Percepts, Role,
    Tracking,
};

pub(super) const BUILTIN: &str = include_str!("../../../percepts.toml");

impl Percepts {
    /// Checks the text of the file; errors name it as `file`.
    ///
    /// # Errors
    ///
    /// As [`settings::parse`]; also a duplicate or unknown name, a history or measure that does not fit the percept's
    /// feature, or a range of a number that its parent does not derive.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SettingsError> {
        settings::parse::<File>(text, file)?.resolve().map_err(|error| error.of(text, file))
    }

    /// The built-in percepts, `config/percepts.toml` at compile time.
    #[must_use]
    #[expect(clippy::expect_used, reason = "the text is compiled in, and a test parses it")]
    pub fn builtin() -> Self {
        Self::parse(BUILTIN, Path::new("config/percepts.toml")).expect("the built-in percepts are sound")
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    threshold: UnitInterval,
    percept: Spanned<Vec<RawPercept>>,
    belief: RawBelief,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPercept {
    name: Spanned<String>,
    parent: Option<Spanned<String>>,
    role: Spanned<Role>,
    decay_per_s: NotNegative,
    history: Spanned<History>,
    kernel: Spanned<Kernel>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBelief {
    threshold: NotNegative,
    normalised: bool,
    cannot_link_same_source_instant: bool,
    no_term_applies: NoTermApplies,
    tracking: Option<RawTracking>,
    carrying: Option<Spanned<RawCarrying>>,
    #[serde(default)]
    distance: Vec<RawDistance>,
    #[serde(default)]
    cull: Vec<RawCull>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTracking {
    acceleration_sd_m_s2: Spanned<NotNegative>,
    speed_sd_m_s: Spanned<NotNegative>,
    position_sd_m: Spanned<NotNegative>,
    position_sd_of_size: Spanned<NotNegative>,
    gate_sd: Spanned<NotNegative>,
    coast_ms: Spanned<Milliseconds>,
    reappear_ms: Milliseconds,
    merge_after: u32,
    announce_after: u32,
    announce_confidence: UnitInterval,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCarrying {
    hand_reach_m: NotNegative,
    contact_m: NotNegative,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDistance {
    percept: Spanned<String>,
    measure: Spanned<Measure>,
    weight: NotNegative,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCull {
    when: When,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum When {
    UnseenLongerThanMs(Milliseconds),
    ConfidenceBelow {
        percept: Spanned<String>,
        floor: UnitInterval,
    },
    PlaceEmptyForMs(Milliseconds),
    /// As `PlaceEmptyForMs`, with a single observation.
    PlaceInViewAndEmpty,
    Plugin(String),
}

impl File {
    fn resolve(self) -> Result<Percepts, SpannedError> {
        let count = self.percept.get_ref().len();
        if count > MAX_PERCEPTS {
            let reason = format!("{count} percepts: a snapshot holds at most {MAX_PERCEPTS}");
            return Err(SpannedError::at(&self.percept, reason));
        }
        let mut percepts = Vec::with_capacity(count);
        for percept in self.percept.into_inner() {
            let percept = percept.resolve(&percepts)?;
            percepts.push(percept);
        }
        let belief = self.belief.resolve(&percepts)?;
        Ok(Percepts { threshold: self.threshold.get(), percepts, belief })
    }
}

impl RawPercept {
    fn resolve(self, earlier: &[Percept]) -> Result<Percept, SpannedError> {
        check_name(self.name.get_ref()).map_err(|reason| SpannedError::at(&self.name, reason))?;
        if earlier.iter().any(|percept| percept.name == *self.name.get_ref()) {
            let reason = format!("a second percept named `{}`", self.name.get_ref());
            return Err(SpannedError::at(&self.name, reason));
        }
        let parent = self.parent.map(|parent| number(&parent, earlier)).transpose()?;
        let kernel = self.kernel.get_ref();
        let above = parent.and_then(|parent| earlier.get(usize::from(parent)));
        let above = above.map(|above| (above.name.as_str(), &above.kernel));
        kernel.check(above).map_err(|reason| SpannedError::at(&self.kernel, reason))?;
        check_role(&self.role, kernel)?;
        let is_filtered = matches!(self.history.get_ref(), History::LowPass { .. });
        if is_filtered && matches!(kernel, Kernel::Nearest(_) | Kernel::Source) {
            let reason = "symbols cannot be filtered: use lossless or log_timescale";
            return Err(SpannedError::at(&self.history, reason));
        }
        Ok(Percept {
            name: self.name.into_inner(),
            parent,
            role: self.role.into_inner(),
            decay_per_s: self.decay_per_s.get(),
            history: self.history.into_inner(),
            kernel: self.kernel.into_inner(),
        })
    }
}

impl RawBelief {
    fn resolve(self, percepts: &[Percept]) -> Result<Belief, SpannedError> {
        let mut distance = Vec::with_capacity(self.distance.len());
        for term in self.distance {
            let percept = number(&term.percept, percepts)?;
            let measure = term.measure.get_ref().clone();
            let kernel = percepts.get(usize::from(percept)).map(|percept| &percept.kernel);
            if !kernel.is_some_and(|kernel| fits(&measure, kernel)) {
                let reason = format!(
                    "this measure does not fit what `{}` derives: metres for positions and extents, angle_rad \
                     for orientations, difference for states, regions and ranges, differs for symbols",
                    term.percept.get_ref()
                );
                return Err(SpannedError::at(&term.measure, reason));
            }
            distance.push(Distance { percept, measure, weight: term.weight.get() });
        }
        let mut cull = Vec::with_capacity(self.cull.len());
        for written in self.cull {
            cull.push(match written.when {
                When::UnseenLongerThanMs(limit) => Cull::UnseenLongerThan(limit.duration()),
                When::ConfidenceBelow { percept, floor } => {
                    Cull::ConfidenceBelow { percept: number(&percept, percepts)?, floor: floor.get() }
                }
                When::PlaceEmptyForMs(time) => Cull::PlaceEmptyFor(time.duration()),
                When::PlaceInViewAndEmpty => Cull::PlaceEmptyFor(Duration::ZERO),
                When::Plugin(name) => Cull::Plugin(name),
            });
        }
        if let Some(carrying) = self.carrying.as_ref().filter(|_| self.tracking.is_none()) {
            let reason = "what is carried has an expected position: add [belief.tracking], or leave this out";
            return Err(SpannedError::at(carrying, reason));
        }
        let carrying =
            self.carrying.map(Spanned::into_inner).map(|RawCarrying { hand_reach_m, contact_m }| Carrying {
                hand_reach_m: hand_reach_m.get(),
                contact_m: contact_m.get(),
            });
        Ok(Belief {
            threshold: self.threshold.get(),
            normalised: self.normalised,
            cannot_link_same_source_instant: self.cannot_link_same_source_instant,
            no_term_applies: self.no_term_applies,
            distance,
            tracking: self.tracking.map(RawTracking::resolve).transpose()?,
            carrying,
            cull,
        })
    }
}

/// Largest standard deviation of a track, in its own unit: beyond any robot, and its fourth power is a finite single.
const MAX_SD: f64 = 1_000.0;

/// Longest coasting time.
const MAX_COAST: Duration = Duration::from_secs(60);

impl RawTracking {
    fn resolve(self) -> Result<Tracking, SpannedError> {
        let bounded = |number: &Spanned<NotNegative>| {
            let value = number.get_ref().get();
            let reason = || format!("a track has numbers up to {MAX_SD}");
            if value <= MAX_SD { Ok(value) } else { Err(SpannedError::at(number, reason())) }
        };
        if self.position_sd_m.get_ref().get() <= 0.0 {
            let reason = "no position is exact: give a standard deviation above 0";
            return Err(SpannedError::at(&self.position_sd_m, reason));
        }
        let coast = self.coast_ms.get_ref().duration();
        if coast > MAX_COAST {
            let reason = format!("an unobserved thing coasts for at most {} s", MAX_COAST.as_secs());
            return Err(SpannedError::at(&self.coast_ms, reason));
        }
        Ok(Tracking {
            acceleration_sd_m_s2: bounded(&self.acceleration_sd_m_s2)?,
            speed_sd_m_s: bounded(&self.speed_sd_m_s)?,
            position_sd_m: bounded(&self.position_sd_m)?,
            position_sd_of_size: bounded(&self.position_sd_of_size)?,
            gate_sd: bounded(&self.gate_sd)?,
            coast,
            reappear: self.reappear_ms.duration(),
            merge_after: self.merge_after,
            announce_after: self.announce_after,
            announce_confidence: self.announce_confidence.get(),
        })
    }
}

fn number(name: &Spanned<String>, percepts: &[Percept]) -> Result<u16, SpannedError> {
    let index = percepts.iter().position(|percept| percept.name == *name.get_ref());
    index.and_then(|index| u16::try_from(index).ok()).ok_or_else(|| {
        let known: Vec<_> = percepts.iter().map(|percept| percept.name.as_str()).collect();
        let reason =
            format!("no percept above is named `{}`; there are {}", name.get_ref(), known.join(", "));
        SpannedError::at(name, reason)
    })
}

fn fits(measure: &Measure, kernel: &Kernel) -> bool {
    if matches!(measure, Measure::Plugin(_)) {
        return true;
    }
    match kernel {
        Kernel::Position | Kernel::Extents => *measure == Measure::Metres,
        Kernel::Orientation => *measure == Measure::AngleRad,
        Kernel::State(_) | Kernel::Region(_) | Kernel::Range(_) => *measure == Measure::Difference,
        Kernel::Nearest(_) | Kernel::Source => *measure == Measure::Differs,
        // What a registered classifier derives is not known here.
        Kernel::Plugin(_) => true,
    }
}

/// Rejects a role that goal beliefs cannot use; otherwise the percept would never be learned, without any error.
fn check_role(role: &Spanned<Role>, kernel: &Kernel) -> Result<(), SpannedError> {
    let (is_read, reason) = match role.get_ref() {
        Role::Neither => return Ok(()),
        Role::Criteria => (
            matches!(kernel, Kernel::Nearest(_)),
            "criteria need a kernel with `nearest` prototypes: make the role \"neither\"",
        ),
        Role::Expectation => (
            matches!(kernel, Kernel::State(_) | Kernel::Position | Kernel::Orientation),
            "only states, positions and orientations can be an expectation: make the role \"neither\"",
        ),
    };
    if is_read { Ok(()) } else { Err(SpannedError::at(role, reason)) }
}

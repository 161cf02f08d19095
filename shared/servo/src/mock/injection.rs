use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clock::Duration;

use crate::Id;

mod kind;

pub(super) use kind::FAULT_KINDS;
pub use kind::FaultKind;

/// A fault to inject: its kind, its target and its time.
///
/// The syntax is the same on the command line, on standard input and in a file:
///
/// ```text
/// KIND [bus=NAME[,NAME..]] [id=N[,N-M..]] [p=CHANCE] [at=TIME] [from=TIME] [for=TIME] [by=TIME] [is=NUMBER]
/// ```
///
/// Defaults: all buses, all servos, every reply, from the start and without end. Times count from the moment at which
/// the fault is enabled.
///
/// ```
/// use servo::mock::{FaultSpec, FaultKind};
/// let fault: FaultSpec = "drop bus=torso id=5,7-9 p=0.01 from=2s for=10s".parse()?;
/// assert_eq!(fault.kind, FaultKind::Drop);
/// assert_eq!(fault.to_string(), "drop bus=torso id=5,7-9 p=0.01 from=2s for=10s");
/// let said = "dorp id=5".parse::<FaultSpec>().unwrap_err().to_string();
/// assert!(said.starts_with("`dorp` is no kind of fault: say one of drop, flip, "));
/// # Ok::<(), servo::mock::FaultSpecError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FaultSpec {
    /// The kind of fault.
    pub kind: FaultKind,
    /// The affected buses; empty for all.
    pub buses: Vec<String>,
    /// The affected servos; empty for all.
    pub ids: Vec<RangeInclusive<u8>>,
    /// Probability per reply; `None` for every reply.
    pub chance: Option<f64>,
    /// Once, at this time.
    pub at: Option<Duration>,
    /// Start.
    pub from: Option<Duration>,
    /// Duration.
    pub lasts: Option<Duration>,
    /// Delay of late replies.
    pub by: Option<Duration>,
    /// The false length, the error number, or the supply voltage in 0.1 V.
    pub is: Option<u16>,
}

/// A syntax error in a fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{word}` {wrong}")]
pub struct FaultSpecError {
    /// The word.
    pub word: String,
    /// What is wrong with it, and what would be valid.
    pub wrong: String,
}

impl FaultSpecError {
    fn new(word: &str, wrong: impl Into<String>) -> Self {
        Self { word: word.to_owned(), wrong: wrong.into() }
    }
}

const KEYS: &str = "bus=, id=, p=, at=, from=, for=, by= or is=";

impl FromStr for FaultSpec {
    type Err = FaultSpecError;

    fn from_str(text: &str) -> Result<Self, FaultSpecError> {
        let mut words = text.split_whitespace();
        let name = words.next().unwrap_or_default();
        let kind = FaultKind::from_name(name).ok_or_else(|| {
            FaultSpecError::new(name, format!("is no kind of fault: say one of {}", FaultKind::names()))
        })?;
        let (buses, ids) = (Vec::new(), Vec::new());
        let (chance, at, from, lasts, by, is) = (None, None, None, None, None, None);
        let mut said = Self { kind, buses, ids, chance, at, from, lasts, by, is };
        let mut keys = Vec::new();
        for word in words {
            let (key, value) = word
                .split_once('=')
                .ok_or_else(|| FaultSpecError::new(word, format!("has no value: say {KEYS}")))?;
            if keys.contains(&key) {
                return Err(FaultSpecError::new(word, format!("is the second {key}=: say each once")));
            }
            keys.push(key);
            said.take(word, key, value)?;
        }
        said.check()?;
        Ok(said)
    }
}

impl FaultSpec {
    fn take(&mut self, word: &str, key: &str, value: &str) -> Result<(), FaultSpecError> {
        match key {
            "bus" if value.is_empty() || value.split(',').any(str::is_empty) => {
                return Err(FaultSpecError::new(word, "names no bus: say bus=torso or bus=torso,left_arm"));
            }
            "bus" => self.buses = value.split(',').map(str::to_owned).collect(),
            "id" => {
                let ids = value.split(',').map(ids).collect::<Option<_>>();
                let wrong = "names no servos: say id=5, id=1,3 or id=1-13, from 0 to 252";
                self.ids = ids.ok_or_else(|| FaultSpecError::new(word, wrong))?;
            }
            "p" => {
                let chance = value.parse().ok().filter(|chance| (0.0..=1.0).contains(chance));
                let wrong = "is no probability: say one from 0 to 1, such as p=0.01";
                self.chance = Some(chance.ok_or_else(|| FaultSpecError::new(word, wrong))?);
            }
            "at" | "from" | "for" | "by" => {
                let time = time(value).ok_or_else(|| {
                    FaultSpecError::new(word, format!("is no time: say {key}=2s, {key}=150ms or {key}=3min"))
                })?;
                let place = match key {
                    "at" => &mut self.at,
                    "from" => &mut self.from,
                    "for" => &mut self.lasts,
                    _ => &mut self.by,
                };
                *place = Some(time);
            }
            "is" => {
                let wrong = "is no number: say is=0, is=7 or is=65535";
                self.is = Some(value.parse().map_err(|_| FaultSpecError::new(word, wrong))?);
            }
            _ => {
                return Err(FaultSpecError::new(word, format!("is not a key of a fault: say {KEYS}")));
            }
        }
        Ok(())
    }

    /// Checks that the keys are consistent.
    fn check(&self) -> Result<(), FaultSpecError> {
        let name = self.kind.name();
        let no =
            |key, wrong: &str| Err(FaultSpecError::new(key, format!("does not go with `{name}`: {wrong}")));
        if self.at.is_some() && self.from.is_some() {
            return no("at=", "say at= for once, or from= and for= for a while");
        }
        if self.at.is_some() && self.chance.is_some() {
            return no("p=", "a fault with at= always happens, so leave p= out");
        }
        if self.at.is_some() && self.lasts.is_some() && !self.kind.is_lasting() {
            return no("for=", "it happens once at= a time; say from= and for= for a while");
        }
        if self.chance.is_some() && self.kind.is_lasting() {
            return no("p=", "it lasts; say from= and for=, or at= and for=");
        }
        if self.by.is_some() && self.kind != FaultKind::Late {
            return no("by=", "only `late` is by= a time");
        }
        match (self.is, self.kind.numbers()) {
            (Some(_), None) => return no("is=", "only `length`, `error` and `sag` have a number"),
            (Some(number), Some((numbers, what))) if !numbers.contains(&number) => return no("is=", what),
            (_, _) => {}
        }
        if !self.ids.is_empty() && !self.kind.is_of_servos() {
            return no("id=", "it happens to a whole bus; say bus=");
        }
        Ok(())
    }

    /// Checks that every named bus exists.
    ///
    /// # Errors
    ///
    /// A named bus is unknown; the error lists the known ones.
    pub fn check_buses<'a>(
        &self,
        buses: impl Iterator<Item = &'a str> + Clone,
    ) -> Result<(), FaultSpecError> {
        match self.buses.iter().find(|bus| !buses.clone().any(|known| known == *bus)) {
            None => Ok(()),
            Some(bus) => {
                let known = buses.collect::<Vec<_>>().join(", ");
                let wrong = format!("names no mock bus: there are {known}");
                Err(FaultSpecError::new(&format!("bus={bus}"), wrong))
            }
        }
    }

    /// Whether the fault affects a bus.
    #[must_use]
    pub fn is_on(&self, bus: &str) -> bool {
        self.buses.is_empty() || self.buses.iter().any(|named| named == bus)
    }

    /// Whether the fault affects a servo.
    #[must_use]
    pub fn is_to(&self, id: u8) -> bool {
        self.ids.is_empty() || self.ids.iter().any(|ids| ids.contains(&id))
    }

    /// Whether the fault is active at this time after it was enabled.
    pub(super) fn is_active_at(&self, after: Duration) -> bool {
        let begins = self.begins();
        after >= begins && self.lasts().is_none_or(|lasts| after < begins + lasts)
    }

    /// The start, relative to when it is enabled.
    pub(super) fn begins(&self) -> Duration {
        self.at.or(self.from).unwrap_or_default()
    }

    /// The duration; `None` if unlimited.
    pub(super) fn lasts(&self) -> Option<Duration> {
        self.lasts.or_else(|| self.kind.lasts())
    }
}

fn ids(text: &str) -> Option<RangeInclusive<u8>> {
    let id = |text: &str| text.parse().ok().and_then(Id::new).map(Id::get);
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let range = id(first)?..=id(last)?;
    (!range.is_empty()).then_some(range)
}

/// Time units in nanoseconds. `s` comes last, because other units end in it.
const UNITS: [(&str, f64); 4] = [("us", 1e3), ("ms", 1e6), ("min", 60e9), ("s", 1e9)];
/// Maximum time, in seconds.
const MAX_TIME_S: f64 = 1e6;

fn time(text: &str) -> Option<Duration> {
    let (number, nanos) = UNITS.iter().find_map(|(unit, nanos)| Some((text.strip_suffix(unit)?, nanos)))?;
    let seconds = number.parse::<f64>().ok()? * nanos / 1e9;
    (0.0..=MAX_TIME_S).contains(&seconds).then(|| Duration::from_secs_f64(seconds))
}

impl fmt::Display for FaultSpec {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(self.kind.name())?;
        if !self.buses.is_empty() {
            write!(to, " bus={}", self.buses.join(","))?;
        }
        for (index, ids) in self.ids.iter().enumerate() {
            let (first, last) = (ids.start(), ids.end());
            write!(to, "{}{first}", if index == 0 { " id=" } else { "," })?;
            if first != last {
                write!(to, "-{last}")?;
            }
        }
        if let Some(chance) = self.chance {
            write!(to, " p={chance}")?;
        }
        for (key, time) in [("at", self.at), ("from", self.from), ("for", self.lasts), ("by", self.by)] {
            if let Some(time) = time {
                write!(to, " {key}=")?;
                match (time.as_nanos() % 1_000_000_000, time.as_nanos() % 1_000_000) {
                    (0, _) => write!(to, "{}s", time.as_secs())?,
                    (_, 0) => write!(to, "{}ms", time.as_millis())?,
                    _ => write!(to, "{}us", time.as_secs_f64() * 1e6)?,
                }
            }
        }
        if let Some(number) = self.is {
            write!(to, " is={number}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<FaultSpec, String> {
        text.parse().map_err(|error: FaultSpecError| error.to_string())
    }

    #[test]
    fn a_parsed_fault_is_displayed_as_written() {
        for text in [
            "drop",
            "drop bus=torso id=5 p=0.01 from=2s for=10s",
            "late id=1-13 by=1500us",
            "hang-up bus=left_arm,torso at=120s for=500ms",
            "overload id=3,5-7 at=1500ms",
            "length id=5 is=65535",
            "error p=0.5 is=7",
            "blocked bus=torso id=5 from=2s for=3s",
            "sag id=1-7 is=90",
            "drop-instruction bus=torso p=0.01",
        ] {
            assert_eq!(parse(text).map(|said| said.to_string()), Ok(text.to_owned()));
        }
        assert_eq!(parse("flip from=2min").unwrap().from, Some(Duration::from_secs(120)));
        for kind in FaultKind::ALL {
            assert_eq!(parse(kind.name()).map(|said| said.kind), Ok(kind));
        }
    }

    #[test]
    fn an_invalid_fault_is_named_with_the_valid_ones() {
        let mut wording = String::new();
        for (text, word) in [
            ("", ""),
            ("drop 5", "5"),
            ("drop x=5", "x=5"),
            ("drop p=2", "p=2"),
            ("drop p=NaN", "p=NaN"),
            ("drop id=253", "id=253"),
            ("drop id=9-3", "id=9-3"),
            ("drop bus=", "bus="),
            ("drop at=5", "at=5"),
            ("drop for=-1s", "for=-1s"),
            ("drop id=1 id=2", "id=2"),
            ("drop at=1s from=2s", "at="),
            ("drop by=1s", "by="),
            ("length is=65536", "is=65536"),
            ("sag is=201", "is="),
            ("error is=128", "is="),
            ("flip is=7", "is="),
            ("flip-instruction id=1", "id="),
            ("hang-up id=1", "id="),
            ("baud p=0.5", "p="),
        ] {
            let error = text.parse::<FaultSpec>().unwrap_err();
            assert_eq!(error.word, word, "{text}: {error}");
            wording += &format!("{text}\n    {error}\n");
        }
        let drop = parse("drop bus=torsoo").unwrap();
        let error = drop.check_buses(["torso", "face"].into_iter()).unwrap_err();
        assert_eq!(error.word, "bus=torsoo");
        insta::assert_snapshot!(wording + &error.to_string());
    }

    proptest! {
        #[test]
        fn any_text_is_accepted_or_refused(text in ".{0,60}") {
            if let Ok(said) = text.parse::<FaultSpec>() {
                prop_assert_eq!(said.to_string().parse::<FaultSpec>().map(|again| again.to_string()), Ok(said.to_string()));
            }
        }
    }
}

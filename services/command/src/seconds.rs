use std::time::Duration;

/// The longest time accepted by a command: a year.
const MAX_TIME: Duration = Duration::from_secs(366 * 24 * 3600);

/// Parses seconds: a number above 0 and up to a year.
pub(crate) fn parse(text: &str) -> Result<Duration, String> {
    time(text, 1.0, "give the seconds as a number above 0, for example 60 or 2.5")
}

/// Parses seconds: 0, or as [`parse`].
pub(crate) fn parse_or_none(text: &str) -> Result<Duration, String> {
    if text == "0" { Ok(Duration::ZERO) } else { parse(text) }
}

/// Parses milliseconds: a number above 0 and up to a year.
pub(crate) fn parse_millis(text: &str) -> Result<Duration, String> {
    time(text, 1000.0, "give the milliseconds as a number above 0, for example 500")
}

fn time(text: &str, per_second: f64, advice: &str) -> Result<Duration, String> {
    let number: Option<f64> = text.parse().ok();
    let time = number.and_then(|number| Duration::try_from_secs_f64(number / per_second).ok());
    time.filter(|time| !time.is_zero() && *time <= MAX_TIME).ok_or_else(|| advice.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_positive_finite_times_are_accepted() {
        assert_eq!(parse("2.5"), Ok(Duration::from_millis(2500)));
        assert_eq!(parse_millis("2.5"), Ok(Duration::from_micros(2500)));
        for nonsense in ["-3", "0", "-0.0", "NaN", "inf", "1e30", "soon", "", "3 s", "1e-30"] {
            assert!(parse(nonsense).is_err() && parse_millis(nonsense).is_err(), "{nonsense}");
        }
    }
}

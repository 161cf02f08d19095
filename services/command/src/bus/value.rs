//! Parsing and printing of values: counts, or numbers with a unit.

use std::ffi::OsString;

use quantity::number::{float_of_signed, round_i64};
use servo::Model;
use servo::table::{self, Entry};

use crate::failure::CommandError;

/// The item of a model's control table by its name; an unknown one is an error with similar names.
pub(super) fn entry(model: Model, item: &str) -> Result<Entry, CommandError> {
    table::by_name(model, item).ok_or_else(|| {
        let near = table::entries(model).map(|entry| entry.to_string()).filter(|name| is_similar(name, item));
        let near: Vec<_> = near.take(4).collect();
        let hint = if near.is_empty() {
            "`leo bus read` without an item lists all".to_owned()
        } else {
            near.join(", ")
        };
        CommandError::usage(format!("`{item}` is not an item of an {}: {hint}", model.name()))
    })
}

/// The count, with its value in the unit.
pub(super) fn show(entry: &Entry, count: i64) -> String {
    match entry.unit {
        Some(unit) => format!("{count:>10}   {:.3} {}", entry.in_unit(count), unit.symbol),
        None => format!("{count:>10}"),
    }
}

/// The minus sign that replaces a hyphen, which would begin an option.
const MINUS: char = '\u{2212}';

/// An argument of the command line. Replaces the hyphen of a negative number with a unit, such as `-10deg`, by a
/// minus sign, because clap would take it for an option.
pub(crate) fn escape_negative(word: OsString) -> OsString {
    let is_number = |rest: &str| {
        let digits = rest.trim_start_matches('.');
        digits.starts_with(|c: char| c.is_ascii_digit())
            && digits.ends_with(|c: char| c.is_ascii_alphabetic())
    };
    match word.to_str().and_then(|text| text.strip_prefix('-')) {
        Some(rest) if is_number(rest) => format!("{MINUS}{rest}").into(),
        _ => word,
    }
}

/// Parses a count, or a number with the item's unit.
pub(super) fn parse(entry: &Entry, text: &str) -> Result<i64, String> {
    let text = text.replace(MINUS, "-");
    let text = text.as_str();
    if let Ok(count) = text.parse() {
        return Ok(count);
    }
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c))).unwrap_or(text.len());
    let (number, symbol) = text.split_at(end);
    let number: Option<f64> = number.parse().ok().filter(|number: &f64| number.is_finite());
    let per_count = entry.unit.and_then(|unit| match (unit.symbol, symbol.trim()) {
        (own, said) if own == said => Some(unit.per_count),
        ("deg", "rad") => Some(unit.per_count.to_radians()),
        _ => None,
    });
    let counts = number.zip(per_count).map(|(number, per_count)| number / per_count);
    match counts.filter(|counts| counts.abs() <= float_of_signed(i64::from(u32::MAX))) {
        Some(counts) => Ok(round_i64(counts)),
        None => Err(match entry.unit {
            Some(unit) => format!(
                "`{text}` is not a value of {entry}: give a count, or a number of {0} such as {1:.1}{0}",
                unit.symbol,
                entry.in_unit(entry.initial)
            ),
            None => format!("`{text}` is not a value of {entry}: give a whole number"),
        }),
    }
}

/// Parses an angle of a joint. The unit is required, because a bare number would be a servo's count.
pub(super) fn angle_rad(text: &str) -> Result<f64, String> {
    let text = text.replace(MINUS, "-");
    let wrong =
        || format!("`{text}` is not a joint angle: give 10deg or 0.17rad; a count of the servo needs --raw");
    let (number, per_unit) = match (text.strip_suffix("deg"), text.strip_suffix("rad")) {
        (Some(number), _) => (number, 1_f64.to_radians()),
        (_, Some(number)) => (number, 1.0),
        (None, None) => return Err(wrong()),
    };
    let number: Option<f64> = number.trim().parse().ok().filter(|number: &f64| number.is_finite());
    number.map(|number| number * per_unit).ok_or_else(wrong)
}

/// Whether a known name resembles a mistyped one.
fn is_similar(name: &str, said: &str) -> bool {
    let words: Vec<&str> = said.split(['_', '-', ' ']).filter(|word| word.len() > 2).collect();
    words.iter().any(|word| name.contains(word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use servo::Model;
    use servo::table::by_name;

    fn item(name: &str) -> Entry {
        by_name(Model::Xm430W350, name).unwrap()
    }

    #[test]
    fn counts_and_units_are_read() {
        let goal = item("goal_position");
        assert_eq!(parse(&goal, "2048"), Ok(2048));
        assert_eq!(parse(&goal, "-7"), Ok(-7));
        assert_eq!(parse(&goal, "90deg"), Ok(1024));
        assert_eq!(parse(&goal, "3.14159rad"), Ok(2048));
        assert_eq!(parse(&item("min_voltage_limit"), "11.5V"), Ok(115));
        for nonsense in ["", "deg", "12V", "1e999deg", "NaNdeg", "nonsense", "4 5"] {
            assert!(parse(&goal, nonsense).is_err(), "{nonsense}");
        }
        assert!((angle_rad("-90deg").unwrap() + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!(angle_rad("0.5 rad"), Ok(0.5));
        for (said, is) in
            [("-10deg", "\u{2212}10deg"), ("-.5rad", "\u{2212}.5rad"), ("-7", "-7"), ("--id", "--id")]
        {
            assert_eq!(escape_negative(said.into()), OsString::from(is));
        }
        assert_eq!(parse(&goal, "\u{2212}90deg"), Ok(-1024));
        assert!((angle_rad("\u{2212}90deg").unwrap() + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        for nonsense in ["2048", "deg", "infrad", "NaNdeg", "12V"] {
            assert!(angle_rad(nonsense).unwrap_err().contains(&format!("`{nonsense}`")), "{nonsense}");
        }
        let said = [
            parse(&item("torque_enable"), "on").unwrap_err(),
            parse(&goal, "nonsense").unwrap_err(),
            angle_rad("2048").unwrap_err(),
        ];
        assert!(said[0].contains("`on`") && said[0].contains("torque_enable"), "{said:?}");
        insta::assert_snapshot!(said.join("\n"));
    }
}

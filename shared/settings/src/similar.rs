/// The known name that a misspelt one probably means; `None` if none is near.
///
/// A name is near if at most a third of its letters are wrong, or if one of both begins like the whole other one.
///
/// ```
/// assert_eq!(settings::closest("gren", ["red", "green"]), Some("green"));
/// assert_eq!(settings::closest("rate", ["name", "rate_hz"]), Some("rate_hz"));
/// assert_eq!(settings::closest("red", ["green", "blue"]), None);
/// ```
#[must_use]
pub fn closest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    let distance = |known: &str| {
        let other = known.to_lowercase();
        let (letters, others) = (lower.chars().count(), other.chars().count());
        let (shorter, longer) = (letters.min(others), letters.max(others));
        let wrong = strsim::damerau_levenshtein(&lower, &other);
        let is_beginning =
            shorter >= MIN_BEGINNING && (other.starts_with(&lower) || lower.starts_with(&other));
        (wrong <= longer / 3 || is_beginning).then_some(wrong)
    };
    known.into_iter().filter_map(|known| Some((distance(known)?, known))).min().map(|(_, known)| known)
}

/// Minimum length of a name that another one begins with.
const MIN_BEGINNING: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_misspelling_is_recognised() {
        for (name, known) in [
            ("adress", "address"),
            ("rate_khz", "rate_hz"),
            ("prot", "port"),
            ("Red", "red"),
            ("colour_name", "colour"),
            ("normalized", "normalised"),
        ] {
            assert_eq!(closest(name, ["other", known, "something"]), Some(known), "{name}");
        }
        for (name, known) in
            [("red", "green"), ("blue", "black"), ("on", "in"), ("x", "y"), ("zeal", "rate_hz"), ("", "a")]
        {
            assert_eq!(closest(name, [known]), None, "{name}");
        }
    }
}

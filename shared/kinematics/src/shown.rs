//! Texts of a URDF as errors show them: a foreign one could be long, or hold sequences for the terminal.

/// A name as errors show it: its first 60 characters, without any that is invisible.
pub(crate) fn shown(name: &str) -> String {
    const MAX_CHARACTERS: usize = 60;
    escaped(name, MAX_CHARACTERS)
}

/// The first characters of a text, without any that is invisible.
pub(crate) fn escaped(text: &str, max_characters: usize) -> String {
    let mut escaped = String::new();
    for character in text.chars().take(max_characters) {
        match character {
            '"' | '\'' | '\\' => escaped.push(character),
            _ => escaped.extend(character.escape_debug()),
        }
    }
    if text.chars().nth(max_characters).is_some() {
        escaped.push('…');
    }
    escaped
}

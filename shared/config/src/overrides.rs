//! Values set on the command line, `--set section.key=value`: they replace those of the configuration files.

use std::ops::Range;

use settings::SettingsError;
use toml::de::{DeTable, DeValue};

/// A value to set, parsed.
pub(crate) struct Override<'a> {
    /// The file that the value is for, where it is named; the first one that has the key otherwise.
    pub(crate) file: Option<&'static str>,
    /// The tables, from the outermost one, and the key. A number is an index of a list.
    path: Vec<&'a str>,
    /// The value in TOML, on one line.
    value: String,
}

/// The short names of the files, for the same section in two of them.
const FILES: [(&str, &str); 4] = [
    ("leo:", "leo.toml"),
    ("percepts:", "percepts.toml"),
    ("perspective:", "perspective.toml"),
    ("motor:", "motor.toml"),
];

/// The error about a value that was set.
pub(crate) fn error(set: &str, reason: impl Into<String>) -> SettingsError {
    SettingsError::Set { set: set.to_owned(), reason: reason.into() }
}

impl<'a> Override<'a> {
    /// Parses `section.key=value`, or `file:section.key=value`.
    ///
    /// # Errors
    ///
    /// There is no `=`, or a part of the key is empty.
    pub(crate) fn parse(set: &'a str) -> Result<Self, SettingsError> {
        let form = "write SECTION.KEY=VALUE, for example --set console.address=127.0.0.1:7781";
        let (key, value) = set.split_once('=').ok_or_else(|| error(set, form))?;
        let named = FILES.into_iter().find_map(|(short, file)| Some((file, key.strip_prefix(short)?)));
        let (file, key) = named.map_or((None, key), |(file, key)| (Some(file), key));
        let path: Vec<&str> = key.split('.').map(str::trim).collect();
        let is_name = |part: &&str| {
            !part.is_empty()
                && part.chars().all(|letter| letter.is_ascii_alphanumeric() || "_-".contains(letter))
        };
        if !path.iter().all(is_name) {
            return Err(error(set, form));
        }
        Ok(Self { file, path, value: toml_value(value) })
    }

    /// How many parts of its path a file has; none if the file is no TOML.
    pub(crate) fn depth_in(&self, text: &str) -> usize {
        let Ok(root) = DeTable::parse(text) else { return 0 };
        let mut value = None;
        let mut known = 0;
        for part in &self.path {
            let next = match value {
                None => in_table(root.get_ref(), part),
                Some(value) => child(value, part),
            };
            let Some((next, _)) = next else { break };
            (value, known) = (Some(next), known + 1);
        }
        known
    }

    /// The text of a file with the value set.
    pub(crate) fn apply(&self, text: &str) -> String {
        if let Some(range) = self.place(text) {
            let (before, after) =
                (text.get(..range.start).unwrap_or(""), text.get(range.end..).unwrap_or(""));
            return format!("{before}{}{after}", self.value);
        }
        let Some((key, tables)) = self.path.split_last() else { return text.to_owned() };
        let line = format!("{key} = {}\n", self.value);
        if tables.is_empty() {
            return line + text;
        }
        let header = format!("[{}]", tables.join("."));
        let mut at = 0;
        for whole in text.split_inclusive('\n') {
            at += whole.len();
            let code = whole.split('#').next().unwrap_or("").trim();
            if code == header {
                let (before, after) = text.split_at_checked(at).unwrap_or((text, ""));
                let end = if before.ends_with('\n') { "" } else { "\n" };
                return format!("{before}{end}{line}{after}");
            }
        }
        let end = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
        format!("{text}{end}\n{header}\n{line}")
    }

    /// The range of the value that is there already.
    fn place(&self, text: &str) -> Option<Range<usize>> {
        let root = DeTable::parse(text).ok()?;
        let (first, rest) = self.path.split_first()?;
        let mut found = in_table(root.get_ref(), first)?;
        for part in rest {
            found = child(found.0, part)?;
        }
        // A table with a header is no value that could be replaced where it stands.
        let (value, range) = found;
        let is_inline = text.get(range.clone()).is_some_and(|text| text.starts_with(['{', '[']));
        let has_header = matches!(value, DeValue::Table(_)) && !is_inline;
        (!has_header).then_some(range)
    }
}

fn in_table<'a, 'i>(table: &'a DeTable<'i>, name: &str) -> Option<(&'a DeValue<'i>, Range<usize>)> {
    table
        .iter()
        .find(|(key, _)| key.get_ref().as_ref() == name)
        .map(|(_, value)| (value.get_ref(), value.span()))
}

/// The value of a key of a table, or at an index of a list.
fn child<'a, 'i>(value: &'a DeValue<'i>, part: &str) -> Option<(&'a DeValue<'i>, Range<usize>)> {
    if let Some(table) = value.as_table() {
        return in_table(table, part);
    }
    let value = value.as_array()?.get(part.parse::<usize>().ok()?)?;
    Some((value.get_ref(), value.span()))
}

/// A value as the user wrote it, in TOML: numbers, booleans, lists and quoted strings as in a file; anything else is a
/// string.
fn toml_value(written: &str) -> String {
    let parsed = format!("value = {written}").parse::<toml::Table>();
    let value = parsed.ok().filter(|table| table.len() == 1).and_then(|mut table| table.remove("value"));
    match value {
        Some(toml::Value::String(text)) => quoted(&text),
        Some(value) => value.to_string(),
        None => quoted(written.trim()),
    }
}

/// A text in quotes, on one line.
fn quoted(text: &str) -> String {
    let letters = text.chars().map(|letter| match letter {
        '"' => "\\\"".to_owned(),
        '\\' => "\\\\".to_owned(),
        letter if letter.is_control() => format!("\\u{:04x}", u32::from(letter)),
        letter => letter.to_string(),
    });
    format!("\"{}\"", letters.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "threshold = 0.5 # a share\n[console]\nport = 7780\nnames = [\"a\", \"b\"]\n\n[console.realtime] # of it\n\
                        cores = []\n\n[[joint]]\nid = 1\n\n[[joint]]\nid = 2\n";

    fn set(set: &str) -> String {
        Override::parse(set).unwrap().apply(TEXT)
    }

    #[test]
    fn a_value_is_replaced_where_it_stands() {
        for (written, from, to) in [
            ("console.port=7781", "port = 7780", "port = 7781"),
            ("threshold=0.75", "threshold = 0.5 #", "threshold = 0.75 #"),
            ("console.names=[\"x\"]", "names = [\"a\", \"b\"]", "names = [\"x\"]"),
            ("console.names.1=c", "\"b\"", "\"c\""),
            ("console.realtime.cores=[0, 1]", "cores = []", "cores = [0, 1]"),
            ("joint.1.id=7", "id = 2", "id = 7"),
            ("console.port = 127.0.0.1:7781", "7780", "\"127.0.0.1:7781\""),
            ("console.port=\"7781\"", "7780", "\"7781\""),
            ("console.port=none", "7780", "\"none\""),
            ("console.port=7781 # mine\n", "7780", "7781"),
            ("console.port=1\nother = 2", "7780", "\"1\\nother = 2\""),
            ("console.port=a\\\"b", "7780", "'a\\\"b'"),
        ] {
            let expected = TEXT.replace(from, to);
            let is = set(written);
            let same = |text: &str| text.parse::<toml::Table>().unwrap();
            assert_eq!(same(&is), same(&expected), "{written}: {is}");
            assert!(is.contains("# a share") && is.lines().count() == TEXT.lines().count(), "{is}");
        }
    }

    #[test]
    fn a_missing_key_is_added_to_its_table() {
        for (written, has) in [
            ("new=1", "new = 1\nthreshold"),
            ("console.open=true", "[console]\nopen = true\nport"),
            ("console.realtime.lock=true", "[console.realtime] # of it\nlock = true\ncores"),
            ("link.side=robot", "id = 2\n\n[link]\nside = \"robot\"\n"),
        ] {
            let is = set(written);
            assert!(is.contains(has), "{written}: {is}");
            assert_eq!(
                is.parse::<toml::Table>().unwrap().len(),
                TEXT.parse::<toml::Table>().unwrap().len() + usize::from(!written.starts_with("console"))
            );
        }
    }

    #[test]
    fn what_is_no_key_and_value_is_refused() {
        for wrong in ["", "console.port", "=1", "console.=1", ".port=1", "a b=1", "console..port=1"] {
            let error = Override::parse(wrong).err().unwrap().to_string();
            assert!(
                error.starts_with(&format!("--set {wrong}: ")) && error.contains("SECTION.KEY=VALUE"),
                "{error}"
            );
        }
        assert_eq!(Override::parse("percepts:belief.depth=1").unwrap().file, Some("percepts.toml"));
    }
}

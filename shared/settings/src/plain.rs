//! serde's messages in plain words: the types of the program mean nothing to the author of a file.

/// A message of serde about a value, with the value's type and the expected one in plain words. Any other message is
/// returned as it is.
///
/// ```
/// let message = "invalid type: string \"often\", expected f64";
/// assert_eq!(settings::plain(message), "invalid type: text \"often\", expected a number");
/// ```
#[must_use]
pub fn plain(message: &str) -> String {
    // JSON errors end with their position.
    match message.split_once(" at line ") {
        Some((message, place)) => format!("{} at line {place}", of_value(message)),
        None => of_value(message),
    }
}

fn of_value(message: &str) -> String {
    if let Some(rest) = message.strip_prefix("unknown variant ") {
        return format!("unknown value {rest}");
    }
    if message.starts_with("data did not match any variant") {
        return "the value has none of the forms that are allowed here".to_owned();
    }
    for kind in ["invalid type: ", "invalid value: "] {
        if let Some((found, wanted)) =
            message.strip_prefix(kind).and_then(|rest| rest.split_once(", expected "))
        {
            return format!("{kind}{}, expected {}", found_in_words(found), expected_in_words(wanted));
        }
    }
    if let Some((found, wanted)) =
        message.strip_prefix("invalid length ").and_then(|rest| rest.split_once(", expected "))
    {
        return format!("invalid length {found}, expected {}", expected_in_words(wanted));
    }
    // The TOML parser's own form.
    if let Some(wanted) = message.strip_prefix("wanted ") {
        return format!("expected {}", expected_in_words(wanted));
    }
    // The TOML parser appends what it expected.
    let fault = message.split_once(", expected ").map_or(message, |(fault, _)| fault);
    syntax(fault).unwrap_or(message).to_owned()
}

/// A fault of the syntax in words that a person who does not write parsers understands.
fn syntax(message: &str) -> Option<&'static str> {
    Some(match message {
        // TOML
        "key with no value" => "`=` and a value are missing after the key",
        "extra assignment between key-value pairs" | "extra `=`" => "one `=` too many",
        "missing assignment between key-value pairs" => "`=` is missing between the key and its value",
        "missing comma between array elements" => "`,` is missing between two values of the list",
        "missing comma between key-value pairs" => "`,` is missing between two keys of the table",
        "extra comma in array" | "extra comma in inline table" => "one `,` too many",
        "missing value" | "missing value for key" => "the value is missing",
        "string values must be quoted" => "here should be a value; a text has to be in quotes",
        "missing opening quote" => "the quote at the beginning of the text is missing",
        "missing key for inline table element" | "unquoted keys cannot be empty" => "the key is missing",
        "invalid unquoted key" => {
            "a key consists of letters, digits, `_` and `-`; any other has to be in quotes"
        }
        "invalid key-value pair" | "invalid inline table element" | "unexpected key or value" => {
            "here should be `key = value`"
        }
        "unexpected content" => "nothing more is allowed in this line",
        "invalid value" => {
            "this is no value: write a number, true or false, a text in quotes, or a list in `[ ]`"
        }
        "unclosed array" => "`]` is missing at the end of the list",
        "unclosed inline table" => "`}` is missing at the end of the table",
        "unclosed table" => "`]` is missing at the end of the table's name",
        "unclosed array table" => "`]]` is missing at the end of the table's name",
        "cannot recurse further; max recursion depth met" | "recursion limit exceeded" => {
            "lists and tables are nested too deeply"
        }
        // JSON
        "EOF while parsing a list" => "it ends within a list: `]` is missing",
        "EOF while parsing an object" => "it ends within an object: `}` is missing",
        "EOF while parsing a string" => "it ends within a text: the quote at its end is missing",
        "EOF while parsing a value" => "it ends where a value should be",
        "expected value" => {
            "here should be a value: a number, true, false, null, a text in double quotes, a list or an object"
        }
        "expected ident" => "this is no value: the only words of JSON are true, false and null",
        "key must be a string" => "a key has to be in double quotes",
        "trailing comma" => "one `,` too many",
        "trailing characters" => "more follows after the end of the value",
        "invalid number" => "this is no number as JSON writes them",
        "number out of range" => "the number is too large",
        "invalid escape" => {
            "after `\\` there can only be `\"`, `\\`, `/`, `b`, `f`, `n`, `r`, `t`, or `u` with four hexadecimal digits"
        }
        "invalid unicode code point"
        | "lone leading surrogate in hex escape"
        | "unexpected end of hex escape" => "a character of this text is none: its `\\u`, or its bytes",
        "control character (\\u0000-\\u001F) found while parsing a string" => {
            "a text cannot have a line end, a tab or another control character in it: write `\\n` or `\\t`"
        }
        _ => return None,
    })
}

/// The value that was found.
fn found_in_words(found: &str) -> String {
    for kind in ["boolean ", "integer ", "floating point "] {
        if let Some(value) = found.strip_prefix(kind) {
            // A number that no type holds is followed by the widest one.
            let value = value.split("` as ").next().unwrap_or(value).trim_matches('`');
            let value = value.split(" as ").next().unwrap_or(value).trim_matches('`');
            return format!("`{value}`");
        }
    }
    for kind in ["string ", "character "] {
        if let Some(value) = found.strip_prefix(kind) {
            return format!("text {value}");
        }
    }
    match found {
        "sequence" => "a list",
        "map" => "a table",
        "unit value" | "Option value" => "no value",
        "newtype struct" | "enum" | "unit variant" | "newtype variant" | "tuple variant"
        | "struct variant" => "a name",
        "byte array" => "bytes",
        other => other,
    }
    .to_owned()
}

/// What was expected. A description that a type gives itself is in plain words already.
fn expected_in_words(wanted: &str) -> String {
    if let Some(number) = number(wanted) {
        return number;
    }
    if let Some(length) =
        wanted.strip_prefix("an array of length ").or_else(|| wanted.strip_prefix("a tuple of size "))
    {
        return format!("a list of {length}");
    }
    if let Some(length) = wanted.strip_prefix("tuple struct ") {
        let count = length.split(" with ").nth(1).and_then(|rest| rest.split(' ').next());
        return count.map_or_else(|| "a list".to_owned(), |count| format!("a list of {count}"));
    }
    let rest = |prefix: &str| wanted.strip_prefix(prefix).is_some();
    if rest("struct ") || rest("newtype struct ") || rest("internally tagged enum") {
        return "a table".to_owned();
    }
    if rest("enum ") || rest("variant of enum") || rest("variant identifier") {
        return "one of the names that are allowed here".to_owned();
    }
    match wanted {
        "a boolean" | "boolean" | "bool" => "true or false",
        "a string" | "string" | "str" | "a borrowed string" | "a character" => "a text in quotes",
        "a sequence" | "sequence" | "fewer elements in array" | "fewer elements in sequence" => "a list",
        "a map" | "map" | "table" => "a table",
        "string or table" | "string or map" => "a text in quotes or a table",
        "unit" | "null" | "unit struct" => "no value",
        "option" => "a value",
        "field identifier" => "a key",
        other => other,
    }
    .to_owned()
}

/// A number type of Rust in words, with its range where that is short enough to help.
fn number(wanted: &str) -> Option<String> {
    let (least, kind) = match wanted.strip_prefix("a nonzero ").or_else(|| wanted.strip_prefix("nonzero ")) {
        Some(kind) => (1, kind),
        None => (0, wanted),
    };
    let whole = |last: u32| Some(format!("a whole number from {least} to {last}"));
    match kind {
        "f32" | "f64" => Some("a number".to_owned()),
        "u8" => whole(u32::from(u8::MAX)),
        "u16" => whole(u32::from(u16::MAX)),
        "u32" => whole(u32::MAX),
        "u64" | "u128" | "usize" => Some(format!("a whole number, {least} or more")),
        "i8" => Some(format!("a whole number from {} to {}", i8::MIN, i8::MAX)),
        "i16" => Some(format!("a whole number from {} to {}", i16::MIN, i16::MAX)),
        "i32" => Some(format!("a whole number from {} to {}", i32::MIN, i32::MAX)),
        "i64" | "i128" | "isize" => Some("a whole number".to_owned()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use serde::Deserialize;

    use super::*;

    #[derive(Debug, Deserialize)]
    #[expect(dead_code, reason = "only the errors are looked at")]
    struct All {
        f32: Option<f32>,
        f64: Option<f64>,
        u8: Option<u8>,
        u16: Option<u16>,
        u32: Option<u32>,
        u64: Option<u64>,
        usize: Option<usize>,
        i8: Option<i8>,
        i64: Option<i64>,
        bool: Option<bool>,
        text: Option<String>,
        letter: Option<char>,
        list: Option<Vec<u8>>,
        array: Option<[f64; 3]>,
        pair: Option<(u8, u8)>,
        map: Option<BTreeMap<String, u8>>,
        inner: Option<Inner>,
        choice: Option<Choice>,
        any: Option<Any>,
        nonzero: Option<std::num::NonZeroU16>,
        new: Option<New>,
    }

    #[derive(Debug, Deserialize)]
    #[expect(dead_code, reason = "only the errors are looked at")]
    struct Inner {
        a: u8,
    }

    #[derive(Debug, Deserialize)]
    struct New(#[expect(dead_code, reason = "only the errors are looked at")] u16);

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Choice {
        One,
        Two,
    }

    #[derive(Debug, Deserialize)]
    #[serde(untagged)]
    #[expect(dead_code, reason = "only the errors are looked at")]
    enum Any {
        Number(u8),
        Text(String),
    }

    /// The words that mean something to a programmer of Rust only.
    const FOREIGN: [&str; 22] = [
        "f32", "f64", "u8", "u16", "u32", "u64", "u128", "usize", "i8", "i16", "i32", "i64", "i128", "isize",
        "struct", "variant", "enum", "integer", "boolean", "sequence", "untagged", "tuple",
    ];

    fn assert_plain(said: &str) {
        let words: Vec<&str> = said
            .split(|letter: char| !letter.is_ascii_alphanumeric())
            .filter(|word| !word.is_empty())
            .collect();
        for foreign in FOREIGN {
            assert!(!words.contains(&foreign), "{foreign}: {said}");
        }
    }

    #[test]
    fn no_error_names_a_type_of_the_program() {
        let keys = [
            "f32", "f64", "u8", "u16", "u32", "u64", "usize", "i8", "i64", "bool", "text", "letter", "list",
            "array", "pair", "map", "inner", "choice", "any", "nonzero", "new",
        ];
        let values = [
            "\"often\"",
            "1.5",
            "-1",
            "300",
            "70000",
            "true",
            "[1, 2]",
            "[\"a\"]",
            "{ b = 1 }",
            "99999999999999999999999",
            "1979-05-27",
            "{}",
            "[]",
            "0",
            "[1, 2, 3, 4]",
        ];
        let mut refused = 0;
        for key in keys {
            for value in values {
                let text = format!("{key} = {value}");
                if let Err(error) = crate::parse::<All>(&text, Path::new("x.toml")) {
                    let said = error.to_string().replace(&format!("`{key}`"), "");
                    assert_plain(&said);
                    refused += 1;
                }
            }
        }
        assert!(refused > 150, "{refused}");
    }

    #[test]
    fn faults_of_the_syntax_are_in_plain_words() {
        let toml = [
            "f64",
            "f64 =",
            "f64 = = 1",
            "f64 1",
            "list = [1 2]",
            "list = [1,,2]",
            "text = often",
            "text = often\"",
            "list = [1",
            "inner = { a = 1",
            "[inner",
            "[[inner",
            "f64 = 1 2",
            "inner = { a }",
            "= 1",
            "f6!4 = 1",
            "inner = { a = 1 b = 2 }",
            "f64 = @",
        ];
        let json = [
            "{\"f64\":",
            "{\"list\": [1",
            "{\"text\": \"a",
            "{\"f64\": NaN}",
            "{\"f64\": nul}",
            "{f64: 1}",
            "{\"f64\": 1,}",
            "{\"f64\": 1} 2",
            "{\"f64\": 01}",
            "{\"f64\": 1e999}",
            "{\"text\": \"\\q\"}",
            "{\"text\": \"\\ud800\"}",
            "{\"text\": \"a\tb\"}",
            "{\"f64\" 1}",
            "{\"list\": [1 2]}",
        ];
        let of_toml = toml.map(|text| {
            let error = crate::parse::<All>(text, Path::new("x.toml")).unwrap_err();
            format!("{text}\n    {error}\n")
        });
        let of_json = json.map(|text| {
            let error = serde_json::from_str::<All>(text).unwrap_err();
            format!("{text}\n    {}\n", plain(&error.to_string()))
        });
        insta::assert_snapshot!(of_toml.concat() + &of_json.concat());
    }

    #[test]
    fn ranges_are_those_of_the_types() {
        for (message, said) in [
            (
                "invalid value: integer `-1`, expected u32",
                "invalid value: `-1`, expected a whole number from 0 to 4294967295",
            ),
            (
                "invalid value: integer `300`, expected u8",
                "invalid value: `300`, expected a whole number from 0 to 255",
            ),
            (
                "invalid type: floating point `1.5`, expected usize",
                "invalid type: `1.5`, expected a whole number, 0 or more",
            ),
            (
                "invalid value: integer `0`, expected a nonzero u16",
                "invalid value: `0`, expected a whole number from 1 to 65535",
            ),
            (
                "invalid type: integer `9e30` as i128, expected u64",
                "invalid type: `9e30`, expected a whole number, 0 or more",
            ),
            ("invalid length 2, expected an array of length 3", "invalid length 2, expected a list of 3"),
            ("invalid type: map, expected a sequence", "invalid type: a table, expected a list"),
            ("invalid type: sequence, expected struct Cycle", "invalid type: a list, expected a table"),
            ("invalid type: null, expected a boolean", "invalid type: null, expected true or false"),
            ("unknown variant `x`, expected `a` or `b`", "unknown value `x`, expected `a` or `b`"),
            ("missing field `a`", "missing field `a`"),
            (
                "invalid type: null, expected f64 at line 1 column 4",
                "invalid type: null, expected a number at line 1 column 4",
            ),
        ] {
            assert_eq!(plain(message), said);
            assert_plain(&plain(message));
        }
    }
}

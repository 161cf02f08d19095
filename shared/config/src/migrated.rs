//! Migrates files of older versions: adds the keys and tables that this version requires, with their built-in values,
//! and renames those that have a new name. Everything else, comments included, stays unchanged.

use std::path::{Path, PathBuf};

use crate::SettingsError;

/// Maximum number of migration steps, above the number of keys of any file. It guards against an endless loop.
const MAX_STEPS: usize = 2000;

/// A migrated file; it has not been written to disk yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Migration {
    /// The path of the file.
    pub file: PathBuf,
    /// The migrated text.
    pub text: String,
    /// The changes, in order; empty if the file was up to date.
    pub steps: Vec<String>,
}

/// Migrates a text until `parse` accepts it. `builtin` is this version's built-in file, from which keys are added.
///
/// # Errors
///
/// The text has an error that no migration fixes.
pub(crate) fn migrated(
    text: String,
    file: &Path,
    builtin: &str,
    parse: impl Fn(&str) -> Result<(), SettingsError>,
) -> Result<Migration, SettingsError> {
    let mut migrated = Migration { file: file.to_owned(), text, steps: Vec::new() };
    for _step in 0..MAX_STEPS {
        let Err(error) = parse(&migrated.text) else { return Ok(migrated) };
        if !migrated.apply_fix(&error, builtin) {
            return Err(error);
        }
    }
    parse(&migrated.text).map(|()| migrated)
}

impl Migration {
    /// Applies the migration for an error; returns whether there is one.
    fn apply_fix(&mut self, error: &SettingsError, builtin: &str) -> bool {
        let SettingsError::Invalid { line, column, reason, .. } = error else { return false };
        if let Some((old, new)) = settings::renaming(reason) {
            return self.rename((*line, *column), old, new);
        }
        if self.list_sources() || self.rename_endpoints() {
            return true;
        }
        let Some(key) = reason.strip_prefix("missing field `").and_then(|rest| rest.split('`').next()) else {
            return false;
        };
        let table = self.table_at(*line);
        // A table without a header of its own is reported under its parent, at the first header in it.
        for table in [table.as_str(), table.rsplit_once('.').map_or("", |(parent, _)| parent)] {
            let within = lines_of(builtin, table);
            if let Some(place) = within.iter().position(|line| key_of(line) == Some(key)) {
                self.add_key(table, key, &within, place);
                return true;
            }
        }
        let path = if table.is_empty() { key.to_owned() } else { format!("{table}.{key}") };
        self.add_tables(&path, builtin)
    }

    /// Replaces a name in the line of its error, where it stands behind the error's column if possible. Line and column
    /// count from one. Returns whether the name is there.
    fn rename(&mut self, (line, column): (usize, usize), old: &str, new: &str) -> bool {
        let mut lines: Vec<String> = self.text.lines().map(str::to_owned).collect();
        let Some(line) = line.checked_sub(1).and_then(|index| lines.get_mut(index)) else { return false };
        let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
        let is_whole = |at: &usize| {
            let (before, after) = (line.get(..*at).unwrap_or(""), line.get(at + old.len()..).unwrap_or(""));
            !before.ends_with(is_part) && !after.starts_with(is_part)
        };
        let places: Vec<usize> = line.match_indices(old).map(|(at, _)| at).filter(is_whole).collect();
        let first = line.char_indices().nth(column.saturating_sub(1)).map_or(0, |(at, _)| at);
        let Some(&at) = places.iter().find(|at| **at >= first).or(places.first()) else { return false };
        line.replace_range(at..at + old.len(), new);
        self.text = lines.join("\n") + "\n";
        let step = format!("`{old}` is now `{new}`");
        if !self.steps.contains(&step) {
            self.steps.push(step);
        }
        true
    }

    /// Replaces `sources = N` in the table `sensor`, the key of older versions. The first source becomes the simulator,
    /// every further one an external source.
    fn list_sources(&mut self) -> bool {
        let sensor = lines_of(&self.text, "sensor");
        let Some(old) = sensor.iter().find(|line| key_of(line) == Some("sources")) else { return false };
        let number = old.split(['=', '#']).nth(1).and_then(|number| number.trim().parse::<u32>().ok());
        let old = (*old).to_owned();
        let mut list = String::new();
        for source in 0..number.unwrap_or(1) {
            let (name, kind) = match source {
                0 => ("simulator".to_owned(), "simulator"),
                other => (format!("source {other}"), "external"),
            };
            list += &format!("\n[[sensor.source]]\nname = \"{name}\"\nkind = \"{kind}\"\n");
        }
        self.text = self.text.replacen(&format!("{old}\n"), "", 1) + &list;
        self.steps.push(format!("`{}` of [sensor] became a [[sensor.source]] each", old.trim()));
        true
    }

    /// Replaces `tls/` endpoints (TLS over TCP) in the table `link` by `quic/` ones (TLS over UDP).
    fn rename_endpoints(&mut self) -> bool {
        const NAMES: [&str; 2] = ["\"tls/", "\"quic/"];
        let is_old =
            |line: &&str| matches!(key_of(line), Some("listen" | "connect")) && line.contains(NAMES[0]);
        let Some(old) = lines_of(&self.text, "link").into_iter().find(is_old).map(str::to_owned) else {
            return false;
        };
        self.text = self.text.replacen(&old, &old.replace(NAMES[0], NAMES[1]), 1);
        let key = key_of(&old).unwrap_or_default();
        self.steps.push(format!(
            "`{key}` of [link] uses \"quic/\" instead of \"tls/\": change the other machine too; firewalls have to let \
             UDP through"
        ));
        true
    }

    /// The table that contains a line; lines count from one.
    fn table_at(&self, line: usize) -> String {
        let before: Vec<&str> = self.text.lines().take(line).collect();
        before.iter().rev().find_map(|line| table_of(line)).unwrap_or_default().to_owned()
    }

    /// Inserts a key's line of the built-in file, together with the comment lines below it.
    fn add_key(&mut self, table: &str, key: &str, within: &[&str], place: usize) {
        let said = |line: &&&str| line.starts_with(' ') && line.trim_start().starts_with('#');
        let below = within.iter().skip(place + 1).take_while(said);
        let new: Vec<&str> = within.get(place).into_iter().chain(below).copied().collect();
        if !table.is_empty() && !self.text.lines().any(|line| table_of(line) == Some(table)) {
            self.text += &format!("\n[{table}]\n");
        }
        let mut lines: Vec<&str> = self.text.lines().collect();
        let mut inside = table.is_empty();
        let mut last = None;
        for (number, line) in lines.iter().enumerate() {
            if line.starts_with('[') {
                inside = table_of(line) == Some(table);
                if inside {
                    last = Some(number);
                }
            } else if inside && !line.trim().is_empty() && !line.starts_with('#') {
                last = Some(number);
            }
        }
        let at = last.map_or(0, |last| last + 1);
        lines.splice(at..at, new);
        self.text = lines.join("\n") + "\n";
        let value = within.get(place).map_or("", |line| line.split(" #").next().unwrap_or(line).trim());
        debug_assert!(value.starts_with(key), "{value}");
        self.steps.push(format!("[{table}] has the key `{value}`"));
    }

    /// Appends a table of the built-in file with its subtables; returns whether the built-in file has that table.
    fn add_tables(&mut self, path: &str, builtin: &str) -> bool {
        let mut new = String::new();
        let mut inside = false;
        for line in builtin.lines() {
            if line.starts_with('[') {
                let name = line.trim_start_matches('[').split(']').next().unwrap_or_default();
                inside = name == path || name.strip_prefix(path).is_some_and(|rest| rest.starts_with('.'));
                if inside {
                    new += "\n";
                }
            }
            // A comment before a header belongs to the next table, so it is left out.
            if inside && !line.is_empty() && !line.starts_with('#') {
                new += line;
                new += "\n";
            }
        }
        self.text += &new;
        self.steps.push(format!("the table [{path}]"));
        !new.is_empty()
    }
}

/// The lines of a table without its header; with an empty name, the lines before the first header.
fn lines_of<'a>(text: &'a str, table: &str) -> Vec<&'a str> {
    let mut inside = table.is_empty();
    let mut lines = Vec::new();
    for line in text.lines() {
        if line.starts_with('[') {
            inside = table_of(line) == Some(table);
        } else if inside {
            lines.push(line);
        }
    }
    lines
}

/// The table whose header a line is; `None` for an array of tables.
fn table_of(line: &str) -> Option<&str> {
    line.strip_prefix('[')?.split(']').next().filter(|name| !name.starts_with('['))
}

fn key_of(line: &str) -> Option<&str> {
    line.split_once('=').map(|(key, _)| key.trim()).filter(|key| !key.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leo::Leo;

    const BUILTIN: &str = include_str!("../../../config/leo.toml");

    fn leo(text: &str) -> Result<Migration, SettingsError> {
        let file = Path::new("leo.toml");
        migrated(text.to_owned(), file, BUILTIN, |text| crate::parse::<Leo>(text, file).map(drop))
    }

    /// The built-in file without the lines that start with one of `starts`.
    fn without(starts: &[&str]) -> String {
        let kept = BUILTIN.lines().filter(|line| !starts.iter().any(|start| line.starts_with(start)));
        kept.map(|line| format!("{line}\n")).collect()
    }

    #[test]
    fn a_file_of_this_version_is_left_as_it_is() {
        let migrated = leo(BUILTIN).unwrap();
        assert_eq!((migrated.text.as_str(), migrated.steps.len()), (BUILTIN, 0));
    }

    #[test]
    fn any_missing_key_is_added_in_its_place_with_its_comment() {
        let old = without(&["language", "                        #", "noise", "on_alert"])
            .replace("rate_hz = 250.0 ", "rate_hz = 125.0 ");
        let migrated = leo(&old).unwrap();
        assert_eq!(migrated.steps.len(), 3, "{:?}", migrated.steps);
        assert!(migrated.steps.contains(&"[learner] has the key `language = \"paper\"`".to_owned()));
        assert!(
            migrated.text.contains("                        # \"extended\": also negations"),
            "{}",
            migrated.text
        );
        assert!(migrated.text.contains("rate_hz = 125.0 "), "what was set stays");
        let learner = lines_of(&migrated.text, "learner");
        assert!(learner.iter().any(|line| line.starts_with("noise = 0.0")), "{learner:?}");
        for line in old.lines() {
            assert!(migrated.text.contains(line), "{line} is lost");
        }
    }

    #[test]
    fn every_single_key_and_table_can_be_missing() {
        let mut removed = 0;
        for (number, line) in BUILTIN.lines().enumerate() {
            let is_optional = ["name ", "kind "].iter().any(|key| line.starts_with(key));
            if key_of(line).is_none() || line.starts_with([' ', '#']) || is_optional {
                continue;
            }
            let lines = BUILTIN.lines().enumerate().filter(|(other, _)| *other != number);
            let old: String = lines.map(|(_, line)| format!("{line}\n")).collect();
            let migrated = leo(&old).unwrap_or_else(|error| panic!("{line}: {error}"));
            assert_eq!(migrated.steps.len(), 1, "{line}: {:?}", migrated.steps);
            removed += 1;
        }
        assert!(removed > 50, "only {removed} keys were removed");
        let start = BUILTIN.find("[mock_bus]").unwrap();
        let end = BUILTIN.find("# Tells people what happens.").unwrap();
        let migrated = leo(&(BUILTIN[..start].to_owned() + &BUILTIN[end..])).unwrap();
        assert_eq!(migrated.steps, ["the table [mock_bus]"]);
        assert!(migrated.text.contains("[mock_bus.realtime]"), "{}", migrated.text);
    }

    #[test]
    fn a_file_from_before_arming_gets_its_keys_and_table() {
        let keys = [
            "automatic_arming",
            "stop_category",
            "max_tracking_error_rad",
            "blocked_after_ms",
            "max_beyond_limits_rad",
        ];
        let start = BUILTIN.find("[motor.alert]").unwrap();
        let end = BUILTIN.find("[motor.realtime]").unwrap();
        let old = without(&keys).replace(&BUILTIN[start..end], "");
        let migrated = leo(&old).unwrap();
        assert_eq!(migrated.steps.len(), keys.len() + 1, "{:?}", migrated.steps);
        assert!(migrated.steps.contains(&"the table [motor.alert]".to_owned()), "{:?}", migrated.steps);
        let [new, builtin]: [Leo; 2] =
            [&migrated.text, BUILTIN].map(|text| crate::parse(text, Path::new("leo.toml")).unwrap());
        assert_eq!(new.motor.alert, builtin.motor.alert);
        assert_eq!(new.motor.automatic_arming, builtin.motor.automatic_arming);
        for line in old.lines() {
            assert!(migrated.text.contains(line), "{line} is lost");
        }
    }

    #[test]
    fn a_table_without_a_head_of_its_own_gets_one() {
        let old = without(&["[mock_bus]", "seed", "faults", "fast_read_continues_after_gap"]);
        let migrated = leo(&old).unwrap();
        assert_eq!(migrated.steps.len(), 3, "{:?}", migrated.steps);
        assert_eq!(migrated.text.matches("\n[mock_bus]\n").count(), 1, "{}", migrated.text);
    }

    #[test]
    fn a_number_of_sources_becomes_a_list_of_them() {
        let old = without(&["[[sensor.source]]", "name = ", "kind = "]).replacen(
            "[sensor]\n",
            "[sensor]\nsources = 2 # how many\n",
            1,
        );
        let migrated = leo(&old).unwrap();
        assert_eq!(migrated.steps, ["`sources = 2 # how many` of [sensor] became a [[sensor.source]] each"]);
        let leo: Leo = crate::parse(&migrated.text, Path::new("leo.toml")).unwrap();
        assert_eq!(leo.sensor.source.len(), 2);
        assert_eq!(leo.sensor.simulator(), Some(0));
    }

    #[test]
    fn endpoints_of_tls_over_tcp_become_those_of_quic() {
        let old = BUILTIN
            .replacen("listen = []  ", "listen = [\"tls/0.0.0.0:7447\", \"tls/[::1]:7448\"] ", 1)
            .replacen("connect = []  ", "connect = [\"tls/a.local:1\", \"quic/127.0.0.1:2\"] ", 1);
        let migrated = leo(&old).unwrap();
        assert_eq!(migrated.steps.len(), 2, "{:?}", migrated.steps);
        assert!(
            migrated.text.contains("listen = [\"quic/0.0.0.0:7447\", \"quic/[::1]:7448\"] "),
            "{}",
            migrated.text
        );
        assert!(
            migrated.text.contains("connect = [\"quic/a.local:1\", \"quic/127.0.0.1:2\"] "),
            "{}",
            migrated.text
        );
    }

    #[test]
    fn an_error_that_no_migration_corrects_is_still_reported() {
        for (from, to) in [
            ("rate_hz = 200.0", "rate_hz = \"often\""),
            ("queue_depth = 4", "fraems = 4"),
            ("[belief]", "[belief"),
        ] {
            let error = leo(&BUILTIN.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(error.starts_with("leo.toml:"), "{error}");
        }
    }
}

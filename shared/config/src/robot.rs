use std::path::{Path, PathBuf};

use belief::percepts::Percepts;
use message::MAX_PERSPECTIVES;
use perspective::settings::Perspective;
use settings::{closest, error_at, value_span};

use crate::leo::{Leo, link_error, sources_error};
use crate::migrated::{Migration, migrated};
use crate::motor::{Limit, Motor};
use crate::{Files, SettingsError, motor, parse, text};

/// The whole configuration of a robot: `leo.toml` and its sibling files.
#[derive(Clone, Debug)]
pub struct Robot {
    /// `leo.toml`: the processes.
    pub leo: Leo,
    /// `percepts.toml`: percepts, and how beliefs are formed.
    pub percepts: Percepts,
    /// `perspective.toml`: what a partner can perceive.
    pub perspective: Perspective,
    /// `motor.toml`: buses and joints.
    pub motor: Motor,
    /// `leo.urdf`: the robot model, as text.
    pub urdf: String,
}

/// The built-in files; with them the executable runs without a configuration folder.
pub(crate) mod builtin {
    pub(crate) const LEO: &str = include_str!("../../../config/leo.toml");
    pub(crate) const PERCEPTS: &str = include_str!("../../../config/percepts.toml");
    pub(crate) const PERSPECTIVE: &str = include_str!("../../../config/perspective.toml");
    pub(crate) const MOTOR: &str = include_str!("../../../config/motor.toml");
    pub(crate) const URDF: &str = include_str!("../../../config/leo.urdf");
}

impl Robot {
    /// Reads `leo` (a `leo.toml`) and its sibling files. A missing sibling is replaced by the built-in one; without
    /// `leo`, every file is built in.
    ///
    /// # Errors
    ///
    /// `leo` cannot be read, or a file is invalid.
    pub fn load(leo: Option<&Path>) -> Result<Self, SettingsError> {
        Self::of(&Files::read(leo)?)
    }

    /// Builds the robot that the files describe.
    ///
    /// # Errors
    ///
    /// A file is invalid.
    pub fn of(files: &Files) -> Result<Self, SettingsError> {
        let [leo, percepts, perspective, motor] =
            ["leo.toml", "percepts.toml", "perspective.toml", "motor.toml"].map(|name| files.file(name));
        let (leo_text, leo_file) = leo;
        let mut leo = parse_and_validate(leo_text, &leo_file)?;
        if let Some(folder) = files.leo().and_then(Path::parent) {
            leo.sensor.source.iter_mut().for_each(|source| source.relative_to(folder));
            leo.link.relative_to(folder);
        }
        let hinted = |error| with_migration_hint(error, files.leo().unwrap_or(&leo_file), true);
        // The migration adds no key to these files.
        let renamed = |error| with_migration_hint(error, files.leo().unwrap_or(&leo_file), false);
        let percepts = Percepts::parse(percepts.0, &percepts.1).map_err(renamed)?;
        check_perceivable(&leo, &percepts, leo_text, &leo_file)?;
        let perspective = parse(perspective.0, &perspective.1).map_err(hinted)?;
        let motor = motor::parse(motor.0, &motor.1).map_err(renamed)?;
        check_groups(&leo, &motor, leo_text, &leo_file)?;
        Ok(Self { leo, percepts, perspective, motor, urdf: files.file("leo.urdf").0.to_owned() })
    }

    /// The path of a sibling file of `leo` (a `leo.toml`); `None` if the built-in file is used instead.
    #[must_use]
    pub fn sibling_file(leo: Option<&Path>, name: &str) -> Option<PathBuf> {
        // A link to a missing file is there, and an error to be reported.
        let is_there = |file: &PathBuf| file.symlink_metadata().is_ok();
        leo.and_then(Path::parent).map(|folder| folder.join(name)).filter(is_there)
    }

    /// An error about a joint limit in the `motor.toml` beside `leo` (a `leo.toml`), for checks against another file.
    #[must_use]
    pub fn limit_error(leo: Option<&Path>, joint: &str, limit: Limit, reason: String) -> SettingsError {
        match Files::read(leo) {
            Ok(files) => {
                let (text, file) = files.file("motor.toml");
                motor::limit_error(text, &file, joint, limit, reason)
            }
            Err(error) => error,
        }
    }

    /// An error about a value of `leo` (a `leo.toml`), for checks outside this crate. `path` holds the keys from the root
    /// on. `None` if the file has another value there: it was set on the command line.
    #[must_use]
    pub fn value_error(
        leo: Option<&Path>,
        path: &[&str],
        value: &str,
        reason: &str,
    ) -> Option<SettingsError> {
        let files = Files::read(leo).ok()?;
        let (text, file) = files.file("leo.toml");
        let span = value_span(text, path)?;
        let is_there = text.get(span.clone()).is_some_and(|there| there.contains(value));
        is_there.then(|| error_at(text, &file, span, reason.to_owned()))
    }

    /// Migrates `leo` (a `leo.toml`) and the other files beside it, if any, to this version. Writes no file.
    ///
    /// Keys are added to `leo.toml` and `perspective.toml`, and renamed in these, `percepts.toml` and `motor.toml`.
    ///
    /// # Errors
    ///
    /// A file cannot be read, or has an error that no migration fixes.
    pub fn migrated(leo: &Path) -> Result<Vec<Migration>, SettingsError> {
        type Parse = fn(&str, &Path) -> Result<(), SettingsError>;
        let files: [(&str, &str, Parse); 3] = [
            ("perspective.toml", builtin::PERSPECTIVE, |text, file| {
                parse::<Perspective>(text, file).map(drop)
            }),
            ("percepts.toml", "", |text, file| Percepts::parse(text, file).map(drop)),
            ("motor.toml", "", |text, file| motor::parse(text, file).map(drop)),
        ];
        let parse_leo = |text: &str| parse::<Leo>(text, leo).map(drop);
        let mut all = vec![migrated(text(leo)?, leo, builtin::LEO, parse_leo)?];
        for (name, builtin, parse) in files {
            let file = leo.with_file_name(name);
            if file.exists() {
                all.push(migrated(text(&file)?, &file, builtin, |text| parse(text, &file))?);
            }
        }
        Ok(all)
    }
}

impl Robot {
    /// The built-in `leo.toml` with some numbers replaced, each named by table and key, as in `sensor.rate_hz`.
    /// Comments are lost. Unknown names have no effect.
    #[must_use]
    pub fn leo_text_with(numbers: &[(&str, f64)]) -> String {
        let mut root: toml::Table = builtin::LEO.parse().unwrap_or_default();
        for (path, number) in numbers {
            let Some((table, key)) = path.rsplit_once('.') else { continue };
            let table =
                table.split('.').try_fold(&mut root, |table, name| table.get_mut(name)?.as_table_mut());
            match table.and_then(|table| table.get_mut(key)) {
                Some(toml::Value::Integer(value)) => *value = quantity::number::round_i64(*number),
                Some(value) => *value = toml::Value::Float(*number),
                None => {}
            }
        }
        root.to_string()
    }
}

/// Adds a hint to an error about a missing or renamed key: the command that migrates the file, see [`Robot::migrated`].
/// `adds`: whether it adds missing keys to this file.
fn with_migration_hint(mut error: SettingsError, leo: &Path, adds: bool) -> SettingsError {
    if let SettingsError::Invalid { reason, .. } = &mut error {
        let migrate = format!("`leo check --config {} --migrate`", leo.display());
        if adds && reason.starts_with("missing field") {
            *reason += &format!("; is it an older file? {migrate} adds it");
        } else if settings::renaming(reason).is_some() {
            *reason += &format!("; {migrate} renames it");
        }
    }
    error
}

/// Parses a `leo.toml` and checks the constraints between its values.
fn parse_and_validate(text: &str, file: &Path) -> Result<Leo, SettingsError> {
    let leo: Leo = parse(text, file).map_err(|error| with_migration_hint(error, file, true))?;
    let (goals, patience) = (leo.learner.goal_rate_hz.period(), leo.motor.command_timeout_ms.duration());
    if 2 * goals > patience {
        let at = text.find("command_timeout_ms").unwrap_or(0);
        let reason = format!(
            "the joints would stop between two goals: {} ms is less than two periods of `learner.goal_rate_hz` \
             ({} ms)",
            patience.as_millis(),
            (2 * goals).as_millis()
        );
        return Err(error_at(text, file, at..at, reason));
    }
    let (partners, depth) = (leo.belief.partners, leo.belief.depth.get());
    let perspectives = leo.belief.perspectives(partners);
    if usize::try_from(perspectives).map_or(true, |perspectives| perspectives > MAX_PERSPECTIVES) {
        let at = text.find("partners").unwrap_or(0);
        let reason = format!(
            "{partners} partners make {perspectives} perspectives when nested {depth} deep, and the most is \
             {MAX_PERSPECTIVES}: take fewer `partners` or less `depth`"
        );
        return Err(error_at(text, file, at..at, reason));
    }
    if let Some((index, reason)) = sources_error(&leo.sensor.source) {
        let at = source_offset(text, index);
        return Err(error_at(text, file, at..at, reason));
    }
    if let Some((key, reason)) = link_error(&leo.link) {
        let table = text.find("\n[link]").unwrap_or(0);
        let at =
            text.get(table..).and_then(|rest| rest.find(&format!("\n{key} "))).map_or(0, |at| table + at + 1);
        return Err(error_at(text, file, at..at, reason));
    }
    Ok(leo)
}

/// Rejects a source whose observations could never pass the percept threshold.
fn check_perceivable(leo: &Leo, percepts: &Percepts, text: &str, file: &Path) -> Result<(), SettingsError> {
    for (index, source) in leo.sensor.source.iter().enumerate() {
        let confidence = source.confidence(percepts);
        if confidence <= percepts.threshold {
            let at = source_offset(text, index);
            let reason = format!(
                "nothing of `{}` would be perceived: with so large a `position_sd_m` its confidence is at most \
                 {confidence:.2}, and the threshold in percepts.toml is {}",
                source.name, percepts.threshold
            );
            return Err(error_at(text, file, at..at, reason));
        }
    }
    Ok(())
}

/// Rejects a reaction to alerts of a joint group that `motor.toml` does not have.
fn check_groups(leo: &Leo, motor: &Motor, text: &str, file: &Path) -> Result<(), SettingsError> {
    let Some(group) = leo.motor.alert.groups.keys().find(|group| !motor.groups.contains(group)) else {
        return Ok(());
    };
    let span = value_span(text, &["motor", "alert", "groups", group]).unwrap_or(0..0);
    let near = closest(group, motor.groups.iter().map(String::as_str));
    let reason = format!(
        "there is no joint group `{group}` in motor.toml; the groups are {}{}",
        motor.groups.join(", "),
        near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"))
    );
    Err(error_at(text, file, span, reason))
}

/// The byte offset at which a source of the list begins.
fn source_offset(text: &str, index: usize) -> usize {
    text.match_indices("\n[[sensor.source]]").nth(index).map_or(0, |(at, _)| at + 1)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::test_support::{assert_invalid, reason_of};

    #[test]
    fn the_built_in_robot_is_right_and_has_65_joints() {
        let robot = Robot::load(None).unwrap();
        assert_eq!(robot.motor.joints.len(), 65);
    }

    #[test]
    fn an_unknown_joint_group_is_refused_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let leo = folder.path().join("leo.toml");
        let text = builtin::LEO.replace("groups = {}", "groups = { face = \"limp\", nek = \"limp\" }");
        fs::write(&leo, &text).unwrap();
        let line = text[..text.find("nek =").unwrap()].lines().count();
        let error = Robot::load(Some(&leo)).unwrap_err();
        assert!(matches!(error, SettingsError::Invalid { line: found, .. } if found == line), "{error:?}");
        assert!(reason_of(&error).ends_with("did you mean `neck`?"), "{error}");
    }

    #[test]
    fn goals_that_come_too_seldom_are_refused() {
        let text = Robot::leo_text_with(&[("learner.goal_rate_hz", 5.0)]);
        let error = parse_and_validate(&text, Path::new("leo.toml")).unwrap_err();
        assert!(reason_of(&error).contains("200 ms"), "{error}");
        insta::assert_snapshot!(reason_of(&error));
    }

    #[test]
    fn more_perspectives_than_a_robot_can_keep_are_refused_with_the_line() {
        let with = |partners, depth| {
            let text = Robot::leo_text_with(&[("belief.partners", partners), ("belief.depth", depth)]);
            parse_and_validate(&text, Path::new("leo.toml"))
        };
        assert_eq!(with(2.0, 3.0).unwrap().belief.perspectives(2), 15);
        assert_eq!(with(255.0, 1.0).unwrap().belief.perspectives(255), 256);
        for (partners, depth, perspectives) in [(256.0, 1.0, "257"), (4.0, 4.0, "341")] {
            let error = with(partners, depth).unwrap_err().to_string();
            assert!(error.starts_with("leo.toml:") && error.contains(perspectives), "{error}");
        }
        for depth in [0.0, 7.0] {
            let error = with(1.0, depth).unwrap_err();
            assert!(reason_of(&error).contains("from 1 to 6"), "{error}");
        }
    }

    #[test]
    fn the_simulator_is_the_only_source_unless_more_are_named() {
        let robot = Robot::load(None).unwrap();
        assert_eq!((robot.leo.sensor.source.len(), robot.leo.sensor.simulator()), (1, Some(0)));
    }

    #[test]
    fn contradictory_sources_are_refused_with_their_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("leo.toml");
        let lines = builtin::LEO.lines().count();
        let camera = |name: &str, more: &str| {
            format!("\n[[sensor.source]]\nname = \"{name}\"\nkind = \"external\"\n{more}")
        };
        let mut wording = String::new();
        for (sources, line, word) in [
            (camera("a", "") + &camera("a", ""), lines + 6, "`a` already"),
            (camera("a", "position_sd_m = 0.1"), lines + 2, "`position_sd_m`"),
            (camera("a", "rate_hz = 0.0"), lines + 5, "from 1 to 10000 Hz"),
            (camera("a", "rate = 5.0"), lines + 5, "`rate_hz`?"),
        ] {
            fs::write(&file, builtin::LEO.to_owned() + &sources).unwrap();
            let error = Robot::load(Some(&file)).unwrap_err().to_string();
            assert!(
                error.contains(&format!("leo.toml:{line}:1: ")) || error.contains(&format!(":{line}:11")),
                "{error}"
            );
            assert!(error.contains(word), "{error}");
            let (_, reason) = error.split_once("leo.toml:").unwrap().1.split_once(": ").unwrap();
            wording += &format!("{}\n    {reason}\n", sources.trim());
        }
        insta::assert_snapshot!(wording);
        fs::write(&file, builtin::LEO.to_owned() + &camera("a", "position_sd_m = 0.02")).unwrap();
        assert_eq!(Robot::load(Some(&file)).unwrap().leo.sensor.source.len(), 2);
    }

    #[test]
    fn numbers_of_the_built_in_file_can_be_replaced() {
        let text =
            Robot::leo_text_with(&[("sensor.rate_hz", 1000.0), ("sensor.realtime.fifo_priority", 0.0)]);
        let leo: Leo = parse(&text, Path::new("leo.toml")).unwrap();
        assert!((leo.sensor.rate_hz.get() - 1000.0).abs() < 1e-9);
        assert_eq!(leo.sensor.realtime.fifo_priority.get(), 0);
    }

    #[test]
    fn an_invalid_file_beside_leo_toml_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let leo = folder.path().join("leo.toml");
        fs::write(&leo, builtin::LEO).unwrap();
        fs::write(folder.path().join("percepts.toml"), "threshhold = 0.5\n").unwrap();
        let error = Robot::load(Some(&leo)).unwrap_err();
        assert!(error.to_string().contains("percepts.toml:"), "{error}");
        assert_invalid(&error, (1, 1), "`threshold`?");
    }
}

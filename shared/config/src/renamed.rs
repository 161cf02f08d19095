//! The names of older versions, each with its successor. A file with an old name is rejected.

/// Kind of file, path of the old name, and path of the new one. A path with `=` is that of a value.
const RENAMED: [(&str, &str, &str); 43] = [
    ("leo.toml", "buffers.objects", "buffers.max_objects"),
    ("leo.toml", "buffers.frames", "buffers.queue_depth"),
    ("leo.toml", "motor.answer_within_ms", "motor.reply_timeout_ms"),
    ("leo.toml", "motor.alert.lower_within_ms", "motor.alert.lower_timeout_ms"),
    ("leo.toml", "mock_bus.followers_go_on", "mock_bus.fast_read_continues_after_gap"),
    ("leo.toml", "link.side = away", "link.side = remote"),
    ("leo.toml", "link.off_board", "link.remote_processes"),
    ("leo.toml", "link.authority", "link.ca_certificate"),
    ("leo.toml", "link.late_after_ms", "link.max_command_age_ms"),
    ("leo.toml", "supervisor.keep_serial_lines_prompt", "supervisor.boost_serial_kworkers"),
    ("leo.toml", "supervisor.ready_within_ms", "supervisor.ready_timeout_ms"),
    ("leo.toml", "supervisor.backoff_first_ms", "supervisor.initial_backoff_ms"),
    ("leo.toml", "supervisor.backoff_most_ms", "supervisor.max_backoff_ms"),
    ("leo.toml", "supervisor.deaths_most", "supervisor.max_deaths"),
    ("leo.toml", "supervisor.stop_within_ms", "supervisor.stop_timeout_ms"),
    ("leo.toml", "supervisor.turn_within_ms", "supervisor.step_timeout_ms"),
    ("percepts.toml", "percept.history.low_pass.share", "percept.history.low_pass.alpha"),
    ("percepts.toml", "percept.history.own", "percept.history.plugin"),
    ("percepts.toml", "percept.kernel.own", "percept.kernel.plugin"),
    ("percepts.toml", "percept.kernel.nearest.of", "percept.kernel.nearest.space"),
    ("percepts.toml", "percept.kernel.range.of", "percept.kernel.range.component"),
    ("percepts.toml", "percept.kernel.region.minimum_m", "percept.kernel.region.min_m"),
    ("percepts.toml", "percept.kernel.region.maximum_m", "percept.kernel.region.max_m"),
    ("percepts.toml", "belief.distance.measure.own", "belief.distance.measure.plugin"),
    ("percepts.toml", "belief.cull.when.own", "belief.cull.when.plugin"),
    ("perspective.toml", "occluders.most", "occluders.max_count"),
    ("perspective.toml", "occluders.same_within_m", "occluders.association_distance_m"),
    ("perspective.toml", "occluders.gone_after_ms", "occluders.remove_after_ms"),
    ("perspective.toml", "robot.field", "robot.field_of_view"),
    ("perspective.toml", "resource", "ownership"),
    ("perspective.toml", "ownership.by", "ownership.rule"),
    ("perspective.toml", "ownership.rule = told", "ownership.rule = regions"),
    ("perspective.toml", "ownership.told", "ownership.regions"),
    ("perspective.toml", "ownership.gap_ratio", "ownership.min_gap_ratio"),
    ("motor.toml", "joint.velocity_rad_s", "joint.max_velocity_rad_s"),
    ("motor.toml", "joint.acceleration_rad_s2", "joint.max_acceleration_rad_s2"),
    ("a lesson", "noise.position_sigma_m", "noise.position_sd_m"),
    ("a lesson", "laying", "table_timing"),
    ("a campaign", "percepts.chance", "percepts.probability"),
    ("a campaign", "percepts.from_s", "percepts.start_s"),
    ("a campaign", "percepts.for_s", "percepts.duration_s"),
    ("a campaign", "percepts.by_ms", "percepts.delay_ms"),
    ("a campaign", "processes.for_s", "processes.duration_s"),
];

/// The last part of a path: the name of the key or the value.
fn name(path: &str) -> &str {
    path.rsplit(['.', ' ']).next().unwrap_or(path)
}

/// Explains a message about an unknown name that an older version had; `None` for any other message.
///
/// The message lists the names that are valid at its place. A successor that is not among them belongs to another
/// table.
pub(crate) fn explain(message: &str) -> Option<String> {
    let message = message.trim_end();
    let (unknown, expected): (Vec<&str>, Vec<&str>) =
        if message.starts_with("unknown field") || message.starts_with("unknown variant") {
            let mut quoted = message.split('`').skip(1).step_by(2);
            (quoted.next().into_iter().collect(), quoted.collect())
        } else {
            // The TOML parser itself checks the keys of an enum's variant.
            let (unknown, expected) =
                message.strip_prefix("unexpected keys in table: ")?.split_once(", available keys: ")?;
            (unknown.split(", ").collect(), expected.split(", ").collect())
        };
    let (_, old, new) =
        RENAMED.iter().find(|(_, old, new)| unknown.contains(&name(old)) && expected.contains(&name(new)))?;
    let (old, new) = (name(old), name(new));
    Some(format!("`{old}` was renamed to `{new}`: write `{new}`"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::campaign::Campaign;
    use crate::leo::Leo;
    use crate::lesson::Lesson;
    use crate::percepts::Percepts;
    use crate::perspective::Perspective;
    use crate::robot::builtin;
    use crate::{ConfigError, motor, parse};

    const CAMPAIGN: &str = include_str!("../../../config/campaigns/a_bad_day.toml");
    const TASK_1: &str = include_str!("../../../config/lessons/task1.toml");

    /// Uses of the keys that are absent from the built-in `percepts.toml`.
    const MORE_PERCEPTS: &str = r#"
        [[percept]]
        name = "raised"
        parent = "position"
        role = "neither"
        decay_per_s = 0.2
        history = { plugin = "h" }
        kernel = { range = { component = "z_m", from = 0.1 } }
        [[belief.distance]]
        percept = "orientation"
        measure = { plugin = "d" }
        weight = 1.0
        [[belief.cull]]
        when = { plugin = "c" }
    "#;

    /// A text of this version with every renamed key, without comments between its lines.
    fn sample(file: &str) -> String {
        let text = match file {
            "leo.toml" => builtin::LEO.to_owned(),
            "percepts.toml" => {
                builtin::PERCEPTS.replace("kernel = \"orientation\"", "kernel = { plugin = \"k\" }")
                    + MORE_PERCEPTS
            }
            "perspective.toml" => builtin::PERSPECTIVE.to_owned(),
            "motor.toml" => builtin::MOTOR.to_owned(),
            "a lesson" => TASK_1.to_owned(),
            "a campaign" => CAMPAIGN.to_owned(),
            other => panic!("{other} is no kind of file"),
        };
        text.lines().filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect()
    }

    fn read(file: &str, text: &str) -> Result<(), ConfigError> {
        let path = Path::new("x.toml");
        match file {
            "leo.toml" => parse::<Leo>(text, path).map(drop),
            "percepts.toml" => Percepts::parse(text, path).map(drop),
            "perspective.toml" => parse::<Perspective>(text, path).map(drop),
            "motor.toml" => motor::parse(text, path).map(drop),
            "a lesson" => Lesson::parse(text, path).map(drop),
            _ => parse::<Campaign>(text, path).map(drop),
        }
    }

    /// Where the name at the end of `path` begins in a text that has it, and the name in that text.
    fn place<'a>(text: &'a str, path: &str) -> (usize, &'a str) {
        let (name, table) = (name(path), path.rsplit('.').nth(1).unwrap_or_default());
        if let Some((key, _)) = path.split_once(" = ") {
            let start = format!("\n{} = \"", super::name(key));
            let at = text.find(&start).unwrap_or_else(|| panic!("{path}")) + start.len();
            return (at, text[at..].split('"').next().unwrap());
        }
        let uses = [format!("\n[{name}]\n"), format!("\n{name} = "), format!("{table} = {{ {name} = ")];
        let mut found = uses.iter().filter_map(|found| Some((text.find(found)?, found)));
        // The key of an inline table is more specific than a line of the same name.
        let (at, found) = found.next_back().unwrap_or_else(|| panic!("{path} is no key of this version"));
        let at = at + found.rfind(name).unwrap();
        (at, &text[at..at + name.len()])
    }

    fn with(text: &str, path: &str, new: &str) -> String {
        let (at, found) = place(text, path);
        let (before, after) = (&text[..at], &text[at + found.len()..]);
        format!("{before}{new}{after}")
    }

    #[test]
    fn an_old_name_is_refused_with_its_line_and_successor() {
        for (file, old, new) in RENAMED {
            let (text, old_name, new_name) = (sample(file), name(old), name(new));
            let line = text[..place(&text, new).0].matches('\n').count() + 1;
            let error = read(file, &with(&text, new, old_name)).expect_err(old).to_string();
            assert!(error.starts_with(&format!("x.toml:{line}:")), "{old}: {error}");
            let words = format!(": `{old_name}` was renamed to `{new_name}`: write `{new_name}`");
            assert!(error.ends_with(&words), "{old}: {error}");
        }
    }

    #[test]
    fn every_successor_is_a_name_of_this_version() {
        for (file, _, new) in RENAMED {
            let text = with(&sample(file), new, name(new));
            read(file, &text).unwrap_or_else(|error| panic!("{new}: {error}"));
        }
    }

    #[test]
    fn an_old_name_elsewhere_is_no_renamed_one() {
        let said = read("leo.toml", &builtin::LEO.replacen("\nrate_hz = ", "\nlaying = ", 1)).unwrap_err();
        assert!(said.to_string().contains("unknown field `laying`"), "{said}");
    }
}

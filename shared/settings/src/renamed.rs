//! The names of older versions, each with its successor. A file with an old name is rejected.

/// Kind of file, path of the old name, and path of the new one. `key = value` renames a value.
pub const RENAMED: [(&str, &str, &str); 43] = [
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

/// The old and the new name in the reason of an error about a renamed name; `None` for any other reason.
#[must_use]
pub fn renaming(reason: &str) -> Option<(&str, &str)> {
    let (old, rest) = reason.strip_prefix('`')?.split_once("` was renamed to `")?;
    Some((old, rest.split('`').next()?))
}

/// Explains a message about an unknown name that an older version had; `None` for any other message.
///
/// Names in different tables may be equal. So a rename applies only if the message lists the new name as valid at its
/// place.
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

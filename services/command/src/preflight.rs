//! Checks before processes are started: a configuration that cannot work is refused with one clear error.

use std::path::Path;

use config::Robot;
use config::leo::Leo;
use config::lesson::Lesson;

use crate::body;
use crate::failure::CommandError;
use crate::mock_bus::configured_faults;

/// Refuses a configuration with which a process could only die repeatedly. `config` is the robot's `leo.toml`. Checks
///
/// - that the body has the joints of the servos,
/// - that the traces can be read,
/// - that the configured faults of the mock buses are valid,
/// - that the perspectives can be created (this program has no plug-ins).
pub(crate) fn check_can_start(robot: &Robot, config: Option<&Path>) -> Result<(), CommandError> {
    body::check(robot, config).map_err(CommandError::usage)?;
    sensor_process::check_traces(&robot.leo.sensor.source).map_err(CommandError::usage)?;
    configured_faults(robot, config)?;
    let belief = &robot.leo.belief;
    // Only whether it can be constructed matters, so a capacity of one suffices.
    belief_process::Believer::new(
        &robot.percepts,
        &robot.perspective,
        belief.partners,
        belief.depth.get(),
        1,
    )
    .map_err(CommandError::usage)?;
    Ok(())
}

/// Refuses an invalid link configuration. Separate, because a lesson is taught without the link and its keys.
pub(crate) fn check_link(link: &config::leo::Link) -> Result<(), CommandError> {
    link_process::check(link).map_err(CommandError::usage)
}

/// As [`check_can_start`], and refuses a robot without a simulator.
pub(crate) fn check_can_teach(robot: &Robot, config: Option<&Path>) -> Result<(), CommandError> {
    check_can_start(robot, config)?;
    simulator_source(robot).map(drop)
}

/// The number of the simulator among the robot's sources.
pub(crate) fn simulator_source(robot: &Robot) -> Result<usize, CommandError> {
    let simulator = robot.leo.sensor.simulator().map(usize::from);
    simulator.ok_or_else(|| {
        CommandError::usage(
            "a lesson needs the simulator, and no [[sensor.source]] of leo.toml is of the kind \
             \"simulator\"",
        )
    })
}

/// Warns about settings that a lesson needs and the configuration lacks. The lesson is taught nevertheless.
pub(crate) fn warn_missing_needs(file: &Path, lesson: &Lesson, leo: &Leo) {
    if let Some(lacking) = lesson.needs.lacking(leo) {
        let file = file.display();
        tracing::warn!("{file}: this lesson needs {lacking} in leo.toml (--config FILE)");
    }
}

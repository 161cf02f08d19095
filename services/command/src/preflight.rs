//! Checks before processes are started: a configuration that cannot work is refused with one clear error.

use std::path::Path;

use config::Robot;
use config::leo::Leo as Settings;
use config::lesson::Lesson;

use crate::body;
use crate::failure::CommandError;

/// Refuses a configuration with which a process could only die repeatedly. Checks the body against the servos, the
/// traces, the mock buses' faults and the program's own belief plug-ins. `config` is the robot's `leo.toml`.
pub(crate) fn check_can_start(robot: &Robot, config: Option<&Path>) -> Result<(), CommandError> {
    body::check(robot, config).map_err(CommandError::usage)?;
    sensor_process::check_traces(&robot.leo.sensor.source).map_err(CommandError::usage)?;
    mock_bus_process::Faults::configured(&robot.leo.mock_bus, &robot.motor)
        .map_err(|bad| CommandError::usage(format!("leo.toml: `faults` of [mock_bus]: {bad}")))?;
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

/// Refuses an invalid link configuration.
pub(crate) fn check_link(link: &config::leo::Link) -> Result<(), CommandError> {
    link_process::check(link).map_err(CommandError::usage)
}

/// Refuses to play a lesson to a robot without a simulator source. Returns the number of that source.
pub(crate) fn check_can_teach(robot: &Robot, config: Option<&Path>) -> Result<usize, CommandError> {
    check_can_start(robot, config)?;
    let simulator = robot.leo.sensor.simulator().map(usize::from);
    simulator.ok_or_else(|| {
        CommandError::usage(
            "a lesson needs the simulator, and no [[sensor.source]] of leo.toml is of the kind \
             \"simulator\"",
        )
    })
}

/// Warns about settings that a lesson needs and the configuration lacks. The lesson is taught nevertheless.
pub(crate) fn warn_missing_needs(file: &Path, lesson: &Lesson, settings: &Settings) {
    if let Some(lacking) = lesson.needs.lacking(settings) {
        let file = file.display();
        tracing::warn!("{file}: this lesson needs {lacking} in leo.toml (--config FILE)");
    }
}

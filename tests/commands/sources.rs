//! Commands with other sensory sources than the simulator alone.

use crate::house::{read, short_lesson, tell, write};

/// The configuration with one more source, and with another in place of the simulator.
fn with_camera() -> String {
    read("config/leo.toml")
        + "\n[[sensor.source]]\nname = \"camera\"\nkind = \"external\"\nrate_hz = 30.0\nposition_sd_m = 0.02\n"
}

fn without_simulator() -> String {
    read("config/leo.toml").replace("\nkind = \"simulator\"", "\nkind = \"external\"")
}

#[test]
fn a_source_from_outside_changes_nothing_in_simulated_time() {
    let files = tempfile::tempdir().expect("a folder");
    let lesson = write(&files, "lesson.toml", &short_lesson());
    let config = write(&files, "leo.toml", &with_camera());
    let alone = tell(&["teach", &lesson, "--json"]);
    let together = tell(&["teach", &lesson, "--json", "--config", &config]);
    assert_eq!((alone.status, together.status), (Some(0), Some(0)), "{together:?}");
    assert_eq!((alone.err.as_str(), together.err.as_str()), ("", ""));
    assert_eq!(alone.out, together.out);
    assert!(alone.out.contains("demonstration"), "{alone:?}");
}

#[test]
fn without_a_simulator_among_the_sources_none_is_started_and_no_lesson_is_played() {
    let files = tempfile::tempdir().expect("a folder");
    let config = write(&files, "leo.toml", &without_simulator());
    let refused = tell(&["teach", "config/lessons/task1.toml", "--config", &config]);
    assert_eq!((refused.status, refused.out.as_str()), (Some(2), ""));
    assert!(refused.err.contains("kind \"simulator\""), "{refused:?}");
    let ran = tell(&["-v", "run", "--for", "1", "--config", &config]);
    assert_eq!(ran.status, Some(0), "{ran:?}");
    assert!(ran.err.contains("the robot runs") && ran.err.contains("processes=6"), "{ran:?}");
}

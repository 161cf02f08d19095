//! The commands on the command line, with the real executable.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod acts;
mod believe;
mod budgets;
mod check;
mod configuration;
mod conflict;
mod emergency;
mod figure_4;
mod full_disk;
mod harness;
mod learn;
mod recordings;
mod replays;
mod snippets;
mod sources;
mod state;
mod study;
mod tasks;
mod terminal;
#[path = "../sources/venv.rs"]
mod venv;
mod viewers;
mod wrong;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread;

use rustix::process::{Resource, Rlimit, Signal, getrlimit, getuid, setrlimit};

use harness::{CommandOutput, Leo, leo, public_executable, read, run_leo, short_lesson, wait_until, write};

const TASK_1: &str = "config/lessons/task1.toml";
/// An ordinary user without special groups: `nobody`.
const NOBODY: u32 = 65534;
/// A sound line of a store of version 5: its check sum, the version and an empty record.
const VERSION_5: &str = "aa8002c50ba25c46 5 {}\n";

/// Checks an error: one line on standard error, nothing on standard output.
fn assert_refused(output: &CommandOutput, status: i32, words: &[&str]) {
    assert_eq!(output.status, Some(status), "{output:?}");
    assert_eq!(output.out, "", "{output:?}");
    assert_eq!(output.err.lines().filter(|line| line.starts_with("leo: ")).count(), 1, "{output:?}");
    assert_eq!(output.err.lines().count(), 1, "{output:?}");
    for word in words {
        assert!(output.err.contains(word), "{word} is not in {output:?}");
    }
}

#[test]
fn perspective_taking_decides_the_rule_reproducibly() {
    let files = tempfile::tempdir().expect("a folder");
    // Deeper nested perspectives do not affect learning.
    let deeper = read("config/leo.toml").replace("depth = 1 ", "depth = 2 ");
    assert!(deeper.contains("depth = 2 "));
    let nested = write(&files, "leo.toml", &deeper);
    let play = |arguments: &[&str]| {
        let arguments: Vec<String> = arguments.iter().map(|argument| (*argument).to_owned()).collect();
        thread::spawn(move || run_leo(&arguments.iter().map(String::as_str).collect::<Vec<_>>()))
    };
    let runs = [
        play(&["teach", TASK_1, "--json"]),
        play(&["teach", TASK_1, "--json", "--config", &nested]),
        play(&["teach", TASK_1, "--json", "--perspective", "human,robot"]),
        play(&["teach", TASK_1, "--json", "--perspective", "robot"]),
    ];
    let [one, deep, same, robot] = runs.map(|run| run.join().expect("ends"));
    for output in [&one, &deep, &same, &robot] {
        assert_eq!(output.status, Some(0), "{output:?}");
        assert_eq!(output.err, "");
    }
    assert_eq!(one.out, same.out);
    assert_eq!(one.out, deep.out);
    let learned = |output: &CommandOutput| {
        let lessons: serde_json::Value = serde_json::from_str(&output.out).expect("is JSON");
        let task = lessons.pointer("/0/report/tasks/0").expect("a task").clone();
        let text = |pointer: &str| task.pointer(pointer).and_then(|value| value.as_str()).map(str::to_owned);
        let done = task.pointer("/performances/0/done").and_then(|done| done.as_array()).expect("a list");
        let blue = done.iter().filter(|step| step.as_str().is_some_and(|step| step.contains("blue"))).count();
        (text("/rule/name"), text("/performances/0/result"), blue)
    };
    assert_eq!(learned(&one), (Some("all".into()), Some("filled 5 of 5".into()), 2));
    assert_eq!(learned(&robot), (Some("all but blue".into()), Some("filled 3 of 3".into()), 0));
}

#[test]
fn no_rule_is_written_in_the_sources_that_learn() {
    let mut lines = 0;
    let mut folders: Vec<PathBuf> = ["shared/tasks/src", "services/learner/src"]
        .map(|folder| Path::new(env!("CARGO_MANIFEST_DIR")).join(folder))
        .into();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("reads").flatten() {
            let path = entry.path();
            if path.is_dir() && !path.ends_with("tests") {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") && !path.ends_with("tests.rs") {
                let text = fs::read_to_string(&path).expect("reads");
                for line in text.split("#[cfg(test)]").next().expect("code").lines() {
                    let code = line.split("//").next().expect("code").to_lowercase();
                    lines += 1;
                    for name in [
                        "\"red",
                        "\"green",
                        "\"blue",
                        "\"yellow",
                        "all but",
                        "preference",
                        "\"square",
                        "\"triangle",
                    ] {
                        assert!(!code.contains(name), "{name} in {}: {line}", path.display());
                    }
                }
            }
        }
    }
    assert!(lines > 1000, "{lines} lines were seen");
}

#[test]
fn a_wrong_configuration_is_one_error_that_names_the_place() {
    let files = tempfile::tempdir().expect("a folder");
    let right = read("config/leo.toml");
    for (from, to, word) in [
        ("partners = 1", "partnerz = 1", "did you mean `partners`?"),
        ("rate_hz = 250.0", "rate_khz = 0.25", "did you mean `rate_hz`?"),
        ("rate_hz = 250.0", "rate_hz = -250.0", "-250"),
        ("max_objects = 64 ", "max_objects = 5000 ", "4096"),
        ("partners = 1", "", "missing field `partners`"),
        ("on_conflict = \"human\"", "on_conflict = \"humna\"", "did you mean `human`?"),
        ("max_objects = 64 ", "max_objects = ", "a value"),
        ("listen = []", "listen = [\"tcp/0.0.0.0:7447\"]", "is no endpoint"),
        ("side = \"off\"", "side = \"robot\"", "needs `listen` or `connect`"),
        ("remote_processes = [", "remote_processes = [\"motor\", ", "unknown value `motor`"),
        ("topics = []", "topics = [\"observations\"]", "not a topic that can be sent"),
    ] {
        let wrong = right.replacen(from, to, 1);
        assert_ne!(wrong, right, "{from}");
        let file = write(&files, "leo.toml", &wrong);
        for command in [vec!["run"], vec!["teach", TASK_1], vec!["check"]] {
            let output = run_leo(&[command.as_slice(), &["--config", &file]].concat());
            assert_refused(&output, 2, &["leo.toml:", word]);
        }
    }
    let linked = right.replacen("side = \"off\"", "side = \"robot\"", 1).replacen(
        "listen = []",
        "listen = [\"quic/0.0.0.0:7447\"]",
        1,
    );
    let file = write(&files, "leo.toml", &linked);
    assert_refused(
        &run_leo(&["run", "--config", &file]),
        2,
        &["leo.toml:", "`ca_certificate`, `certificate`"],
    );
    assert_refused(&run_leo(&["check", "--config", "/nowhere/leo.toml"]), 2, &["/nowhere/leo.toml"]);

    let files = tempfile::tempdir().expect("a folder");
    let file = write(&files, "leo.toml", &right);
    for (name, wrong, words) in wrong_bodies() {
        let at = write(&files, name, &wrong);
        for command in [vec!["run"], vec!["teach", TASK_1], vec!["study"], vec!["check"]] {
            let output = run_leo(&[command.as_slice(), &["--config", &file]].concat());
            assert_refused(&output, 2, words);
        }
        fs::remove_file(at).expect("removes");
    }
}

/// Files beside `leo.toml` that are inconsistent with the built-in ones, and the expected messages.
fn wrong_bodies() -> Vec<(&'static str, String, &'static [&'static str])> {
    let changed = |file: &str, from: &str, to: &str| {
        let right = read(&format!("config/{file}"));
        let wrong = right.replacen(from, to, 1);
        assert_ne!(wrong, right, "{from}");
        wrong
    };
    let motor = read("config/motor.toml");
    let line = motor.lines().position(|line| line == "max_rad = 0.8");
    assert_eq!(line, Some(57), "the limits of the first joint");
    // Every servo on one bus.
    let mut id = 0;
    let crowded = motor.lines().map(|line| {
        id += u32::from(line.starts_with("id = "));
        match line.split(" = ").next() {
            Some("bus") => "bus = \"torso\"\n".to_owned(),
            Some("id") => format!("id = {id}\n"),
            _ => format!("{line}\n"),
        }
    });
    let crowded = crowded.collect();
    assert_eq!(id, 65);
    vec![
        (
            "motor.toml",
            changed("motor.toml", "name = \"torso_yaw_joint\"", "name = \"waist_yaw_joint\""),
            &["the built-in leo.urdf:", "joint `torso_yaw_joint`", "add it to motor.toml"],
        ),
        (
            "leo.urdf",
            changed("leo.urdf", "<joint name=\"torso_yaw_joint\"", "<joint name=\"waist_yaw_joint\""),
            &["/leo.urdf:302:3: ", "joint `waist_yaw_joint`", "add it to motor.toml"],
        ),
        (
            "motor.toml",
            changed("motor.toml", "max_rad = 0.8\n", "max_rad = 0.75\n"),
            &[
                "/motor.toml:58:11: joint `torso_yaw_joint`: `max_rad` is 0.75, and its `upper` is 0.8",
                "same",
            ],
        ),
        (
            "leo.urdf",
            changed("leo.urdf", "lower=\"-0.8\"", "lower=\"-0.9\""),
            &[
                "motor.toml:57:11: joint `torso_yaw_joint`: `min_rad` is -0.8",
                "`lower` is -0.9 in",
                "/leo.urdf",
            ],
        ),
        (
            "leo.urdf",
            changed("leo.urdf", "velocity=\"", "velocity=\"1"),
            &["motor.toml:59:22: joint `torso_yaw_joint`: `max_velocity_rad_s` is ", "`velocity` is 1"],
        ),
        ("leo.urdf", "<robot name=\"leo\">\n<joint\n".to_owned(), &["/leo.urdf:2:1: not a URDF: "]),
        (
            "leo.urdf",
            changed("leo.urdf", "lower=\"-0.8\"", "lower=\"low\""),
            &[
                "/leo.urdf:302:149: joint `torso_yaw_joint`: `<limit>`: `lower` is \"low\"",
                "not a finite number",
            ],
        ),
        (
            "leo.urdf",
            changed("leo.urdf", "<origin xyz=\"0 0 -0.02\"/>", "<origin xyz=\"nan 0 -0.02\"/>"),
            &[
                "/leo.urdf:302:105: joint `torso_yaw_joint`: `<origin>`: `xyz` is \"nan",
                "not a finite number",
            ],
        ),
        (
            "leo.urdf",
            changed("leo.urdf", "</robot>", "<joint name=\"torso_yaw_joint\" type=\"fixed\"/></robot>"),
            &["/leo.urdf:", "joint `torso_yaw_joint` is there twice; the first is in line 302"],
        ),
        ("leo.urdf", String::new(), &["/leo.urdf:1:1: not a URDF: ", "correct it, or remove it"]),
        ("motor.toml", crowded, &["/motor.toml: bus `torso` has 65 servos", "spread them over more buses"]),
    ]
}

#[test]
fn a_wrong_lesson_is_one_error_that_names_the_place() {
    let files = tempfile::tempdir().expect("a folder");
    let wrong = short_lesson().replacen("into = \"red\"", "into = \"rde\"", 1);
    let file = write(&files, "wrong.toml", &wrong);
    for file in [file.as_str(), "/nowhere/wrong.toml"] {
        assert_refused(&run_leo(&["teach", file]), 2, &["wrong.toml"]);
        assert_refused(&run_leo(&["run", "--lesson", file]), 2, &["wrong.toml"]);
        // One invalid lesson among valid ones: none is played.
        assert_refused(&run_leo(&["teach", TASK_1, file]), 2, &["wrong.toml"]);
    }
}

#[test]
fn bad_usage_is_reported_with_a_remedy() {
    let cases: [(&[&str], i32, &str); 9] = [
        (&["run", "--for", "-3"], 2, "above 0"),
        (&["run", "--for", "NaN"], 2, "above 0"),
        (&["bench", "--seconds", "0"], 2, "above 0"),
        (&["frob"], 2, "--help"),
        (&["teach"], 2, "<LESSON>"),
        (&["teach", TASK_1, "--perspective", "human"], 2, "--perspective human,robot"),
        (&["run", "--domain", "/tmp/leo-x"], 2, "/dev/shm/leo-NAME"),
        (&["run", "--domain", "/dev/shm/leo-a_b"], 2, "letters, digits and hyphens"),
        (&["top", "--domain", "/dev/shm/leo-nobody-is-here"], 2, "leo run"),
    ];
    for (arguments, status, word) in cases {
        let output = run_leo(arguments);
        assert_eq!((output.status, output.out.as_str()), (Some(status), ""), "{arguments:?} {output:?}");
        assert!(output.err.contains(word), "{arguments:?} {output:?}");
    }
}

#[test]
fn an_unavailable_memory_is_refused_before_anything_starts() {
    let (mut homeless, files) = leo(&["run", "--for", "1"]);
    homeless.env_remove("XDG_STATE_HOME");
    assert_refused(&Leo::start(homeless, files).end(), 2, &["HOME", "XDG_STATE_HOME"]);

    let (mut blocked, files) = leo(&["run", "--for", "1"]);
    let no_folder = write(&files, "no-folder", "");
    blocked.env("XDG_STATE_HOME", &no_folder);
    assert_refused(&Leo::start(blocked, files).end(), 2, &["no-folder", "XDG_STATE_HOME"]);

    for (name, bytes, word) in
        [("learned.redb", "a database", "before 0.1"), ("learned.store", VERSION_5, "version 5")]
    {
        let (mut other, files) = leo(&["run", "--for", "1"]);
        let folder = files.path().join("leo");
        fs::create_dir(&folder).expect("makes");
        fs::write(folder.join(name), bytes).expect("writes");
        other.env("XDG_STATE_HOME", files.path());
        assert_refused(&Leo::start(other, files).end(), 2, &[name, word]);
    }
}

#[test]
fn a_robot_with_a_damaged_store_starts_and_reports_losses() {
    let state = tempfile::tempdir().expect("a folder");
    let folder = state.path().join("leo");
    fs::create_dir(&folder).expect("makes");
    fs::write(folder.join("learned.store"), "").expect("writes");
    let (mut damaged, files) = leo(&["run", "--for", "1"]);
    damaged.env("XDG_STATE_HOME", state.path());
    let output = Leo::start(damaged, files).end();
    assert_eq!(fs::read(folder.join("learned.damaged.store")).expect("is kept"), b"");
    assert_eq!(output.status, Some(0), "{output:?}");
    for word in [
        "learned.store",
        "learned.damaged.store",
        "nothing of what was learned can be read",
        "My memory was damaged: all of it is lost",
    ] {
        assert!(output.err.contains(word) || output.out.contains(word), "{word}: {output:?}");
    }
}

#[test]
fn every_command_has_help_with_an_example() {
    let commands = [
        "",
        "run",
        "teach",
        "study",
        "tasks",
        "believe",
        "evaluate",
        "learn",
        "record",
        "view",
        "replay",
        "top",
        "emergency-stop",
        "bus",
        "check",
        "bench",
        "mock-bus",
    ];
    for command in commands {
        let arguments: Vec<&str> = [command, "--help"].into_iter().filter(|word| !word.is_empty()).collect();
        let output = run_leo(&arguments);
        assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{command}");
        let has_example =
            ["Example", "Examples"].iter().any(|word| output.out.contains(&format!("{word}:\n  leo ")));
        assert!(has_example, "{}", output.out);
    }
}

#[test]
fn a_closed_standard_output_causes_no_panic() {
    for arguments in [["check", "--json", "--seconds", "0"].as_slice(), &["--help"], &["run", "--for", "0.5"]]
    {
        let (mut command, _files) = leo(arguments);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
        drop(child.stdout.take());
        let ended = child.wait_with_output().expect("ends");
        let err = String::from_utf8_lossy(&ended.stderr);
        assert!(ended.status.code().is_some_and(|code| code < 2), "{arguments:?} {ended:?}");
        assert!(!err.contains("panicked") && err.lines().count() <= 2, "{err}");
    }
}

#[test]
fn a_dead_or_hung_process_in_lockstep_ends_the_lesson() {
    let files = tempfile::tempdir().expect("a folder");
    let config = read("config/leo.toml");
    let hasty = config.replace("step_timeout_ms = 10000.0", "step_timeout_ms = 1500.0");
    let config =
        write(&files, "leo.toml", &hasty.replace("ready_timeout_ms = 10000.0", "ready_timeout_ms = 8000.0"));
    assert_ne!(read(&config), read("config/leo.toml"));
    for (process, signal) in [("belief", Signal::KILL), ("sensor", Signal::STOP)] {
        let (command, folder) = leo(&["teach", TASK_1, "--config", &config]);
        let lesson = Leo::start(command, folder);
        lesson.signal(process, signal);
        assert_refused(&lesson.end(), 1, &[process]);
    }
}

#[test]
fn an_overflow_is_reported_once_and_the_robot_continues() {
    let files = tempfile::tempdir().expect("a folder");
    let small = read("config/leo.toml").replace("max_objects = 64 ", "max_objects = 8 ");
    let config = write(&files, "leo.toml", &small);
    assert_ne!(read(&config), read("config/leo.toml"));
    let (command, folder) = leo(&["run", "--config", &config]);
    let run = Leo::start(command, folder);
    let words = "there is more than I have room for, and some of it is left out: raise \
                 `buffers.max_objects` in leo.toml";
    assert!(wait_until(|| run.said("out").contains(words)), "{}\n{}", run.said("out"), run.said("err"));
    // The lesson continues long after that.
    assert!(wait_until(|| run.said("out").matches("teacher:").count() >= 2), "{}", run.said("out"));
    run.interrupt();
    let output = run.end();
    assert_eq!(output.status, Some(0), "{output:?}");
    assert_eq!(output.out.matches(words).count(), 1, "{output:?}");
}

#[test]
fn ctrl_c_ends_a_run_and_a_lesson_and_removes_all_files() {
    let (command, files) = leo(&["run"]);
    let run = Leo::start(command, files);
    assert!(wait_until(|| run.said("out").contains("teacher:")), "{}", run.said("err"));
    run.interrupt();
    let output = run.end();
    assert_eq!(output.status, Some(0), "{output:?}");

    let (command, files) = leo(&["teach", TASK_1]);
    let lesson = Leo::start(command, files);
    assert!(wait_until(|| lesson.processes().len() == 6), "{}", lesson.said("err"));
    lesson.interrupt();
    let output = lesson.end();
    assert_eq!((output.status, output.out.as_str()), (Some(1), ""), "{output:?}");
    assert!(!output.err.contains("panicked") && output.err.starts_with("leo: "), "{output:?}");
}

#[test]
fn the_first_signal_ends_a_lesson_that_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let recording = folder.path().join("lesson.mcap");
    let (command, files) = leo(&["teach", TASK_1, "--record", &recording.display().to_string()]);
    let lesson = Leo::start(command, files);
    // The processes take their turns one after the other, each faster than anything is polled.
    let is_running = || fs::metadata(&recording).is_ok_and(|file| file.len() > 1 << 20);
    assert!(wait_until(is_running), "{}", lesson.said("err"));
    lesson.interrupt();
    let output = lesson.end();
    assert_eq!((output.status, output.out.as_str()), (Some(1), ""), "{output:?}");
    assert!(output.err.contains("interrupted"), "{output:?}");
}

#[test]
fn lessons_without_performances_end_by_themselves_two_at_once() {
    let files = tempfile::tempdir().expect("a folder");
    let lesson = write(&files, "short.toml", &short_lesson());
    let start = || {
        let (command, files) = leo(&["run", "--lesson", &lesson]);
        Leo::start(command, files)
    };
    for robot in [start(), start()] {
        let output = robot.end();
        assert_eq!(output.status, Some(0), "{output:?}");
        assert!(output.out.contains("ALL (as the teacher saw it)"), "{output:?}");
    }
}

#[test]
fn a_full_shared_memory_is_refused() {
    if !getuid().is_root() {
        skip::skip("only root can mount a small /dev/shm");
        return;
    }
    for size in ["4k", "1m"] {
        let (command, files) = leo(&[]);
        let script = format!(
            "mount -t tmpfs -o size={size} tmpfs /dev/shm || exit 77; \"$0\" run --for 1; status=$?; ls /dev/shm; exit \
             $status"
        );
        let mut inside = std::process::Command::new("unshare");
        inside.args(["-m", "sh", "-c", &script]).arg(command.get_program());
        inside.env("XDG_STATE_HOME", files.path()).stdin(Stdio::null());
        let output = Leo::start(inside, files).end();
        if output.status == Some(77) || output.err.contains("unshare") {
            skip::skip(format_args!("no mount namespace of its own here: {}", output.err));
            return;
        }
        assert_refused(&output, 1, &["/dev/shm", "needed", "remount"]);
    }
}

#[test]
fn an_ordinary_user_gets_the_robot_and_one_warning_about_rights() {
    if !getuid().is_root() {
        skip::skip("only root can become another user");
        return;
    }
    // Root has the rights whatever the limits are.
    for resource in [Resource::Rtprio, Resource::Memlock] {
        let maximum = getrlimit(resource).maximum;
        setrlimit(resource, Rlimit { current: Some(0), maximum }).expect("lowers");
    }
    let files = tempfile::tempdir().expect("a folder");
    let executable = public_executable(&files);
    let lesson = write(&files, "short.toml", &short_lesson());
    let as_nobody = |arguments: &[&str]| {
        let (ours, folder) = leo(arguments);
        let mut command = std::process::Command::new("setpriv");
        command.args(["--reuid", &NOBODY.to_string(), "--regid", &NOBODY.to_string(), "--clear-groups"]);
        command.arg(&executable).args(ours.get_args()).current_dir(files.path());
        command.env("XDG_STATE_HOME", folder.path()).stdin(Stdio::null());
        Leo::start(command, folder)
    };
    let taught = as_nobody(&["teach", &lesson]).end();
    assert_eq!((taught.status, taught.err.as_str()), (Some(0), ""), "{taught:?}");
    assert!(taught.out.contains("rule chosen"), "{taught:?}");
    let output = as_nobody(&["run", "--for", "3"]).end();
    assert_eq!(output.status, Some(0), "{output:?}");
    let warnings: Vec<&str> = output.err.lines().filter(|line| line.contains("not granted")).collect();
    let [warning] = warnings.as_slice() else { panic!("{output:?}") };
    for word in ["rtprio", "LimitRTPRIO", "memlock", "LimitMEMLOCK"] {
        assert!(warning.contains(word), "{warning}");
    }
}

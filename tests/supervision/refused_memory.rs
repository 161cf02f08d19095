//! A refused memory allocation: the store keeps what it acknowledged, and the robot survives its recorder.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rustix::process::Signal;

use super::robot::{Robot, domain, is_alive, leo, wait_until};

/// Allocations of each command that are refused, one in each run, spread over all of them.
const REFUSED: u64 = 12;

/// The library that refuses an allocation. `None` if there is no C compiler.
struct Refuser {
    files: tempfile::TempDir,
}

impl Refuser {
    fn or_skip() -> Option<Self> {
        let files = tempfile::tempdir().expect("a folder");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/supervision/refuse_memory.c");
        let mut compiler = Command::new("cc");
        compiler.args(["-shared", "-fPIC", "-o"]).arg(files.path().join("refuse.so")).arg(source);
        let is_compiled = compiler.status().is_ok_and(|status| status.success());
        if !is_compiled {
            skip::skip("a C compiler is needed to refuse allocations");
        }
        is_compiled.then_some(Self { files })
    }

    fn report(&self) -> PathBuf {
        self.files.path().join("allocations")
    }

    /// The same command with its `number`-th allocation refused; none for zero.
    fn refuse(&self, number: u64, mut command: Command) -> Command {
        command.env("LD_PRELOAD", self.files.path().join("refuse.so"));
        command.env("LEO_REFUSED_ALLOCATION", number.to_string()).env("LEO_ALLOCATIONS", self.report());
        command.stdin(Stdio::null());
        command
    }

    /// The numbers of allocations to refuse, of a command that makes as many as the last one did.
    fn numbers(&self) -> Vec<u64> {
        let total: u64 = fs::read_to_string(self.report()).expect("it ended").parse().expect("a number");
        assert!(total > REFUSED, "only {total} allocations");
        (1..=REFUSED).map(|part| total * part / REFUSED).collect()
    }
}

/// An export of one task, learned from one example in which a red square was filled.
fn export(name: &str) -> String {
    let object = |id: u32, colour: &str, filled: bool| {
        serde_json::json!({ "id": id, "features": { "colour": colour, "shape": "square" },
            "states": { "filled": filled }, "position_m": [0.4, 0.1, 0.03] })
    };
    let snapshot = |filled: bool| {
        serde_json::json!({ "at_ns": 1, "frame_position_m": [0.0, 0.0, 0.0],
            "frame_orientation_xyzw": [0.0, 0.0, 0.0, 1.0],
            "objects": [object(1, "red", filled), object(2, "blue", false)] })
    };
    let view = serde_json::json!({ "perspective": 0, "before": snapshot(false), "after": snapshot(true) });
    let example = serde_json::json!({ "teacher": 1, "views": [view] });
    serde_json::json!({ "leo_tasks": 1, "tasks": [{ "name": name, "examples": [example] }] }).to_string()
}

#[test]
fn a_store_keeps_what_it_acknowledged_whichever_allocation_is_refused() {
    let Some(refuser) = Refuser::or_skip() else { return };
    let files = tempfile::tempdir().expect("a folder");
    let [first, second] = ["Task 1", "Task 2"].map(|name| {
        let file = files.path().join(format!("{name}.json"));
        fs::write(&file, export(name)).expect("writes");
        file
    });
    let import = |file: &Path, state: &Path| {
        let mut command = leo(&["tasks", "import"]);
        command.arg(file).arg("--state").arg(state);
        command
    };
    let tasks = |state: &Path| {
        let output = leo(&["tasks", "list", "--json", "--state"]).arg(state).output().expect("runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let tasks: Vec<serde_json::Value> = serde_json::from_slice(&output.stdout).expect("JSON");
        tasks.iter().map(|task| task["name"].as_str().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    let counted = files.path().join("counted");
    assert!(import(&first, &counted).status().expect("runs").success());
    assert!(refuser.refuse(0, import(&second, &counted)).status().expect("runs").success());
    assert_eq!(tasks(&counted), ["Task 1", "Task 2"]);

    let (mut kept, mut ended) = (0, 0);
    for number in refuser.numbers() {
        let state = files.path().join(number.to_string());
        assert!(import(&first, &state).status().expect("runs").success());
        let output = refuser.refuse(number, import(&second, &state)).output().expect("runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let found = tasks(&state);
        assert_eq!(found.first().map(String::as_str), Some("Task 1"), "allocation {number}: {said}");
        if output.status.success() {
            assert_eq!(found, ["Task 1", "Task 2"], "allocation {number} was acknowledged: {said}");
            kept += 1;
        } else {
            assert!(said.contains("memory") || said.contains("leo: "), "allocation {number}: {said}");
            ended += 1;
        }
    }
    assert!(ended > 0, "no refusal had an effect; {kept} imports were acknowledged");
}

#[test]
fn a_robot_survives_its_recorder_whichever_allocation_is_refused() {
    let Some(refuser) = Refuser::or_skip() else { return };
    let robot = Robot::ready("refused-recorder", &[]);
    let before = robot.processes();
    let files = tempfile::tempdir().expect("a folder");
    let record = |file: &str| {
        let mut command = leo(&["record", "--for", "0.3", "--domain"]);
        command.arg(robot.domain()).arg(files.path().join(file)).stdout(Stdio::null());
        command
    };
    assert!(refuser.refuse(0, record("counted.mcap")).status().expect("runs").success(), "{}", robot.said());
    let mut ended = 0;
    for number in refuser.numbers() {
        let output = refuser.refuse(number, record(&format!("{number}.mcap"))).output().expect("runs");
        ended += usize::from(!output.status.success());
    }
    assert!(ended > 0, "no refusal had an effect");
    assert_eq!(robot.processes(), before, "a process was replaced\n{}", robot.said());
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{said}");
}

#[test]
fn no_process_is_left_whichever_allocation_of_the_supervisor_is_refused() {
    let Some(refuser) = Refuser::or_skip() else { return };
    let files = tempfile::tempdir().expect("a folder");
    let config = files.path().join("leo.toml");
    let text = config::Robot::leo_text_with(&[]).replace("\"127.0.0.1:7780\"", "\"none\"");
    fs::write(&config, text).expect("writes");
    let root = domain("refused-memory");
    let run = || {
        let mut command = leo(&["run", "--for", "0.3", "--config"]);
        command.arg(&config).arg("--domain").arg(&root).env("XDG_STATE_HOME", files.path());
        command.stdout(Stdio::null());
        command
    };
    assert!(refuser.refuse(0, run()).status().expect("runs").success());
    let mut ended = 0;
    for number in refuser.numbers() {
        let output = refuser.refuse(number, run()).stderr(Stdio::piped()).output().expect("runs");
        ended += usize::from(!output.status.success());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(wait_until(|| processes_in(&root).is_empty()), "allocation {number}: {said}");
    }
    assert!(ended > 0, "no refusal had an effect");
    let next = run().output().expect("runs");
    assert!(next.status.success(), "{}", String::from_utf8_lossy(&next.stderr));
}

/// The processes whose command line names a domain.
fn processes_in(root: &Path) -> Vec<i32> {
    let root = root.display().to_string();
    let all = fs::read_dir("/proc").expect("is mounted").flatten();
    let pids = all.filter_map(|entry| entry.file_name().to_string_lossy().parse::<i32>().ok());
    let names = |pid: &i32| {
        let line = fs::read_to_string(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        line.split('\0').any(|word| word == root) && is_alive(*pid)
    };
    pids.filter(names).collect()
}

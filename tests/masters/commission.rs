//! `leo bus commission` on `leo mock-bus`: an engineer's trials with new servos.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use rustix::fs::{Mode, OFlags, open};
use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use crate::bench_tool::well;
use crate::mock_bus::MockBus;

fn commission(mock: &MockBus, folder: &Path, arguments: &[&str]) -> Command {
    let mut tool = Command::new(env!("CARGO_BIN_EXE_leo"));
    tool.args(["bus", "commission", "--bus", "torso", "--device"])
        .arg(mock.path("torso"))
        .arg("--report")
        .arg(folder)
        .args(arguments)
        .env_remove("RUST_LOG");
    tool
}

/// The reports in a folder.
fn reports(folder: &Path) -> Vec<String> {
    let mut files: Vec<_> =
        std::fs::read_dir(folder).expect("a folder").flatten().map(|file| file.path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read_to_string(file).expect("reads")).collect()
}

/// Runs trials; returns exit status and output.
fn run(mock: &MockBus, folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = commission(mock, folder, arguments).stdin(Stdio::null()).output().expect("runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout) + &text(&output.stderr))
}

#[test]
fn good_servos_pass_all_unattended_trials_and_reports_are_kept() {
    let mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    let (status, said) = run(&mock, folder.path(), &["--yes"]);
    assert_eq!(status, Some(0), "{said}");
    assert!(said.contains("8 passed, 0 failed, 0 skipped"), "{said}");
    assert!(said.contains("power-cut, blocked, unplug") && said.contains("7 servos"), "{said}");
    let (status, said) = run(&mock, folder.path(), &["--yes", "--only", "identity"]);
    assert_eq!(status, Some(0), "{said}");
    let reports = reports(folder.path());
    let [first, second] = reports.as_slice() else { panic!("{} reports", reports.len()) };
    assert_eq!((first.matches("[[trial]]").count(), first.matches("outcome = \"passed\"").count()), (8, 8));
    assert!(first.contains("complete = false") && first.contains("buses = [\"torso\"]"), "{first}");
    assert!(second.contains("name = \"identity\"") && !second.contains("name = \"motion\""), "{second}");
}

#[test]
fn a_fault_fails_its_trial_and_names_the_joint() {
    let mut mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    for (fault, trial, expected) in [
        ("drop bus=torso id=6", "identity", "neck_roll_joint (id 6) does not answer"),
        ("alert bus=torso id=3 at=0s", "identity", "id 3: hardware alert (input voltage out of range)"),
        ("blocked bus=torso id=2", "motion", "torso_pitch_joint: came no nearer"),
        ("baud bus=torso id=4", "speed", "at 4000000 baud 6 servos answer, of 7"),
        ("sag bus=torso id=1 is=80", "torque", "torso_yaw_joint: id 1: hardware alert (input voltage"),
    ] {
        mock.tell(&format!("fault {fault}"));
        let (status, said) = run(&mock, folder.path(), &["--yes", "--only", trial]);
        assert_eq!(status, Some(1), "{fault}: {said}");
        assert!(said.contains("0 passed, 1 failed") && said.contains(expected), "{fault}: {said}");
        mock.tell("clear");
        well(&mock, &["reboot", "--id", "3"]);
    }
    assert_eq!(reports(folder.path()).iter().filter(|text| text.contains("outcome = \"failed\"")).count(), 5);
}

#[test]
fn an_eeprom_of_another_robot_or_of_another_joint_is_named() {
    let mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    // The limits of torso pitch, in the servo of torso yaw.
    let [low, high] = [-0.2, 0.5].map(|rad| servo::position_count(rad).to_string());
    well(&mock, &["write", "--id", "1", "min_position_limit", &low]);
    well(&mock, &["write", "--id", "1", "max_position_limit", &high]);
    for (id, item, value) in [
        ("2", "homing_offset", "100"),
        ("3", "drive_mode", "1"),
        ("4", "secondary_id", "9"),
        ("5", "startup_configuration", "1"),
        ("6", "shutdown", "0"),
        ("7", "pwm_limit", "0"),
    ] {
        well(&mock, &["write", "--id", id, item, value]);
    }
    let (status, said) = run(&mock, folder.path(), &["--yes", "--only", "eeprom"]);
    assert_eq!(status, Some(1), "{said}");
    for expected in [
        "torso_yaw_joint: the position limits 1918 to 2374 are those of torso_pitch_joint: were the two servos swapped?",
        "torso_pitch_joint: homing_offset (item 20) is 100",
        "torso_roll_joint: drive_mode (item 10) is 1",
        "neck_yaw_joint: secondary_id (item 12) is 9",
        "neck_pitch_joint: startup_configuration (item 60) is 1",
        "neck_roll_joint: shutdown (item 63) is 0",
        "head_pitch_joint: pwm_limit (item 36) is 0",
    ] {
        assert!(said.contains(&format!("WRONG:    {expected}")), "{said}\nlacks {expected}");
    }
}

/// The question before the first trial with torque, without a fault of the mock bus, and the answer to it.
const CONSENT: (&str, &str, &str) = ("torque will come on", "", "y");

/// `leo bus commission` with a terminal as its standard input.
struct Attended {
    tool: Child,
    keys: File,
    out: ChildStdout,
    said: String,
}

impl Attended {
    fn start(mock: &MockBus, folder: &Path, trial: &str) -> Self {
        let keys =
            openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).expect("a terminal");
        grantpt(&keys).and_then(|()| unlockpt(&keys)).expect("a terminal");
        let name = ptsname(&keys, Vec::new()).expect("a terminal");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let terminal = open(name, flags, Mode::empty()).expect("opens");
        let mut tool = commission(mock, folder, &["--only", trial])
            .stdin(terminal)
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        let out = tool.stdout.take().expect("piped");
        Self { tool, keys: keys.into(), out, said: String::new() }
    }

    /// Reads up to the next prompt, and returns what was printed since the one before; `None` at the end.
    fn next_prompt(&mut self) -> Option<String> {
        let (begin, mut byte) = (self.said.len(), [0]);
        while self.out.read(&mut byte).expect("reads") > 0 {
            self.said.extend(byte.map(char::from));
            if ["[y/N] ", "`skip`: "].iter().any(|end| self.said.ends_with(end)) {
                return self.said.get(begin..).map(str::to_owned);
            }
        }
        None
    }

    fn type_line(&mut self, line: &str) {
        writeln!(self.keys, "{line}").expect("it listens");
    }

    /// Exit status and output.
    fn end(mut self) -> (Option<i32>, String) {
        self.out.read_to_string(&mut self.said).expect("reads");
        (self.tool.wait().expect("ends").code(), self.said)
    }
}

/// Plays the operator: at each prompt with one of the texts does what is asked for, and types the answer.
fn attend(
    mock: &mut MockBus,
    folder: &Path,
    trial: &str,
    says: &[(&str, &str, &str)],
) -> (Option<i32>, String) {
    let mut attended = Attended::start(mock, folder, trial);
    while let Some(prompt) = attended.next_prompt() {
        let known = says.iter().find(|(text, ..)| prompt.contains(text));
        let (_, command, key) = known.expect("a known prompt");
        if !command.is_empty() {
            mock.tell(command);
        }
        attended.type_line(key);
    }
    attended.end()
}

/// The number of torso servos with torque.
fn with_torque(mock: &MockBus) -> usize {
    let ids = ["1", "2", "3", "4", "5", "6", "7"];
    ids.iter().filter(|id| well(mock, &["read", "--id", id, "torque_enable"]).trim().ends_with('1')).count()
}

#[test]
fn any_answer_to_the_warning_but_y_starts_no_trial() {
    let mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    for answer in ["", "no", "n", "N", "wait", "quit", "skip", "yn"] {
        let mut attended = Attended::start(&mock, folder.path(), "power-cut");
        assert!(attended.next_prompt().expect("a question").contains(CONSENT.0));
        attended.type_line(answer);
        assert_eq!(attended.next_prompt(), None, "{answer:?}");
        let (status, said) = attended.end();
        assert!(status == Some(1) && !said.contains("Trial 1"), "{answer:?}: {said}");
    }
    assert!(reports(folder.path()).is_empty());
}

#[test]
fn an_instruction_is_repeated_until_enter_or_skip() {
    let mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    let mut attended = Attended::start(&mock, folder.path(), "power-cut");
    attended.next_prompt().expect("a question");
    attended.type_line("y");
    assert!(attended.next_prompt().expect("an instruction").contains("Cut the power"));
    for answer in ["no", "n", "wait", "quit", "y"] {
        attended.type_line(answer);
        let again = attended.next_prompt().expect("the instruction again");
        assert!(again.trim_start().starts_with("Press Enter"), "{answer}: {again}");
    }
    attended.type_line("skip");
    assert_eq!(attended.next_prompt(), None);
    let (status, said) = attended.end();
    assert!(status == Some(1) && said.contains("1 skipped"), "{said}");
}

#[test]
fn ctrl_c_ends_a_waiting_instruction_and_torque_goes_off() {
    let mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    let mut attended = Attended::start(&mock, folder.path(), "power-cut");
    attended.next_prompt().expect("a question");
    attended.type_line("y");
    assert!(attended.next_prompt().expect("an instruction").contains("Cut the power"));
    let id = i32::try_from(attended.tool.id()).ok().and_then(Pid::from_raw).expect("a process");
    kill_process(id, Signal::INT).expect("it runs");
    let ends = crate::comes(|| attended.tool.try_wait().expect("a child").is_some());
    if !ends {
        attended.tool.kill().expect("it runs");
    }
    let (status, said) = attended.end();
    assert!(ends && status == Some(1), "it goes on waiting: {said}");
    assert!(said.contains("torque is off, as 7 servos say") && said.contains("; interrupted"), "{said}");
    assert_eq!(with_torque(&mock), 0);
}

#[test]
fn torque_goes_off_when_the_report_cannot_be_written() {
    let mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    let tool = commission(&mock, folder.path(), &["--yes", "--only", "torque", "--only", "all-off"]);
    // A file may have one block: the report is full after a part of the first trial.
    let mut limited = Command::new("sh");
    limited.args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\""]);
    limited.arg(tool.get_program()).args(tool.get_args()).env_remove("RUST_LOG").stdin(Stdio::null());
    let output = limited.output().expect("runs");
    let wrong = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{wrong}");
    assert!(wrong.contains("cannot write the report"), "{wrong}");
    assert!(wrong.contains("torque is off, as 7 servos say"), "{wrong}");
    assert_eq!(with_torque(&mock), 0);
}

#[test]
fn a_person_cuts_the_power_holds_a_joint_and_unplugs_the_adapter() {
    let mut mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    let (status, said) = attend(
        &mut mock,
        folder.path(),
        "power-cut",
        &[
            CONSENT,
            ("Cut the power", "fault brown-out bus=torso at=0s for=4s", ""),
            ("Bring the power back", "", ""),
        ],
    );
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(said.matches("without torque").count(), 7, "{said}");
    mock.tell("clear");

    let (status, said) = attend(
        &mut mock,
        folder.path(),
        "blocked",
        &[CONSENT, ("firmly by hand", "fault blocked bus=torso", "")],
    );
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(said.matches("behind its trajectory").count(), 7, "{said}");
    mock.tell("clear");
    // Without a blocked joint the trial fails.
    let (status, said) = attend(&mut mock, folder.path(), "blocked", &[CONSENT, ("firmly by hand", "", "")]);
    assert!(status == Some(1) && said.contains("torso_yaw_joint: arrived"), "{said}");

    let (status, said) = attend(
        &mut mock,
        folder.path(),
        "unplug",
        &[
            CONSENT,
            ("Unplug the adapter", "fault hang-up bus=torso at=0s for=3s", ""),
            ("Plug it in", "", ""),
        ],
    );
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(said.matches("item 98 reads -1").count(), 7, "{said}");
}

#[test]
fn a_trial_is_skipped_only_on_the_answer_skip() {
    let mut mock = MockBus::start(&[]);
    let folder = tempfile::tempdir().expect("a folder");
    let (status, said) =
        attend(&mut mock, folder.path(), "power-cut", &[CONSENT, ("Cut the power", "", "skip")]);
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("SKIPPED") && said.contains("0 passed, 0 failed, 1 skipped"), "{said}");
    // A power cut that did not happen is no success.
    let (status, said) = attend(
        &mut mock,
        folder.path(),
        "power-cut",
        &[CONSENT, ("Cut the power", "", ""), ("Bring the power back", "", "")],
    );
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains("torso_yaw_joint") && said.contains("0 passed, 1 failed"), "{said}");
    let mut wording = String::new();
    for (arguments, word) in [
        (&["--only", "unplug"][..], "--yes"),
        (&["--only", "dance"], "`dance`"),
        (&["--yes", "--only", "unplug"], "person"),
    ] {
        let (status, said) = run(&mock, folder.path(), arguments);
        assert!(status == Some(2) && said.contains(word), "{arguments:?}: {said}");
        // The name of the report has its time.
        let lines = said.lines().filter(|line| !line.contains("/commission-"));
        wording += &lines.map(|line| format!("{line}\n")).collect::<String>();
    }
    insta::assert_snapshot!(wording);
}

use std::fs;
use std::path::Path;

use config::motor::Device;

use super::*;

/// A machine in a folder: one core with a power-saving governor, one adapter with a long latency timer.
fn folder() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    for (file, text) in [
        ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n"),
        ("sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n"),
        ("run/other", ""),
    ] {
        let file = root.path().join(file);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, text).unwrap();
    }
    root
}

fn inquiry(root: &Path, deed: MachineChange) -> CheckOptions {
    CheckOptions {
        files: Files::read(None).unwrap(),
        versions: Vec::new(),
        json: false,
        colours: false,
        measure: Duration::ZERO,
        deed,
        root: root.to_owned(),
    }
}

fn governor(root: &Path) -> String {
    fs::read_to_string(root.join("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")).unwrap()
}

#[test]
fn this_machine_has_cores_and_shared_memory() {
    let machine = machine(&Robot::load(None).unwrap());
    assert!(!machine.cores.is_empty() && machine.shared_memory_free > Some(0), "{machine:?}");
}

/// With isolated cores: a process does not get them unless it requests them.
#[test]
fn isolated_cores_are_cores_of_the_machine() {
    let all = machine(&Robot::load(None).unwrap()).cores;
    let first = all.first().copied().unwrap();
    let kept_off = move || {
        let mut one = CpuSet::new();
        one.set(usize::from(first));
        sched_setaffinity(None, &one).unwrap();
        let machine = machine(&Robot::load(None).unwrap());
        assert_eq!(own_cores(), [first], "a look changes nothing for who looks");
        machine
    };
    let machine = thread::spawn(kept_off).join().unwrap();
    assert_eq!(machine.given_cores, [first]);
    assert_eq!(machine.cores, all);
}

#[test]
fn each_bus_adds_a_motor_thread_and_each_mock_bus_another() {
    let threads = |robot: &Robot| -> Vec<(&str, usize)> {
        machine(robot).hot.iter().map(|hot| (hot.name, hot.threads)).collect()
    };
    let mut robot = Robot::load(None).unwrap();
    assert_eq!(threads(&robot), [("sensor", 1), ("belief", 1), ("motor", 6), ("mock_bus", 5)]);
    for bus in &mut robot.motor.buses {
        bus.device = Device::Tty("/dev/ttyUSB0".into());
    }
    assert_eq!(threads(&robot), [("sensor", 1), ("belief", 1), ("motor", 6)]);
}

#[test]
fn each_file_is_named_with_where_it_comes_from() {
    let folder = tempfile::tempdir().unwrap();
    let leo = folder.path().join("leo.toml");
    let builtin = Files::read(None).unwrap();
    builtin.keep(folder.path()).unwrap();
    let motors = leo.with_file_name("motors.toml");
    fs::rename(leo.with_file_name("motor.toml"), &motors).unwrap();
    let files = Files::read(Some(&leo)).unwrap();
    let found: Vec<Finding> = files_read(&files).collect();
    let texts: Vec<&str> = found.iter().map(|finding| finding.text.as_str()).collect();
    assert!(texts.contains(&format!("{} was read", leo.display()).as_str()), "{texts:?}");
    assert!(texts.iter().any(|text| text.starts_with("motor.toml is the built-in one")), "{texts:?}");
    let warning = found.last().unwrap();
    assert_eq!((warning.verdict, found.len()), (Verdict::Warning, 6));
    assert_eq!(warning.text, format!("{} is read by nothing; did you mean motor.toml?", motors.display()));
    assert_eq!(
        warning.mend.as_deref(),
        Some(format!("mv {} {}", motors.display(), leo.with_file_name("motor.toml").display()).as_str())
    );
    let mut out = Vec::new();
    let options = CheckOptions { files, ..inquiry(Path::new("/"), MachineChange::Inspect) };
    check(&options, &mut out, |_| {}).unwrap();
    let out = String::from_utf8(out).unwrap();
    assert!(out.contains("warning  file") && out.contains("did you mean motor.toml?"), "{out}");
}

#[test]
fn the_findings_are_one_json_document() {
    let mut out = Vec::new();
    let measured = CheckOptions {
        json: true,
        measure: Duration::from_millis(50),
        ..inquiry(Path::new("/"), MachineChange::Inspect)
    };
    check(&measured, &mut out, |_| {}).unwrap();
    let findings: serde_json::Value = serde_json::from_slice(&out).unwrap();
    let abouts: Vec<&str> =
        findings.as_array().unwrap().iter().map(|finding| finding["about"].as_str().unwrap()).collect();
    assert_eq!(abouts.len(), 25, "{abouts:?}");
    assert_eq!(abouts[23..], ["wake-up of sensor", "wake-up of motor"]);
    assert_eq!(findings[0]["verdict"], "good");
}

#[test]
fn an_inspection_changes_no_setting() {
    let root = folder();
    let mut out = Vec::new();
    check(&inquiry(root.path(), MachineChange::Inspect), &mut out, |_| {}).unwrap();
    let said = String::from_utf8(out).unwrap();
    assert!(said.contains("mend, or --apply: cpupower"), "{said}");
    assert_eq!(governor(root.path()), "powersave\n");
    assert!(!root.path().join("run/leo-check.json").exists());
}

#[test]
fn applied_changes_are_printed_recorded_and_reverted() {
    let root = folder();
    let mut out = Vec::new();
    check(&inquiry(root.path(), MachineChange::Apply), &mut out, |_| {}).unwrap();
    let said = String::from_utf8(out).unwrap();
    let file = "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
    let changed = said.lines().find(|line| line.contains(file)).unwrap();
    for change in ["performance", "powersave"].map(|value| format!("echo {value} > {file}")) {
        assert!(changed.contains(&change), "{said}");
    }
    let governor_line = said.lines().find(|line| line.contains("frequency governor")).unwrap();
    assert!(governor_line.starts_with("good "), "{said}");
    insta::assert_snapshot!(format!("{changed}\n{governor_line}"));
    assert_eq!(governor(root.path()), "performance");
    // Applying twice changes nothing and keeps the journal.
    check(&inquiry(root.path(), MachineChange::Apply), &mut Vec::new(), |_| {}).unwrap();
    check(&inquiry(root.path(), MachineChange::Revert), &mut Vec::new(), |_| {}).unwrap();
    assert_eq!(governor(root.path()), "powersave");
    let timer = root.path().join("sys/bus/usb-serial/devices/ttyUSB0/latency_timer");
    assert_eq!(fs::read_to_string(timer).unwrap(), "16");
    let nothing = check(&inquiry(root.path(), MachineChange::Revert), &mut Vec::new(), |_| {}).unwrap_err();
    assert!(nothing.to_string().contains("nothing to revert"), "{nothing}");
}

#[test]
fn a_setting_that_cannot_be_journalled_is_not_changed() {
    let root = folder();
    fs::remove_dir_all(root.path().join("run")).unwrap();
    let refused = check(&inquiry(root.path(), MachineChange::Apply), &mut Vec::new(), |_| {}).unwrap_err();
    assert!(refused.to_string().contains("as root"), "{refused}");
    assert_eq!(governor(root.path()), "powersave\n");
}

#[test]
fn a_core_that_the_machine_lacks_is_an_error_without_advice() {
    let mut robot = Robot::load(None).unwrap();
    assert_eq!(check_cores(&robot.leo), Ok(()));
    robot.leo.motor.realtime.cores = vec![0, 999];
    let error = check_cores(&robot.leo).unwrap_err();
    assert_eq!((error.process, error.core), ("motor", 999));
    assert!(error.to_string().contains("this machine has the cores 0"), "{error}");
    let findings = judge(&System::below(Path::new("/")), &machine(&robot));
    let broken: Vec<&Finding> =
        findings.iter().filter(|finding| finding.verdict == Verdict::Broken).collect();
    assert!(
        broken.iter().any(|finding| finding.about == "core plan" && finding.text.contains("core 999")),
        "{broken:?}"
    );
    for finding in &findings {
        let mend = finding.mend.as_deref().unwrap_or_default();
        assert!(!(mend.contains("isolcpus") && mend.contains("999")), "{mend}");
    }
}

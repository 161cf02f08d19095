use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::assert_refused;
use crate::harness::{CommandOutput, Leo, leo, read, run_leo, write};

/// Runs `leo check` without measurements.
fn check(arguments: &[&str]) -> CommandOutput {
    run_leo(&[&["check", "--seconds", "0"], arguments].concat())
}

#[test]
fn a_check_names_remedies_applies_and_reverts_them() {
    let root = tempfile::tempdir().expect("a folder");
    let timer = root.path().join("sys/bus/usb-serial/devices/ttyUSB0/latency_timer");
    fs::create_dir_all(timer.parent().expect("a folder")).expect("makes");
    fs::create_dir(root.path().join("run")).expect("makes");
    fs::write(&timer, "16\n").expect("writes");
    let at = ["--root", root.path().to_str().expect("letters")];
    let timer = || fs::read_to_string(&timer).expect("reads");

    let output = check(&at);
    assert!(
        output.status == Some(0) && output.out.contains("deliver received bytes up to 16 ms late"),
        "{output:?}"
    );
    assert!(!output.out.contains("wake-up"), "{output:?}");
    assert_eq!(timer(), "16\n");
    let output = check(&[&at[..], &["--apply"]].concat());
    assert!(output.status == Some(0) && output.out.contains("   (back: echo 16 > /sys/bus"), "{output:?}");
    assert!(output.out.contains("1 serial adapters deliver received bytes at once"), "{output:?}");
    assert_eq!(timer(), "1");
    let output = check(&[&at[..], &["--revert"]].concat());
    assert!(output.status == Some(0) && output.out.starts_with("changed  echo 16 > /sys/bus"), "{output:?}");
    assert_eq!(timer(), "16");
    assert_refused(&check(&[&at[..], &["--revert"]].concat()), 1, &["nothing to revert"]);
    for (usage, word) in
        [(["check", "--apply", "--json"], "--json"), (["check", "--seconds", "-1"], "seconds")]
    {
        let output = run_leo(&usage);
        assert!(output.status == Some(2) && output.out.is_empty() && output.err.contains(word), "{output:?}");
    }
}

#[test]
fn a_measurement_is_a_finding_for_each_rate() {
    let output = run_leo(&["check", "--json", "--seconds", "0.2"]);
    let findings: serde_json::Value = serde_json::from_str(&output.out).expect("JSON");
    let abouts: Vec<&str> =
        findings.as_array().expect("a list").iter().filter_map(|finding| finding["about"].as_str()).collect();
    assert!(abouts.ends_with(&["wake-up of sensor", "wake-up of motor"]), "{abouts:?}");
}

#[test]
fn an_old_configuration_is_brought_forward_once_and_kept_as_it_was() {
    let files = tempfile::tempdir().expect("a folder");
    let old = read("config/leo.toml").replace("noise = 0.0 ", "# noise = 0.0 ");
    let config = write(&files, "leo.toml", &old);
    let perspective = write(&files, "perspective.toml", "[sight]\nrange_m = \"far\"\n");
    let mend = format!("an older file? `leo check --config {config} --migrate`");
    assert_refused(&check(&["--config", &config]), 2, &["missing field `noise`", &mend]);
    // An error in one file leaves every file unchanged.
    assert_refused(&check(&["--config", &config, "--migrate"]), 2, &["perspective.toml:2:"]);
    assert_eq!(read(&config), old);
    fs::remove_file(perspective).expect("was there");

    let output = check(&["--config", &config, "--migrate"]);
    assert_eq!(output.status, Some(0), "{output:?}");
    assert!(
        output.out.contains("leo.toml was migrated; the original: ") && output.out.contains("noise = 0.0"),
        "{output:?}"
    );
    assert!(output.out.contains("no learned tasks in "), "{output:?}");
    assert_eq!(read(&format!("{config}.old")), old);
    assert!(!Path::new(&format!("{config}.new")).exists());
    let new = read(&config);
    let output = check(&["--config", &config, "--migrate"]);
    assert!(output.status == Some(0) && !output.out.contains("was migrated"), "{output:?}");
    assert_eq!(read(&config), new);
    // An existing backup is never overwritten.
    fs::write(&config, &old).expect("writes");
    assert_refused(&check(&["--config", &config, "--migrate"]), 2, &["leo.toml.old", "move it away"]);
    assert_eq!(read(&config), old);
}

#[test]
fn an_older_configuration_gets_the_arming_settings() {
    let files = tempfile::tempdir().expect("a folder");
    let new = read("config/leo.toml");
    let (before, rest) = new.split_once("automatic_arming = ").expect("is there");
    let (_, after) = rest.split_once("[motor.realtime]").expect("is there");
    let config = write(&files, "leo.toml", &format!("{before}\n[motor.realtime]{after}"));
    assert_refused(&check(&["--config", &config]), 2, &["missing field `automatic_arming`", "--migrate"]);
    let output = check(&["--config", &config, "--migrate"]);
    assert_eq!(output.status, Some(0), "{output:?}");
    for step in ["automatic_arming = \"simulated\"", "stop_category = 0", "the table [motor.alert]"] {
        assert!(output.out.contains(step), "{step}: {output:?}");
    }
    assert_eq!(check(&["--config", &config]).status, Some(0));
}

#[test]
fn learned_tasks_are_migrated_in_place_unless_a_robot_uses_them() {
    let files = tempfile::tempdir().expect("a folder");
    let nowhere = files.path().join("nowhere");
    let migrate = |state: &Path| check(&["--migrate", "--state", state.to_str().expect("letters")]);
    let output = migrate(&nowhere);
    assert!(output.status == Some(0) && output.out.contains("no learned tasks in "), "{output:?}");
    assert!(!nowhere.exists(), "a look makes nothing");

    let state = files.path().join("state");
    let file = process::state::learned(&state);
    let memory = learner_process::Memory::open(&file).expect("is made");
    assert_refused(&migrate(&state), 1, &["learned.store is in use", "stop the robot first"]);
    drop(memory);
    let output = migrate(&state);
    assert!(output.status == Some(0) && output.out.contains("is of this version"), "{output:?}");

    let state = files.path().join("old");
    fs::create_dir(&state).expect("makes");
    fs::copy("shared/store/tests/version_1.redb", state.join("learned.redb")).expect("copies");
    let output = migrate(&state);
    assert!(output.status == Some(0) && output.out.contains("was migrated; the original: "), "{output:?}");
    assert!(
        output.out.contains("old/learned.v1.redb") && state.join("learned.v1.redb").exists(),
        "{output:?}"
    );
    fs::write(state.join("learned.copy.store"), "nonsense").expect("writes");
    let output = migrate(&state);
    assert!(output.status == Some(0) && output.err.contains("learned.copy.damaged.store"), "{output:?}");
}

#[test]
fn what_root_brings_forward_belongs_to_whom_it_belonged() {
    let files = tempfile::tempdir().expect("a folder");
    let config =
        write(&files, "leo.toml", &read("config/leo.toml").replace("noise = 0.0 ", "# noise = 0.0 "));
    if std::os::unix::fs::chown(&config, Some(12345), Some(12346)).is_err() {
        return skip::skip("needs to be root");
    }
    let output = check(&["--config", &config, "--migrate"]);
    assert_eq!(output.status, Some(0), "{output:?}");
    for file in [config.clone(), format!("{config}.old")] {
        let now = fs::metadata(&file).expect("is there");
        assert_eq!((now.uid(), now.gid()), (12345, 12346), "{file}");
    }
}

#[test]
fn a_missing_key_of_an_older_perspective_names_the_migration() {
    let files = tempfile::tempdir().expect("a folder");
    let config = write(&files, "leo.toml", &read("config/leo.toml"));
    let perspective = read("config/perspective.toml").replace("hearing_range_m", "# hearing_range_m");
    write(&files, "perspective.toml", &perspective);
    let mend = format!("an older file? `leo check --config {config} --migrate` adds it");
    assert_refused(&check(&["--config", &config]), 2, &["perspective.toml:", "missing field", &mend]);
    let output = check(&["--config", &config, "--migrate"]);
    assert!(output.status == Some(0) && output.out.contains("perspective.toml was migrated"), "{output:?}");
}

/// Migrates two files on a full disk, with a little more room at each attempt.
const ON_A_FULL_DISK: &str = r#"
mkdir "$1/disk" && mount -t tmpfs -o size=128k tmpfs "$1/disk" && cd "$1/disk" || exit 77
cp "$1/leo.toml" "$1/perspective.toml" . || exit 3
pages=0
while dd if=/dev/zero of="fill.$pages" bs=4k count=1 2>/dev/null; do pages=$((pages + 1)); done
rm -f "fill.$pages"
refused=0
until "$0" check --seconds 0 --config "$1/disk/leo.toml" --migrate; do
    cmp leo.toml "$1/leo.toml" && cmp perspective.toml "$1/perspective.toml" || exit 4
    for made in *.old *.new; do if [ -e "$made" ]; then echo "$made is left"; exit 5; fi; done
    refused=$((refused + 1)) pages=$((pages - 1))
    rm "fill.$pages" || exit 6
done
cmp leo.toml.old "$1/leo.toml" && cmp perspective.toml.old "$1/perspective.toml" || exit 7
echo "refused: $refused"
"#;

#[test]
fn a_full_disk_leaves_files_unchanged_until_space_is_free() {
    let (command, files) = leo(&[]);
    write(&files, "leo.toml", &read("config/leo.toml").replace("noise = 0.0 ", "# noise = 0.0 "));
    let perspective = read("config/perspective.toml").replace("hearing_range_m", "# hearing_range_m");
    write(&files, "perspective.toml", &perspective);
    let mut inside = Command::new("unshare");
    inside.args(["--mount", "sh", "-c", ON_A_FULL_DISK]).arg(command.get_program()).arg(files.path());
    inside.env("XDG_STATE_HOME", files.path()).stdin(Stdio::null());
    let output = Leo::start(inside, files).end();
    if output.status == Some(77) || output.err.starts_with("unshare:") {
        skip::skip("needs `unshare --mount` and the right to mount a tmpfs");
        return;
    }
    assert_eq!(output.status, Some(0), "{output:?}");
    let refused =
        output.out.lines().last().and_then(|line| line.strip_prefix("refused: ")?.parse::<u32>().ok());
    // Two files, twice each: with room for the first there is still none for the second.
    assert!(refused.is_some_and(|refused| refused >= 4), "{output:?}");
    assert!(
        output.err.contains("cannot migrate") && output.err.contains("No space left on device"),
        "{output:?}"
    );
    assert!(output.err.contains("perspective.toml: No space"), "{output:?}");
}

/// The lines about a subject, each with the following advice.
fn about(output: &CommandOutput, what: &str) -> String {
    let lines: Vec<&str> = output.out.lines().collect();
    let is_it = |line: &&str| line.get(9..).is_some_and(|rest| rest.starts_with(what));
    let mut found = String::new();
    for (number, line) in lines.iter().enumerate().filter(|(_, line)| is_it(line)) {
        let below = lines.get(number + 1).filter(|below| below.trim_start().starts_with("mend"));
        found += &format!("{line}\n{}\n", below.unwrap_or(&""));
    }
    found
}

#[test]
fn a_check_reports_the_store_version_and_changes_nothing() {
    let files = tempfile::tempdir().expect("a folder");
    let state = files.path().join("state");
    let learned = || {
        let output = check(&["--state", state.to_str().expect("letters")]);
        (output.status, about(&output, "learned tasks"))
    };
    let (status, none) = learned();
    assert!(status == Some(0) && none.starts_with("good "), "{none}");
    assert!(none.contains("no learned tasks in ") && !state.exists(), "{none}");

    let file = process::state::learned(&state);
    let memory = learner_process::Memory::open(&file).expect("is made");
    let (status, in_use) = learned();
    assert!(
        status == Some(0) && in_use.starts_with("good ") && in_use.contains("in use by a running robot"),
        "{in_use}"
    );
    drop(memory);
    let (status, this) = learned();
    assert!(
        status == Some(0) && this.starts_with("good ") && this.contains("is of this version, 4"),
        "{this}"
    );

    let old = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("shared/store/tests/version_1.redb"));
    let old = old.expect("the file of version 1");
    let database = file.with_extension("redb");
    fs::write(&database, &old).expect("writes");
    let (status, older) = learned();
    assert!(status == Some(0) && older.starts_with("slower "), "{older}");
    assert!(older.contains("is of version 1, and this Leo writes version 4"), "{older}");
    assert!(older.contains("mend: leo check --migrate --state "), "{older}");
    assert_eq!(fs::read(&database).expect("reads"), old, "a check changes nothing");

    fs::write(&database, "nonsense").expect("writes");
    let (status, broken) = learned();
    assert!(status == Some(1) && broken.starts_with("broken "), "{broken}");
    assert!(
        broken.contains("learned.redb is damaged (") && broken.contains("the next start sets it aside"),
        "{broken}"
    );
    fs::remove_file(&database).expect("is there");

    for damaged in ["", "nonsense"] {
        fs::write(&file, damaged).expect("writes");
        let (status, broken) = learned();
        assert!(status == Some(1) && broken.starts_with("broken "), "{broken}");
        assert!(
            broken.contains("learned.store is ") && broken.contains("leo check --migrate --state "),
            "{broken}"
        );
        assert_eq!(fs::read_to_string(&file).expect("reads"), damaged, "a check changes nothing");
    }
}

#[test]
fn a_check_compares_message_layouts_with_running_robots() {
    let domain = transport::Domain::named(&format!("versions-{}", std::process::id())).expect("a legal name");
    let claim = transport::janitor::claim(&domain).expect("nobody has it");
    domain.make().expect("/dev/shm is writable");
    let root = domain.root().display().to_string();
    let robot = || {
        let output = check(&[]);
        let all = about(&output, "messages");
        let its = all.lines().skip_while(|line| !line.contains(&root)).take(2).collect::<Vec<_>>().join("\n");
        (output.status, its)
    };
    let (same_status, same) = robot();
    fs::write(domain.root().join("program"), "Leo 9.8.7\n0123456789abcdef\n").expect("writes");
    let (other_status, other) = robot();
    transport::janitor::Janitor::new(&domain).wipe(claim);

    let this =
        format!("runs Leo {} with those of this Leo, {:016x}", env!("CARGO_PKG_VERSION"), message::layouts());
    assert!(same_status == Some(0) && same.starts_with("good ") && same.contains(&this), "{same}");
    assert!(other_status == Some(0) && other.starts_with("slower "), "{other}");
    assert!(other.contains("runs Leo 9.8.7 with other messages, and this is Leo "), "{other}");
    assert!(other.contains("mend: sudo systemctl restart leo"), "{other}");
}

#[test]
fn a_check_says_of_which_version_the_configuration_is() {
    let output = check(&[]);
    let line = about(&output, "configuration");
    let this = format!("valid for this version, Leo {}", env!("CARGO_PKG_VERSION"));
    assert!(line.starts_with("good ") && line.contains(&this), "{output:?}");
}

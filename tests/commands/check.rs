use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::harness::{CommandOutput, Leo, leo, read, redacted, run_leo, write};
use crate::{VERSION_5, assert_refused};

/// Runs `leo check` without measurements.
fn check(arguments: &[&str]) -> CommandOutput {
    run_leo(&[&["check", "--seconds", "0"], arguments].concat())
}

/// The lines about changes, which are before the findings.
fn changes(output: &CommandOutput) -> String {
    let is_finding =
        |line: &&str| ["good ", "slower ", "broken "].iter().any(|verdict| line.starts_with(verdict));
    let lines: Vec<&str> = output.out.lines().take_while(|line| !is_finding(line)).collect();
    lines.join("\n").trim_end().to_owned()
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
    let late = about(&output, "adapter latency");
    assert!(
        output.status == Some(0) && late.starts_with("slower ") && late.contains(" 16 ms "),
        "{output:?}"
    );
    assert!(!output.out.contains("wake-up"), "{output:?}");
    assert_eq!(timer(), "16\n");
    let output = check(&[&at[..], &["--apply"]].concat());
    assert!(output.status == Some(0) && output.out.contains("   (back: echo 16 > /sys/bus"), "{output:?}");
    let (applied, at_once) = (changes(&output), about(&output, "adapter latency"));
    assert!(at_once.starts_with("good "), "{output:?}");
    assert_eq!(timer(), "1");
    let output = check(&[&at[..], &["--revert"]].concat());
    assert!(output.status == Some(0) && output.out.starts_with("changed  echo 16 > /sys/bus"), "{output:?}");
    assert_eq!(timer(), "16");
    let reverted = changes(&output);
    let again = check(&[&at[..], &["--revert"]].concat());
    assert_refused(&again, 1, &["/run/leo-check.json"]);
    insta::assert_snapshot!([late, applied, at_once, reverted, again.err].join("\n"));
    for (usage, word) in [
        (["check", "--apply", "--json"], "--json"),
        (["check", "--seconds", "-1"], "seconds"),
        (["check", "--seconds=0", "--migrate"], "--config"),
    ] {
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
fn an_old_configuration_is_migrated_once_and_its_original_kept() {
    let files = tempfile::tempdir().expect("a folder");
    let old = read("config/leo.toml").replace("noise = 0.0 ", "# noise = 0.0 ");
    let config = write(&files, "leo.toml", &old);
    let perspective = write(&files, "perspective.toml", "[sight]\nrange_m = \"far\"\n");
    let mend = format!("`leo check --config {config} --migrate`");
    let missing = check(&["--config", &config]);
    assert_refused(&missing, 2, &["`noise`", &mend]);
    // An error in one file leaves every file unchanged.
    assert_refused(&check(&["--config", &config, "--migrate"]), 2, &["perspective.toml:2:"]);
    assert_eq!(read(&config), old);
    fs::remove_file(perspective).expect("was there");

    let output = check(&["--config", &config, "--migrate"]);
    assert_eq!(output.status, Some(0), "{output:?}");
    let migrated = changes(&output);
    assert!(migrated.contains("leo.toml.old") && migrated.contains("noise = 0.0"), "{output:?}");
    assert_eq!(read(&format!("{config}.old")), old);
    assert!(!Path::new(&format!("{config}.new")).exists());
    let new = read(&config);
    let output = check(&["--config", &config, "--migrate"]);
    assert!(output.status == Some(0) && !output.out.contains("leo.toml.old"), "{output:?}");
    assert_eq!(read(&config), new);
    let unchanged = changes(&output);
    // An existing backup is never overwritten.
    fs::write(&config, &old).expect("writes");
    let backup = check(&["--config", &config, "--migrate"]);
    assert_refused(&backup, 2, &["leo.toml.old"]);
    assert_eq!(read(&config), old);
    let all = [missing.err, migrated, unchanged, backup.err].join("\n");
    insta::assert_snapshot!(files_redacted(&files, &all));
}

/// Text without the folder of a test.
fn files_redacted(files: &tempfile::TempDir, text: &str) -> String {
    redacted(text, &[(&files.path().display().to_string(), "[files]")])
}

#[test]
fn an_older_configuration_gets_the_arming_settings() {
    let files = tempfile::tempdir().expect("a folder");
    let new = read("config/leo.toml");
    let (before, rest) = new.split_once("automatic_arming = ").expect("is there");
    let (_, after) = rest.split_once("[motor.realtime]").expect("is there");
    let config = write(&files, "leo.toml", &format!("{before}\n[motor.realtime]{after}"));
    assert_refused(&check(&["--config", &config]), 2, &["`automatic_arming`", "--migrate"]);
    let output = check(&["--config", &config, "--migrate"]);
    assert_eq!(output.status, Some(0), "{output:?}");
    for step in ["automatic_arming = \"simulated\"", "stop_category = 0", "the table [motor.alert]"] {
        assert!(output.out.contains(step), "{step}: {output:?}");
    }
    assert_eq!(check(&["--config", &config]).status, Some(0));
}

#[test]
fn a_configuration_migrated_by_root_keeps_its_owner() {
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
    let mend = format!("`leo check --config {config} --migrate`");
    assert_refused(&check(&["--config", &config]), 2, &["perspective.toml:", "`hearing_range_m`", &mend]);
    let output = check(&["--config", &config, "--migrate"]);
    assert!(output.status == Some(0) && output.out.contains("perspective.toml.old"), "{output:?}");
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
    let disk = files.path().display().to_string();
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
    let full = std::io::Error::from(rustix::io::Errno::NOSPC).to_string();
    assert!(output.err.contains(&format!("perspective.toml: {full}")), "{output:?}");
    let mut causes: Vec<String> =
        output.err.lines().map(|line| redacted(line, &[(&disk, "[files]")])).collect();
    causes.dedup();
    insta::assert_snapshot!(causes.join("\n"));
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
    assert!(none.contains(&state.display().to_string()) && !state.exists(), "{none}");

    let file = process::state::learned(&state);
    let memory = learner_process::Memory::open(&file).expect("is made");
    let (status, in_use) = learned();
    assert!(status == Some(0) && in_use.starts_with("good ") && in_use != none, "{in_use}");
    drop(memory);
    let (status, this) = learned();
    assert!(status == Some(0) && this.starts_with("good ") && this.contains("version, 4"), "{this}");

    let whole = fs::read(&file).expect("reads");
    fs::write(&file, VERSION_5).expect("writes");
    let (status, newer) = learned();
    assert!(status == Some(1) && newer.starts_with("broken "), "{newer}");
    for word in ["learned.store", "version 5", "version 4", "use the Leo that wrote them"] {
        assert!(newer.contains(word), "{word}: {newer}");
    }
    assert_eq!(fs::read_to_string(&file).expect("reads"), VERSION_5, "a check changes nothing");
    fs::write(&file, whole).expect("writes");

    let database = file.with_extension("redb");
    fs::write(&database, "a database").expect("writes");
    let (status, refused) = learned();
    assert!(status == Some(1) && refused.starts_with("broken "), "{refused}");
    assert!(refused.contains("learned.redb") && refused.contains("move the file away"), "{refused}");
    assert_eq!(fs::read_to_string(&database).expect("reads"), "a database", "a check changes nothing");
    fs::remove_file(&database).expect("is there");
    let mut all = vec![none, in_use, this, newer, refused];

    for damaged in ["", "nonsense"] {
        fs::write(&file, damaged).expect("writes");
        let (status, broken) = learned();
        assert!(status == Some(1) && broken.starts_with("broken "), "{broken}");
        assert!(broken.contains("learned.store") && broken.contains("leo tasks list --state "), "{broken}");
        assert_eq!(fs::read_to_string(&file).expect("reads"), damaged, "a check changes nothing");
        all.push(broken);
    }
    insta::assert_snapshot!(files_redacted(&files, &all.join("")));
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

    let (version, layouts) =
        (format!("Leo {}", env!("CARGO_PKG_VERSION")), format!("{:016x}", message::layouts()));
    assert!(same_status == Some(0) && same.starts_with("good "), "{same}");
    assert!(same.contains(&version) && same.contains(&layouts), "{same}");
    assert!(other_status == Some(0) && other.starts_with("slower "), "{other}");
    assert!(other.contains("Leo 9.8.7 ") && other.contains(&version), "{other}");
    let hidden = [(root.as_str(), "[domain]"), (version.as_str(), "[this Leo]"), (&layouts, "[layouts]")];
    insta::assert_snapshot!(redacted(&format!("{same}\n{other}"), &hidden));
}

#[test]
fn a_check_reports_the_version_of_the_configuration() {
    let output = check(&[]);
    let line = about(&output, "configuration");
    let this = format!("Leo {}", env!("CARGO_PKG_VERSION"));
    assert!(line.starts_with("good ") && line.contains(&this), "{output:?}");
    insta::assert_snapshot!(redacted(&line, &[(&this, "[this Leo]")]));
}

//! The files of the package are consistent with the program.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod archive;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn repository(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(file)
}

fn read(file: &str) -> String {
    fs::read_to_string(repository(file)).expect("reads")
}

/// Runs a program if this machine has it. Skips with a message otherwise.
fn ask(command: &mut Command) -> Option<Output> {
    match command.output() {
        Ok(output) => Some(output),
        Err(error) => {
            skip::skip(format_args!("{} is needed: {error}", command.get_program().display()));
            None
        }
    }
}

#[test]
fn systemd_accepts_the_unit_and_rates_it_as_safe() {
    let folder = tempfile::tempdir().expect("a folder");
    let unit = folder.path().join("leo.service");
    // The program is not at its installed path.
    let text = read("package/leo.service");
    let installed = "/usr/bin/leo ";
    assert_eq!(text.matches(installed).count(), 1, "{text}");
    let program = format!("{} ", env!("CARGO_BIN_EXE_leo"));
    fs::write(&unit, text.replace(installed, &program)).expect("writes");
    let analyze = || Command::new("systemd-analyze");
    let Some(verified) = ask(analyze().args(["verify", "--man=no"]).arg(&unit)) else { return };
    let said = String::from_utf8_lossy(&verified.stderr).into_owned();
    assert!(verified.status.success() && said.is_empty(), "{said}");
    let security =
        ask(analyze().args(["security", "--offline=yes", "--no-pager", "--threshold=25"]).arg(&unit));
    let said = security.expect("was here");
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stdout));
}

/// The values of a key in the unit.
fn of_key(unit: &str, key: &str) -> Vec<String> {
    let values = unit.lines().filter_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    values.flat_map(str::split_whitespace).map(str::to_owned).collect()
}

/// The devices of `DeviceAllow` are resolved when the unit starts; a driver that is loaded later is not
/// allowed.
#[test]
fn drivers_of_plugged_in_adapters_are_loaded_before_the_unit() {
    let unit = read("package/leo.service");
    for (device, driver) in [("char-ttyUSB", "usbserial"), ("char-ttyACM", "cdc_acm")] {
        assert!(of_key(&unit, "DeviceAllow").contains(&device.to_owned()), "{device}");
        let loads = format!("modprobe@{driver}.service");
        for key in ["Wants", "After"] {
            assert!(of_key(&unit, key).contains(&loads), "{key}={loads}");
        }
    }
}

/// Each setting whose change the security score above would not detect.
#[test]
fn the_unit_has_exactly_the_needed_rights() {
    let unit = read("package/leo.service");
    for (key, words) in [
        ("User", &["leo"][..]),
        ("NoNewPrivileges", &["yes"]),
        ("CapabilityBoundingSet", &["CAP_SYS_NICE"]),
        ("AmbientCapabilities", &["CAP_SYS_NICE"]),
        ("ProtectSystem", &["strict"]),
        ("ReadWritePaths", &["/dev/shm"]),
        ("DevicePolicy", &["closed"]),
        // The page is for this machine only.
        ("IPAddressDeny", &["any"]),
        ("IPAddressAllow", &["localhost"]),
        ("RestrictAddressFamilies", &["AF_UNIX", "AF_INET", "AF_INET6"]),
        // Shared memory survives a user's log-out.
        ("RemoveIPC", &["no"]),
        ("LimitMEMLOCK", &["infinity"]),
        ("LimitRTPRIO", &["99"]),
    ] {
        assert_eq!(of_key(&unit, key), words, "{key}");
    }
}

#[test]
fn the_command_line_of_the_unit_is_understood() {
    let text = read("package/leo.service");
    let line = text.lines().find_map(|line| line.strip_prefix("ExecStart=/usr/bin/leo ")).expect("a program");
    let told = line.replace("/etc/leo/leo.toml", "/nowhere/leo.toml");
    let refused = Command::new(env!("CARGO_BIN_EXE_leo")).args(told.split(' ')).output().expect("runs");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    // Only the configuration file is missing.
    assert!(refused.status.code() == Some(2) && said.contains("/nowhere/leo.toml"), "{said}");
}

#[test]
fn every_public_command_has_a_manual_page_and_shell_completion() {
    let folder = tempfile::tempdir().expect("a folder");
    let written =
        Command::new(env!("CARGO_BIN_EXE_leo")).arg("manual").arg(folder.path()).output().expect("runs");
    assert!(written.status.success(), "{written:?}");
    let help = Command::new(env!("CARGO_BIN_EXE_leo")).arg("--help").output().expect("runs");
    let help = String::from_utf8(help.stdout).expect("text");
    let commands: Vec<&str> = help
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(commands.len() > 10, "{help}");
    let completions = ["leo.bash", "_leo", "leo.fish"]
        .map(|file| fs::read_to_string(folder.path().join("completions").join(file)).expect("is there"));
    for name in commands {
        let page = fs::read_to_string(folder.path().join(format!("man/leo-{name}.1")))
            .unwrap_or_else(|error| panic!("no page for {name}: {error}"));
        assert!(page.contains("Example"), "{page}");
        assert!(completions.iter().all(|shell| shell.contains(name)), "{name}");
    }
    assert!(!folder.path().join("man/leo-sensor.1").exists(), "processes are for the supervisor");
    let refused =
        Command::new(env!("CARGO_BIN_EXE_leo")).args(["manual", "/proc/nowhere"]).output().expect("runs");
    assert_eq!(refused.status.code(), Some(1));
}

/// The manual is packaged from the repository, so that a package can be built without running the program first.
#[test]
fn the_manual_in_the_repository_is_that_of_the_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let written =
        Command::new(env!("CARGO_BIN_EXE_leo")).arg("manual").arg(folder.path()).output().expect("runs");
    assert!(written.status.success(), "{written:?}");
    let mut compared = 0;
    for part in ["man", "completions"] {
        let names = |folder: PathBuf| {
            let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
            let mut names: Vec<_> = entries.map(|entry| entry.file_name()).collect();
            names.sort();
            names
        };
        let (written, kept) = (folder.path().join(part), repository("package/manual").join(part));
        assert_eq!(names(written.clone()), names(kept.clone()), "{part}");
        for name in names(written.clone()) {
            let read = |folder: &Path| fs::read_to_string(folder.join(&name)).expect("is text");
            assert!(
                read(&written) == read(&kept),
                "package/manual/{part}/{}: write it again with `leo manual --force package/manual`",
                name.display()
            );
            compared += 1;
        }
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn the_rules_for_adapters_and_the_user_are_in_order() {
    if let Some(verified) = ask(Command::new("udevadm").arg("verify").arg(repository("package/60-leo.rules")))
    {
        let said = String::from_utf8_lossy(&verified.stderr).into_owned();
        // Older versions lack `verify`.
        assert!(verified.status.success() || said.contains("Unknown command"), "{said}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("etc")).expect("makes");
    fs::write(folder.path().join("etc/group"), "dialout:x:20:\n").expect("writes");
    let root = format!("--root={}", folder.path().display());
    let Some(made) = ask(Command::new("systemd-sysusers").arg(root).arg(repository("package/leo.sysusers")))
    else {
        return;
    };
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let file = |name: &str| fs::read_to_string(folder.path().join("etc").join(name)).expect("is there");
    let user = file("passwd");
    assert!(user.contains("leo:x:") && user.contains(":/var/lib/leo:/usr/sbin/nologin"), "{user}");
    assert!(file("group").contains("dialout:x:20:leo"), "{}", file("group"));
}

#[test]
fn every_file_of_the_package_is_installed() {
    let manifest: String = read("Cargo.toml");
    let assets =
        manifest.split("assets = [").nth(1).and_then(|rest| rest.split("\n]").next()).expect("assets");
    let mut seen = 0;
    for source in assets.lines().filter_map(|line| line.trim().strip_prefix("[\"")?.split('"').next()) {
        if source.starts_with("target/") {
            continue;
        }
        let folder = repository(source).parent().expect("a folder").to_owned();
        let name = Path::new(source).file_name().expect("a name").to_string_lossy().into_owned();
        let suffix = name.strip_prefix('*');
        let mut entries = fs::read_dir(&folder).expect("a folder").flatten();
        let found = entries.any(|entry| {
            let entry = entry.file_name().to_string_lossy().into_owned();
            suffix.map_or(entry == name, |suffix| entry.ends_with(suffix))
        });
        assert!(found, "{source} is not there");
        seen += 1;
    }
    assert!(seen >= 8, "only {seen} files were seen");
}

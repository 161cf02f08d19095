use std::fs;
use std::path::Path;

use crate::assert_refused;
use crate::house::{Told, read, tell, write};

/// A check that measures nothing.
fn check(arguments: &[&str]) -> Told {
    tell(&[&["check", "--seconds", "0"], arguments].concat())
}

#[test]
fn a_check_says_what_mends_changes_it_when_told_and_takes_it_back() {
    let root = tempfile::tempdir().expect("a folder");
    let timer = root.path().join("sys/bus/usb-serial/devices/ttyUSB0/latency_timer");
    fs::create_dir_all(timer.parent().expect("a folder")).expect("makes");
    fs::create_dir(root.path().join("run")).expect("makes");
    fs::write(&timer, "16\n").expect("writes");
    let at = ["--root", root.path().to_str().expect("letters")];
    let timer = || fs::read_to_string(&timer).expect("reads");

    let told = check(&at);
    assert!(
        told.status == Some(0) && told.out.contains("keep what they received for up to 16 ms"),
        "{told:?}"
    );
    assert!(!told.out.contains("wake-up"), "{told:?}");
    assert_eq!(timer(), "16\n");
    let told = check(&[&at[..], &["--apply"]].concat());
    assert!(told.status == Some(0) && told.out.contains("   (back: echo 16 > /sys/bus"), "{told:?}");
    assert!(told.out.contains("1 serial adapters hand over at once"), "{told:?}");
    assert_eq!(timer(), "1");
    let told = check(&[&at[..], &["--revert"]].concat());
    assert!(told.status == Some(0) && told.out.starts_with("changed  echo 16 > /sys/bus"), "{told:?}");
    assert_eq!(timer(), "16");
    assert_refused(&check(&[&at[..], &["--revert"]].concat()), 1, &["nothing to take back"]);
    for (usage, word) in
        [(["check", "--apply", "--json"], "--json"), (["check", "--seconds", "-1"], "seconds")]
    {
        let told = tell(&usage);
        assert!(told.status == Some(2) && told.out.is_empty() && told.err.contains(word), "{told:?}");
    }
}

#[test]
fn a_measurement_is_a_finding_for_each_rate() {
    let told = tell(&["check", "--json", "--seconds", "0.2"]);
    let findings: serde_json::Value = serde_json::from_str(&told.out).expect("JSON");
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
    assert_refused(&check(&["--config", &config]), 2, &["missing field `noise`"]);
    // What is wrong with one file keeps every file as it is.
    assert_refused(&check(&["--config", &config, "--migrate"]), 2, &["perspective.toml:2:"]);
    assert_eq!(read(&config), old);
    fs::remove_file(perspective).expect("was there");

    let told = check(&["--config", &config, "--migrate"]);
    assert_eq!(told.status, Some(0), "{told:?}");
    assert!(
        told.out.contains("leo.toml was migrated; as it was: ") && told.out.contains("noise = 0.0"),
        "{told:?}"
    );
    assert!(told.out.contains("is of this version"), "{told:?}");
    assert_eq!(read(&format!("{config}.old")), old);
    assert!(!Path::new(&format!("{config}.new")).exists());
    let new = read(&config);
    let told = check(&["--config", &config, "--migrate"]);
    assert!(told.status == Some(0) && !told.out.contains("was migrated"), "{told:?}");
    assert_eq!(read(&config), new);
    // A copy that is there is never written over.
    fs::write(&config, &old).expect("writes");
    assert_refused(&check(&["--config", &config, "--migrate"]), 2, &["leo.toml.old", "move it away"]);
    assert_eq!(read(&config), old);
}

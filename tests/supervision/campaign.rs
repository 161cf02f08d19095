//! A whole fault campaign with the whole robot.

use std::fs;

use rustix::process::Signal;

use super::robot::{Robot, leo, wait_until};

const CAMPAIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/config/campaigns/a_bad_day.toml");

#[test]
fn the_robot_survives_a_fault_campaign_with_all_joints_following() {
    let robot = Robot::with("campaign", &[], &["--faults", CAMPAIGN]);
    assert!(wait_until(|| robot.said().contains("the robot runs")), "{}", robot.said());
    let lives = |process: &str| {
        let rows = robot.rows();
        let row = rows.iter().find(|row| row["process"] == process);
        row.and_then(|row| row["restarts"].as_u64()).unwrap_or(0)
    };
    assert!(wait_until(|| lives("belief") > 0), "belief was not killed: {}", robot.said());
    assert!(wait_until(|| lives("motor") > 0), "motor was not killed: {}", robot.said());
    assert!(robot.works(), "{:?}\n{}", robot.cycles(), robot.said());
    // Replies are corrupted on every bus, and no joint is lost.
    let buses = || {
        let rows = robot.rows();
        let motor = rows.iter().find(|row| row["process"] == "motor").cloned();
        motor.and_then(|row| row["buses"].as_array().cloned()).unwrap_or_default()
    };
    let count = |what: &str| buses().iter().map(|bus| bus[what].as_u64().unwrap_or(0)).sum::<u64>();
    assert!(wait_until(|| count("corrupt") > 50 && count("missed") > 50), "{:?}", buses());
    assert!(wait_until(|| buses().len() == 5 && count("quarantined") == 0), "{:?}", buses());
    // Every joint follows in spite of that.
    let counted = || {
        let output = leo(&["top", "--openmetrics", "--domain"]).arg(robot.domain()).output().expect("runs");
        String::from_utf8(output.stdout).expect("is text")
    };
    assert!(wait_until(|| counted().contains("\nleo_joints{mode=\"following\"} 65\n")), "{}", counted());
    // NaN percepts were refused by the belief process.
    let rows = robot.rows();
    let belief = rows.iter().find(|row| row["process"] == "belief").expect("runs");
    assert!(belief["refused"].as_u64() > Some(0), "{belief}");
    let (status, said) = robot.stop(Signal::INT);
    assert!(status.success(), "{said}");
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn an_invalid_campaign_is_refused_before_any_process_starts() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("campaign.toml");
    for (text, said) in [
        ("bus = [\n\"dorp id=5\"]", "campaign.toml:2:1: `dorp` is no kind of fault"),
        ("[[percepts]]\nkind = \"drop\"\nprobability = 2", "campaign.toml:3"),
        (
            "[[processes]]\nkind = \"kill\"\nprocess = \"mind\"\nat_s = 1",
            "campaign.toml:3:11: `mind` is not a process",
        ),
        ("sede = 1", "seed"),
    ] {
        fs::write(&file, text).expect("writes");
        let output = leo(&["run", "--faults"]).arg(&file).output().expect("runs");
        let wrong = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        assert!(wrong.contains(said), "{wrong}");
    }
}

//! Arming from the page.

use process::emergency;
use serde_json::json;

use crate::page::Page;
use crate::robot::Robot;

/// A robot whose joints are armed only by order.
pub(crate) fn disarmed(name: &str) -> Robot {
    Robot::configured(name, |leo| {
        let automatic = "automatic_arming = \"simulated\"";
        assert_eq!(leo.matches(automatic).count(), 1, "{leo}");
        leo.replace(automatic, "automatic_arming = \"never\"")
    })
}

#[test]
fn a_page_shows_why_joints_are_disarmed_and_arms_them() {
    let robot = disarmed("page-arm");
    let mut page = Page::open(&robot.host);
    page.wait("65 disarmed joints", |cells| {
        cells.get("arming").is_some_and(|arming| arming["disarmed"][0]["count"] == 65)
    });
    let arming = &page.cells["arming"];
    assert_eq!(
        (&arming["joints"], &arming["armed"], &arming["stopped"]),
        (&json!(65), &json!(0), &json!(false))
    );
    assert_eq!(arming["disarmed"][0]["meaning"], message::JointCause::NotStarted.meaning(), "{arming:#}");
    page.must("arm", json!({}));
    page.wait("65 armed joints", |cells| cells.get("arming").is_some_and(|arming| arming["armed"] == 65));
}

#[test]
fn a_page_cannot_arm_during_an_emergency_stop() {
    let robot = disarmed("page-arm-stopped");
    let mut page = Page::open(&robot.host);
    emergency::raise(&robot.domain(), "a test").expect("raised");
    page.wait("the stop", |cells| cells.get("arming").is_some_and(|arming| arming["stopped"] == true));
    let refused = page.ask("arm", json!({ "locks": 0 })).expect_err("nothing is armed");
    assert!(refused.contains("leo emergency-stop --release"), "{refused}");
    assert!(!robot.domain().join("arm").exists(), "no order stands");
    emergency::release(&robot.domain()).expect("released");
}

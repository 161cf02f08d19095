//! A line of sight that is known with an uncertainty.

use clock::Duration;
use message::{Header, Remembered};

use super::workspace::{Workspace, block, person};
use crate::settings::Perspective;

const SECOND: Duration = Duration::from_secs(1);
const EYE: [f64; 3] = [1.5, 0.0, 0.03];
/// Straight ahead, towards the robot.
const AHEAD: [f64; 3] = [0.0, 0.0, 0.03];

/// A partner whose cone has a half angle of 60 degrees, and this standard deviation.
fn looking(gaze_sd_deg: f64) -> Workspace {
    let mut config = Perspective::builtin();
    config.sight.gaze_sd_deg = gaze_sd_deg.try_into().unwrap();
    Workspace::with(&config)
}

/// A small block 1 m from the eye, at an angle from the line of sight.
fn at_angle(angle_deg: f32) -> message::Observation {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    message::Observation { half_extents_m: [0.001; 3], ..block([1.5 - cos, sin, 0.03]) }
}

/// The partner's confidence in the position of a block at an angle, if they perceive it.
fn confidence(gaze_sd_deg: f64, angle_deg: f32) -> Option<f32> {
    let mut world = looking(gaze_sd_deg);
    world.run(SECOND, &[person(EYE, AHEAD), at_angle(angle_deg)]);
    let place = world.percepts.index("position").unwrap();
    let his = world.his();
    let head = world.partner.head(Header::at(0));
    assert_eq!((head.perceivable, head.hidden), if his.is_empty() { (0, 1) } else { (1, 0) });
    his.first().and_then(|belief| belief.percept(place)).map(|remembered: &Remembered| remembered.confidence)
}

#[test]
fn with_an_uncertain_gaze_the_edge_of_the_cone_is_soft() {
    // 0.95 is the confidence of the source; of the normal distribution at 6, 1, 0.2, 0 and -1 standard deviations.
    for (angle_deg, expected) in
        [(30.0, Some(0.95)), (55.0, Some(0.799)), (59.0, Some(0.550)), (60.5, None), (65.0, None)]
    {
        let found = confidence(5.0, angle_deg);
        assert_eq!(found.is_some(), expected.is_some(), "{angle_deg} {found:?}");
        assert!((found.unwrap_or(0.0) - expected.unwrap_or(0.0)).abs() < 0.002, "{angle_deg} {found:?}");
    }
    // A hard edge, as in the paper.
    assert_eq!(confidence(0.0, 59.0), Some(0.95));
    assert_eq!(confidence(0.0, 61.0), None);
}

#[test]
fn an_absence_is_noticed_only_where_the_partner_certainly_looks() {
    for (gaze_sd_deg, angle_deg, left) in [(0.0, 52.0, 0), (5.0, 52.0, 1), (5.0, 40.0, 0)] {
        let mut world = looking(gaze_sd_deg);
        world.run(SECOND, &[person(EYE, AHEAD), at_angle(angle_deg)]);
        assert_eq!(world.his().len(), 1, "{gaze_sd_deg} {angle_deg}");
        world.run(SECOND, &[person(EYE, AHEAD)]);
        assert_eq!(world.his().len(), left, "{gaze_sd_deg} {angle_deg}");
    }
}

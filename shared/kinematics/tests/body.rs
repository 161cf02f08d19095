//! Tests of the kinematics of the robot's own body.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "helpers of tests may fail them")]

use std::sync::LazyLock;

use geometry::Position;
use kinematics::{ARM_JOINTS, Body, BodyErrorKind, HandGoal, Side};
use proptest::prelude::*;

const URDF: &str = include_str!("../leo.urdf");

fn names() -> Vec<&'static str> {
    URDF.lines()
        .filter(|line| line.contains("\"revolute\""))
        .filter_map(|line| line.split('"').nth(1))
        .collect()
}

fn leo() -> &'static Body {
    static LEO: LazyLock<Body> =
        LazyLock::new(|| Body::from_urdf(URDF, &names()).expect("config/leo.urdf is a body"));
    &LEO
}

/// Arms slightly forward with the elbows bent: a good start for a grasp from above.
fn seed(body: &Body) -> Vec<f64> {
    let mut seed = vec![0.0; body.joints().len()];
    for (side, sign) in [("left", 1.0), ("right", -1.0)] {
        for (part, position) in [
            ("shoulder_pitch", -0.5),
            ("shoulder_roll", 0.5 * sign),
            ("elbow_pitch", -1.4),
            ("wrist_pitch", 1.2),
        ] {
            let joint = body.joint(&format!("{side}_{part}_joint")).expect("a joint of the arm");
            seed[joint] = position;
        }
    }
    seed
}

fn with_arm(body: &Body, side: Side, positions: &[f64], arm: [f64; ARM_JOINTS]) -> Vec<f64> {
    let mut all = positions.to_vec();
    for (joint, position) in body.arm_joints(side).into_iter().zip(arm) {
        all[joint] = position;
    }
    all
}

fn assert_within_limits(body: &Body, side: Side, arm: [f64; ARM_JOINTS]) {
    for (joint, position) in body.arm_joints(side).into_iter().zip(arm) {
        let joint = &body.joints()[joint];
        assert!((joint.lower_rad..=joint.upper_rad).contains(&position), "{} at {position}", joint.name);
    }
}

#[test]
fn the_body_has_sixty_five_joints_seven_in_each_arm() {
    let body = leo();
    assert_eq!(body.joints().len(), 65);
    for side in Side::BOTH {
        let arm = body.arm_joints(side).map(|joint| body.joints()[joint].name.clone());
        let parts = ["shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow_pitch"];
        let wrist = ["wrist_yaw", "wrist_pitch", "wrist_roll"];
        let expected: Vec<_> =
            parts.iter().chain(&wrist).map(|part| format!("{}_{part}_joint", side.name())).collect();
        assert_eq!(arm.to_vec(), expected);
    }
}

#[test]
fn every_point_of_the_table_is_in_reach_from_above() {
    let body = leo();
    let seed = seed(body);
    let (mut seen, mut failed) = (0, Vec::new());
    for x in [0.26, 0.34, 0.42, 0.50] {
        for y in [-0.30, -0.20, -0.10, -0.02, 0.0, 0.02, 0.10, 0.20, 0.30] {
            for z in [0.02, 0.09, 0.16, 0.23, 0.30] {
                // Each arm must reach its own half of the table and 0.1 m beyond.
                for (side, serves) in [(Side::Left, y >= -0.10), (Side::Right, y <= 0.10)] {
                    if !serves {
                        continue;
                    }
                    seen += 1;
                    let goal = Position::new(x, y, z);
                    match body.inverse_kinematics(side, &HandGoal::Down(goal), &seed) {
                        Ok(arm) => {
                            assert_within_limits(body, side, arm);
                            let hand = body.hand(side, &with_arm(body, side, &seed, arm));
                            assert!(hand.origin().distance(&goal) < 1e-3);
                            let fingers = hand.isometry().rotation * nalgebra::Vector3::x();
                            assert!(fingers.z < -0.9999, "fingers point to {fingers}");
                        }
                        Err(why) => failed.push((side, goal, why)),
                    }
                }
            }
        }
    }
    assert_eq!(seen, 4 * 5 * (7 + 7));
    assert!(failed.is_empty(), "{} of {seen}: {failed:#?}", failed.len());
}

proptest! {
    #[test]
    fn inverse_kinematics_finds_any_reachable_pose_of_an_arm(
        left in any::<bool>(), shares in prop::array::uniform7(0.0..=1.0), lean in -0.2..0.5,
    ) {
        let body = leo();
        let side = if left { Side::Left } else { Side::Right };
        let mut seed = seed(body);
        seed[body.joint("torso_pitch_joint").expect("a torso")] = lean;
        let arm = {
            let mut shares = shares.into_iter();
            body.arm_joints(side).map(|joint| {
                let joint = &body.joints()[joint];
                let share: f64 = shares.next().expect("a share for each joint");
                joint.lower_rad + share * (joint.upper_rad - joint.lower_rad)
            })
        };
        let goal = body.hand(side, &with_arm(body, side, &seed, arm));
        let found = body.inverse_kinematics(side, &HandGoal::Pose(goal), &seed);
        prop_assert!(found.is_ok(), "{:?}", found);
        let found = found.expect("just checked");
        assert_within_limits(body, side, found);
        let (distance_m, angle_rad) = goal.difference(&body.hand(side, &with_arm(body, side, &seed, found)));
        prop_assert!(distance_m < 1e-3 && angle_rad < 0.5_f64.to_radians(), "{distance_m} m, {angle_rad} rad");
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_hand(shares in prop::array::uniform7(0.0..=1.0)) {
        let body = leo();
        let side = Side::Right;
        let positions = with_arm(body, side, &seed(body), shares);
        let jacobian = body.jacobian(side, &positions);
        let step = 1e-6;
        for (column, joint) in body.arm_joints(side).into_iter().enumerate() {
            let (mut before, mut after) = (positions.clone(), positions.clone());
            before[joint] -= step;
            after[joint] += step;
            let (before, after) = (body.hand(side, &before), body.hand(side, &after));
            let slope = (after.isometry().translation.vector - before.isometry().translation.vector) / (2.0 * step);
            let turn = (after.isometry().rotation * before.isometry().rotation.inverse()).scaled_axis() / (2.0 * step);
            prop_assert!((jacobian.fixed_view::<3, 1>(0, column) - slope).norm() < 1e-6);
            prop_assert!((jacobian.fixed_view::<3, 1>(3, column) - turn).norm() < 1e-6);
        }
    }
}

#[test]
fn an_unreachable_point_reports_the_remaining_distance() {
    let body = leo();
    let error = body
        .inverse_kinematics(Side::Left, &HandGoal::Down(Position::new(2.0, 0.0, 0.2)), &seed(body))
        .expect_err("2 m away");
    assert!(error.distance_m > 1.0, "{error}");
}

#[test]
fn inverse_kinematics_is_deterministic() {
    let body = leo();
    let goal = HandGoal::Down(Position::new(0.3, -0.3, 0.3));
    let ask = || body.inverse_kinematics(Side::Right, &goal, &vec![0.0; 65]).map(|arm| arm.map(f64::to_bits));
    assert_eq!(ask(), ask());
}

#[test]
fn the_eyes_look_ahead_from_above_the_shoulders() {
    let body = leo();
    for (side, y) in [(Side::Left, 0.03), (Side::Right, -0.03)] {
        let eye = body.eye(side, &[]);
        assert!(eye.origin().distance(&Position::new(0.06, y, 0.62)) < 1e-9, "{eye:?}");
        assert!((eye.isometry().rotation * nalgebra::Vector3::x() - nalgebra::Vector3::x()).norm() < 1e-9);
    }
}

fn refusal(text: &str, names: &[&str]) -> BodyErrorKind {
    Body::from_urdf(text, names).expect_err("it is wrong").kind
}

#[test]
fn an_invalid_urdf_is_refused_with_the_reason() {
    let all = names();
    let more = [&all[..], &["tail_joint"]].concat();
    let crossed = URDF.replacen("lower=\"-0.8\" upper=\"0.8\"", "lower=\"0.8\" upper=\"-0.8\"", 1);
    let ring = URDF.replacen("<parent link=\"base_link\"/>", "<parent link=\"neck_yaw_link\"/>", 1);
    let handless = URDF.replace("left_grasp", "left_paw");
    let no_urdf = refusal("<robot", &all);
    assert!(matches!(no_urdf, BodyErrorKind::Urdf { .. }), "{no_urdf:?}");
    let unlisted = refusal(URDF, &all[1..]);
    assert!(
        matches!(&unlisted, BodyErrorKind::UnlistedJoint { joint } if joint == "torso_yaw_joint"),
        "{unlisted:?}"
    );
    let missing = refusal(URDF, &more);
    assert!(
        matches!(&missing, BodyErrorKind::MissingJoint { joint } if joint == "tail_joint"),
        "{missing:?}"
    );
    let crossed = refusal(&crossed, &all);
    let is_crossed = |lower: f64, upper: f64| lower.total_cmp(&0.8).is_eq() && upper.total_cmp(&-0.8).is_eq();
    assert!(
        matches!(&crossed, BodyErrorKind::Limits { joint, lower_rad, upper_rad, .. }
            if joint == "torso_yaw_joint" && is_crossed(*lower_rad, *upper_rad)),
        "{crossed:?}"
    );
    let ring = refusal(&ring, &all);
    assert!(matches!(ring, BodyErrorKind::Ring { .. }), "{ring:?}");
    let handless = refusal(&handless, &all);
    assert!(matches!(&handless, BodyErrorKind::MissingLink { link } if link == "left_grasp"), "{handless:?}");
    let text = |text: &str| text.to_owned();
    let more = [
        BodyErrorKind::NoAxis { joint: text("torso_yaw_joint") },
        BodyErrorKind::UnknownLink { joint: text("torso_yaw_joint"), link: text("tail") },
        BodyErrorKind::TwoParents { link: text("head"), one: text("neck"), other: text("tail") },
        BodyErrorKind::NoRoot,
        BodyErrorKind::TwoRoots { one: text("base_link"), other: text("tail") },
        BodyErrorKind::ShortArm { link: text("left_grasp"), found: 6 },
    ];
    let all = [unlisted, missing, crossed, ring, handless];
    let wording: Vec<String> = all.iter().chain(&more).map(ToString::to_string).collect();
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn chained_links_are_at_the_positions_of_the_body() {
    let body = leo();
    let positions = seed(body);
    let links: Vec<_> = body.links(&positions).collect();
    for side in Side::BOTH {
        let mut pose = nalgebra::Isometry3::identity();
        let mut name = format!("{}_grasp", side.name());
        while name != body.root() {
            let (parent, _, in_parent) =
                links.iter().find(|(_, child, _)| *child == name).expect("hangs on something");
            pose = in_parent * pose;
            name = (*parent).to_owned();
        }
        let hand = body.hand(side, &positions);
        assert!((pose.to_homogeneous() - hand.isometry().to_homogeneous()).amax() < 1e-12, "{side:?}");
    }
    assert!(links.len() > body.joints().len());
}

//! Tests of what a URDF must hold, what it may lack, and how a mistake in it is named.
#![expect(clippy::expect_used, clippy::panic, reason = "helpers of tests may fail them")]

use std::sync::LazyLock;

use kinematics::{Body, BodyError, BodyErrorKind, Side, nearest_ancestors};
use proptest::prelude::*;

const URDF: &str = include_str!("../leo.urdf");

/// The joint that most cases change: its line, and its text.
static TORSO_YAW: LazyLock<(usize, &str)> = LazyLock::new(|| {
    let lines = URDF.lines().enumerate();
    let mut found = lines.filter(|(_, line)| line.contains("<joint name=\"torso_yaw_joint\""));
    found.next().map_or((0, ""), |(line, text)| (line + 1, text))
});

fn names() -> Vec<&'static str> {
    URDF.lines()
        .filter(|line| line.contains("\"revolute\""))
        .filter_map(|line| line.split('"').nth(1))
        .collect()
}

/// The URDF of Leo with the first occurrence of a text replaced after the beginning of `after`.
fn changed(after: &str, from: &str, to: &str) -> String {
    let at = URDF.find(after).unwrap_or_else(|| panic!("no `{after}`"));
    let (head, tail) = URDF.split_at(at);
    assert!(tail.contains(from), "no `{from}` after `{after}`");
    head.to_owned() + &tail.replacen(from, to, 1)
}

fn torso_yaw(from: &str, to: &str) -> String {
    changed("<joint name=\"torso_yaw_joint\"", from, to)
}

fn before_the_end(more: &str) -> String {
    URDF.replace("</robot>", &format!("{more}</robot>"))
}

fn refused(text: &str) -> BodyError {
    Body::from_urdf(text, &names()).expect_err("it is wrong")
}

fn accepted(text: &str) -> Body {
    Body::from_urdf(text, &names()).unwrap_or_else(|error| panic!("{error}"))
}

/// The value of an attribute of the torso's joint, and the text that holds it.
const ATTRIBUTES: [(&str, &str, usize); 7] = [
    ("<origin xyz=\"", "`<origin>`: `xyz`", 3),
    ("rpy=\"", "`<origin>`: `rpy`", 3),
    ("<axis xyz=\"", "`<axis>`: `xyz`", 3),
    ("lower=\"", "`<limit>`: `lower`", 1),
    ("upper=\"", "`<limit>`: `upper`", 1),
    ("effort=\"", "`<limit>`: `effort`", 1),
    ("velocity=\"", "`<limit>`: `velocity`", 1),
];

#[test]
fn no_joint_has_a_number_that_is_not_finite() {
    let (line, text) = *TORSO_YAW;
    // The origin of this joint has no angles.
    let with_rpy = text.replace("<origin xyz=\"0 0 -0.02\"", "<origin xyz=\"0 0 -0.02\" rpy=\"0 0 0\"");
    let mut seen = 0;
    for (before, shown, count) in ATTRIBUTES {
        let start =
            with_rpy.find(before).map(|at| at + before.len()).unwrap_or_else(|| panic!("no {before}"));
        let (head, tail) = with_rpy.split_at(start);
        let (_, tail) = tail.split_once('"').expect("the end of the value");
        for word in
            ["nan", "NaN", "-nan", "inf", "-inf", "Infinity", "1e400", "-1e999", "0,5", "0x1p3", "${x}"]
        {
            for place in 0..count {
                let value: Vec<&str> = (0..count).map(|at| if at == place { word } else { "0" }).collect();
                let value = value.join(" ");
                let error = refused(&URDF.replace(text, &format!("{head}{value}\"{tail}")));
                assert_eq!(error.line, line, "{error}");
                let expected = format!(
                    "joint `torso_yaw_joint`: {shown} is \"{value}\": `{word}` is not a finite number"
                );
                assert_eq!(error.kind.to_string(), expected);
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 11 * (3 * 3 + 4));
}

#[test]
fn no_other_number_of_a_urdf_is_not_finite_either() {
    let parts = [
        "<link name=\"a\"><inertial><origin xyz=\"0 X 0\"/></inertial></link>",
        "<link name=\"a\"><inertial><mass value=\"X\"/></inertial></link>",
        "<link name=\"a\"><inertial><inertia ixx=\"1\" ixy=\"X\"/></inertial></link>",
        "<link name=\"a\"><inertial><inertia izz=\"X\"/></inertial></link>",
        "<link name=\"a\"><visual><origin rpy=\"0 0 X\"/></visual></link>",
        "<link name=\"a\"><visual><geometry><box size=\"1 X 1\"/></geometry></visual></link>",
        "<link name=\"a\"><collision><geometry><cylinder radius=\"X\" length=\"1\"/></geometry></collision></link>",
        "<link name=\"a\"><collision><geometry><capsule radius=\"1\" length=\"X\"/></geometry></collision></link>",
        "<link name=\"a\"><visual><geometry><sphere radius=\"X\"/></geometry></visual></link>",
        "<link name=\"a\"><visual><geometry><mesh filename=\"f\" scale=\"X X X\"/></geometry></visual></link>",
        "<link name=\"a\"><visual><material><color rgba=\"1 1 X 1\"/></material></visual></link>",
        "<material name=\"a\"><color rgba=\"1 1 X 1\"/></material>",
        "<joint name=\"a\" type=\"fixed\"><mimic joint=\"b\" multiplier=\"X\"/></joint>",
        "<joint name=\"a\" type=\"fixed\"><mimic joint=\"b\" offset=\"X\"/></joint>",
        "<joint name=\"a\" type=\"fixed\"><dynamics damping=\"X\"/></joint>",
        "<joint name=\"a\" type=\"fixed\"><calibration rising=\"X\"/></joint>",
        "<joint name=\"a\" type=\"fixed\"><safety_controller k_velocity=\"X\"/></joint>",
        "<joint name=\"a\" type=\"fixed\"><axis xyz=\"X 0 1\"/></joint>",
    ];
    let last = URDF.lines().count();
    for part in parts {
        for word in ["nan", "-inf", "1e400"] {
            let error = refused(&before_the_end(&part.replace('X', word)));
            assert_eq!(error.line, last, "{error}");
            let said = error.kind.to_string();
            assert!(
                said.contains(&format!("`{word}` is not a finite number")) && said.contains(" `a`: `<"),
                "{said}"
            );
        }
    }
}

#[test]
fn a_place_or_an_angle_beyond_reason_is_refused() {
    for (from, to, words) in [
        ("<origin xyz=\"", "<origin xyz=\"100 0 0\" was=\"", "100 is beyond 10 metres"),
        ("<origin xyz=\"", "<origin xyz=\"0 -10.5 0\" was=\"", "-10.5 is beyond 10 metres"),
        ("<origin xyz=\"", "<origin xyz=\"0 0 1e300\" was=\"", "1e300 is beyond 10 metres"),
        ("<origin xyz=\"", "<origin rpy=\"0 90 0\" xyz=\"", "90 is beyond 10 radians"),
    ] {
        let error = refused(&torso_yaw(from, to));
        assert_eq!(error.line, TORSO_YAW.0);
        let said = error.kind.to_string();
        assert!(said.starts_with("joint `torso_yaw_joint`: `<origin>`: ") && said.contains(words), "{said}");
    }
    let far = "<link name=\"a\"><visual><origin xyz=\"0 0 200\"/></visual></link>";
    let said = refused(&before_the_end(far)).kind.to_string();
    assert!(said.starts_with("link `a`: `<origin>`: `xyz`"), "{said}");
}

#[test]
fn a_large_axis_turns_as_its_direction_says() {
    let [usual, large] = ["", "0 0 1e200"].map(|axis| {
        let text = if axis.is_empty() {
            URDF.to_owned()
        } else {
            torso_yaw("<axis xyz=\"0 0 1\"", &format!("<axis xyz=\"{axis}\""))
        };
        let body = accepted(&text);
        let yaw = body.joint("torso_yaw_joint").expect("the joint");
        let mut positions_rad = vec![0.0; body.joints().len()];
        *positions_rad.get_mut(yaw).expect("a position") = 0.5;
        body.hand(Side::Left, &positions_rad).isometry().translation.vector
    });
    assert!((usual - large).norm() < 1e-12 && usual.y.abs() > 0.1, "{usual} {large}");
}

#[test]
fn a_name_that_is_there_twice_is_refused_with_both_lines() {
    let last = URDF.lines().count();
    let joint = "<link name=\"extra\"/><joint name=\"torso_yaw_joint\" type=\"revolute\">\
        <parent link=\"base_link\"/><child link=\"extra\"/><limit lower=\"-2.8\" upper=\"2.8\" velocity=\"9\"/></joint>";
    let first = TORSO_YAW.0;
    let error = refused(&before_the_end(joint));
    assert_eq!((error.line, error.kind.to_string()), (last, twice("joint `torso_yaw_joint`", first)));
    // The type does not matter, and neither does which of both is first.
    let error = refused(&before_the_end(&joint.replace("revolute", "fixed")));
    assert_eq!(error.kind.to_string(), twice("joint `torso_yaw_joint`", first));
    let error = refused(&URDF.replacen("<material", &format!("{joint}<material"), 1));
    assert_eq!((error.line, error.kind.to_string()), (first, twice("joint `torso_yaw_joint`", 5)));

    let base = URDF.lines().position(|line| line.contains("<link name=\"base_link\"")).expect("a base") + 1;
    let error = refused(&before_the_end("<link name=\"base_link\"/>"));
    assert_eq!((error.line, error.kind.to_string()), (last, twice("link `base_link`", base)));

    for part in
        ["<origin xyz=\"0 0 1\"/>", "<axis xyz=\"1 0 0\"/>", "<limit/>", "<parent link=\"base_link\"/>"]
    {
        let tag = part.trim_start_matches('<').split([' ', '/']).next().unwrap_or_default();
        let error = refused(&torso_yaw("</joint>", &format!("{part}</joint>")));
        let said = twice(&format!("joint `torso_yaw_joint`: `<{tag}>`"), first);
        assert_eq!((error.line, error.kind.to_string()), (first, said));
    }
}

fn twice(element: &str, line: usize) -> String {
    format!("{element} is there twice; the first is in line {line}: remove or rename one")
}

#[test]
fn a_joint_with_a_servo_follows_no_other_joint() {
    let mimic = "<mimic joint=\"torso_pitch_joint\" multiplier=\"-1\"/>";
    let error = refused(&torso_yaw("</joint>", &format!("{mimic}</joint>")));
    assert_eq!(error.line, TORSO_YAW.0);
    assert!(matches!(&error.kind, BodyErrorKind::Mimic { joint } if joint == "torso_yaw_joint"), "{error}");
    // A fixed joint has no servo.
    let fixed = "<link name=\"tail\"/><joint name=\"tail_joint\" type=\"fixed\"><parent link=\"base_link\"/>\
        <child link=\"tail\"/><mimic joint=\"torso_pitch_joint\"/></joint>";
    accepted(&before_the_end(fixed));
}

#[test]
fn what_is_never_used_may_be_incomplete() {
    let links = [
        "<visual/>",
        "<visual><geometry/></visual>",
        "<visual><geometry><mesh/></geometry></visual>",
        "<visual><geometry><mesh filename=\"a.dae\" scale=\"0.001\"/></geometry></visual>",
        "<visual><geometry><mesh filename=\"a.dae\" scale=\"\"/></geometry></visual>",
        "<visual><geometry><sphere/></geometry></visual>",
        "<visual><geometry><torus radius=\"wide\"/></geometry></visual>",
        "<visual><origin xyz=\"0 0\"/><geometry><box/></geometry><material/></visual>",
        "<visual><material name=\"a\"><color/></material></visual>",
        "<visual><material name=\"a\"><color rgba=\"1 1 1\"/></material></visual>",
        "<visual><material name=\"a\"><texture/></material></visual>",
        "<visual><material name=\"a\"><texture filename=\"\"/></material></visual>",
        "<collision/>",
        "<collision><geometry/><verbose value=\"Zero\"/></collision>",
        "<inertial/>",
        "<inertial><mass/><inertia ixx=\"1\"/></inertial>",
        "<inertial><origin/></inertial><inertial/>",
        "<sensor type=\"nan\"/>",
        "<sensor><origin xyz=\"nan 0 0\"/><mass value=\"heavy\"/></sensor>",
        "<visual><shell><origin xyz=\"nan 0 0\"/></shell></visual>",
    ];
    let rest = [
        "<material/><material/>",
        "<material name=\"fur\"><texture/></material><material name=\"fur\"/>",
        "<gazebo/>",
        "<gazebo reference=\"none\"><mu1>nan</mu1><origin xyz=\"nan\"/><joint name=\"torso_yaw_joint\"/></gazebo>",
        "<transmission><joint name=\"torso_yaw_joint\"/><joint name=\"torso_yaw_joint\"/></transmission>",
        "<transmission><actuator name=\"m\"><mechanicalReduction>many</mechanicalReduction></actuator></transmission>",
        "<sensor:camera name=\"eye\"/>",
        "<ros2_control><joint name=\"torso_yaw_joint\"><limit lower=\"low\"/></joint></ros2_control>",
    ];
    for content in links {
        let link = format!(
            "<link name=\"tail\">{content}</link><joint name=\"tail_joint\" type=\"fixed\">\
            <parent link=\"base_link\"/><child link=\"tail\"/></joint>"
        );
        accepted(&before_the_end(&link));
    }
    rest.iter().for_each(|more| drop(accepted(&before_the_end(more))));
    for (from, to) in [
        ("<robot name=\"leo\">", "<robot>"),
        (" effort=\"", " was=\""),
        ("</joint>", "<dynamics/><calibration/><safety_controller/></joint>"),
        ("</joint>", "<sensor><axis xyz=\"nan\"/></sensor></joint>"),
    ] {
        accepted(&changed("<robot", from, to));
    }
}

#[test]
fn a_missing_part_is_named_with_its_joint_and_line() {
    let cases = [
        (" type=\"revolute\"", "", "joint `torso_yaw_joint` has no `type`"),
        (" velocity=\"", " speed=\"", "joint `torso_yaw_joint`: `<limit>` has no `velocity`"),
        ("<limit ", "<limits ", "joint `torso_yaw_joint` has no `<limit>`"),
        ("<parent ", "<parents ", "joint `torso_yaw_joint` has no `<parent>`"),
        ("<child link", "<child name", "joint `torso_yaw_joint`: `<child>` has no `link`"),
        ("<axis xyz", "<axis xy", "joint `torso_yaw_joint`: `<axis>` has no `xyz`"),
        ("name=\"torso_yaw_joint\" ", "", "a `<joint>` has no `name`"),
        ("name=\"torso_yaw_joint\"", "name=\" \"", "a `<joint>` has no `name`"),
        ("<axis xyz=\"0 0 1\"", "<axis xyz=\"0 1\"", "3 numbers are needed, and not 2"),
        ("<origin xyz=\"", "<origin xyz=\"0 ", "3 numbers are needed, and not 4"),
        ("lower=\"-0.8\"", "lower=\"\"", "1 number is needed, and not 0"),
        (
            "type=\"revolute\"",
            "type=\"hinge\"",
            "`type` is \"hinge\": it must be one of revolute, continuous",
        ),
        ("type=\"revolute\"", "type=\"prismatic\"", "joint `torso_yaw_joint` is of type `prismatic`"),
        ("type=\"revolute\"", "type=\"fixed\"", "joint `torso_yaw_joint` is of type `fixed`"),
        ("child link=\"", "child link=\"un", "joins a link `untorso_yaw_link`"),
        ("axis xyz=\"0 0 1\"", "axis xyz=\"0 0 1e-9\"", "its axis has no length"),
    ];
    for (from, to, words) in cases {
        let error = refused(&torso_yaw(from, to));
        assert_eq!(error.line, TORSO_YAW.0, "{error}");
        assert!(error.kind.to_string().contains(words), "{error}");
    }
    // From URDF 1.2 on, an omitted limit is no limit.
    let text = torso_yaw("lower=\"-0.8\"", "");
    assert!(
        accepted(&text)
            .joints()
            .iter()
            .any(|joint| joint.name == "torso_yaw_joint" && joint.lower_rad.abs() < 1e-9)
    );
    let error = refused(&text.replace("<robot name", "<robot version=\"1.2\" name"));
    assert_eq!(error.kind.to_string(), "joint `torso_yaw_joint`: `<limit>` has no `lower`");
}

#[test]
fn an_orientation_is_given_by_angles_or_a_quaternion() {
    let with = |version: &str, origin: &str| {
        let text = torso_yaw("<origin xyz=\"", &format!("<origin {origin} xyz=\""));
        text.replacen("<robot", &format!("<robot version=\"{version}\""), 1)
    };
    let ahead = |body: &Body| body.hand(Side::Left, &[]).isometry().translation.vector;
    let angles = ahead(&accepted(&with("1.0", "rpy=\"0 0 1.5707963267948966\"")));
    let quaternion = "quat_xyzw=\"0 0 0.70710678118654752 0.70710678118654752\"";
    assert!((ahead(&accepted(&with("1.1", quaternion))) - angles).norm() < 1e-9);
    for version in ["1.0", "1", "one.one", ""] {
        let error = refused(&with(version, quaternion));
        assert_eq!(error.line, TORSO_YAW.0);
        let said = error.kind.to_string();
        assert!(said.starts_with("joint `torso_yaw_joint`: `<origin>`: `quat_xyzw` is \"0 0 0.7"), "{said}");
        assert!(said.ends_with(": it needs `version=\"1.1\"` in `<robot>`; without it, use `rpy`"), "{said}");
    }
    let both = refused(&with("1.1", &format!("rpy=\"0 0 0\" {quaternion}"))).kind.to_string();
    assert!(both.contains("`rpy` is there too"), "{both}");
    for (value, words) in [("0 0 0 0", "no direction"), ("0 0 1", "4 numbers"), ("0 nan 0 1", "`nan`")] {
        let said = refused(&with("1.1", &format!("quat_xyzw=\"{value}\""))).kind.to_string();
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn another_document_is_not_a_urdf() {
    for text in ["", "<sdf version=\"1.6\"/>", "<robot>", "{}", "<robot/><robot/>"] {
        let error = refused(text);
        assert!(matches!(error.kind, BodyErrorKind::Urdf { .. }), "{error}");
        assert!(nearest_ancestors(text, &[]).is_err());
    }
}

/// A body with many more links, each fixed to the one before.
fn with_many_links(count: usize) -> String {
    let mut more = String::new();
    for number in 0..count {
        let parent = if number == 0 { "base_link".to_owned() } else { format!("l{}", number - 1) };
        more += &format!(
            "<joint name=\"j{number}\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"l{number}\"/></joint>\
            <link name=\"l{number}\"/>\n"
        );
    }
    before_the_end(&more)
}

/// With loops within loops over the links, this test would take minutes.
#[test]
fn many_links_are_read_in_a_moment() {
    const COUNT: usize = 30_000;
    let text = with_many_links(COUNT);
    assert!(accepted(&text).links(&[]).count() > COUNT);
    let last = format!("j{}", COUNT - 1);
    assert_eq!(nearest_ancestors(&text, &["j0", &last]).expect("a tree"), [None, Some(0)]);
    let again = text.replace("</robot>", "<link name=\"l7\"/></robot>");
    assert!(matches!(refused(&again).kind, BodyErrorKind::Twice { .. }));
    // The chain hangs on its own end: it is a loop beside the body.
    let looped = text.replacen(
        "<parent link=\"base_link\"/><child link=\"l0\"/>",
        &format!("<parent link=\"l{}\"/><child link=\"l0\"/>", COUNT - 1),
        1,
    );
    let error = refused(&looped);
    assert!(matches!(&error.kind, BodyErrorKind::Ring { link } if link == "l0"), "{error}");
}

#[test]
fn a_long_name_is_shown_shortened() {
    let long = "l".repeat(100_000);
    let said = [
        refused(&torso_yaw("child link=\"", &format!("child link=\"{long}"))),
        refused(&torso_yaw("name=\"", &format!("name=\"{long}"))),
        refused(&before_the_end(&format!("<link name=\"{long}\"/><link name=\"{long}\"/>"))),
        refused(&before_the_end(&format!("<link name=\"{long}\"/>"))),
    ];
    for said in said.map(|error| error.to_string()) {
        assert!(said.contains(&format!("`{}…`", "l".repeat(60))) && said.len() < 300, "{said}");
    }
    // A mark that turns the direction of the text is no control character, and still not printed.
    let said = refused(&before_the_end("<link name=\"a\u{202e}b\"/>")).to_string();
    assert!(said.contains("`a\\u{202e}b`"), "{said}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_damaged_urdf_is_refused_or_gives_finite_poses(
        at in 0.0..1.0_f64, removed in 0_usize..40, put in "[ -~]{0,12}",
    ) {
        let length = u32::try_from(URDF.len()).map_or(0.0, f64::from);
        let start = (0..=URDF.len()).rev().find(|start| u32::try_from(*start).map_or(0.0, f64::from) <= at * length);
        let start = start.unwrap_or(0);
        let end = (start + removed).min(URDF.len());
        if let (Some(head), Some(tail)) = (URDF.get(..start), URDF.get(end..)) {
            match Body::from_urdf(&format!("{head}{put}{tail}"), &names()) {
                Ok(body) => {
                    let positions_rad = vec![0.1; body.joints().len()];
                    for (_, link, pose) in body.links(&positions_rad) {
                        prop_assert!(pose.to_homogeneous().iter().all(|number| number.is_finite()), "{}", link);
                    }
                }
                Err(error) => prop_assert!(error.line >= 1 && error.column >= 1),
            }
        }
    }
}

//! `perspective.toml`: what Leo takes a partner to perceive.

use std::path::Path;

use serde::Deserialize;

use crate::number::{Capacity, Coordinate, Milliseconds, NotNegative, OutOfRange, Positive};
use crate::parse;

const BUILTIN: &str = include_str!("../../../config/perspective.toml");

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Perspective {
    /// What a partner sees and hears (V, Eq. 8).
    pub sight: Sight,
    /// The frame of a partner (P, Eq. 9).
    pub frame: Frame,
    /// What is remembered of the things that hide others.
    pub occluders: Occluders,
    /// What the robot itself sees.
    pub robot: Robot,
    /// Whose the things are.
    pub resource: Resource,
}

impl Perspective {
    /// What Leo comes with: `config/perspective.toml` as it was compiled in.
    #[must_use]
    #[expect(clippy::expect_used, reason = "the text is compiled in, and a test parses it")]
    pub fn builtin() -> Self {
        parse(BUILTIN, Path::new("config/perspective.toml")).expect("the built-in file is sound")
    }
}

/// What a partner sees and hears.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sight {
    /// Half the angle of the cone that he sees.
    pub cone_half_angle_deg: Angle,
    /// How far he sees.
    pub range_m: Positive,
    /// Which points of a thing are looked at.
    pub samples: Samples,
    /// How much room round a remembered place must be in view, and empty, before the absence of
    /// the thing is noticed.
    pub empty_margin_m: NotNegative,
    /// How far he hears.
    pub hearing_range_m: Positive,
    /// A partner who has not been observed for this long is absent.
    pub absent_after_ms: Milliseconds,
}

/// Which points of a thing are looked at; it is seen when the majority of them is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Samples {
    /// Its centre.
    Centre,
    /// Its centre and those of its six faces.
    Faces,
    /// Its centre and its eight corners.
    Corners,
}

/// The frame of a partner.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// It is taken anew when he has moved further than this.
    pub reanchor_m: Positive,
    /// It is taken anew when his heading has turned by more than this.
    pub reanchor_deg: Angle,
}

/// What is remembered of the things that hide others.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Occluders {
    /// How many are remembered.
    pub most: Capacity,
    /// An occluder observed this near to where one was last is the same.
    pub same_within_m: Positive,
    /// One whose place is in view, and that has not been observed for this long, is gone.
    pub gone_after_ms: Milliseconds,
}

/// What the robot itself sees.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Where its eye is in its base frame, as long as nobody observes its head.
    pub eye_m: [Coordinate; 3],
    /// What the eye looks at, in its base frame.
    pub looks_at_m: [Coordinate; 3],
    /// Where the absence of a thing is noticed.
    pub field: Field,
}

/// Where the robot would see a thing if one were there.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Field {
    /// Everywhere: its sensory processes survey the whole workspace.
    Everything,
    /// In a cone before its eye, and not behind an occluder.
    Cone {
        /// Half the angle of the cone.
        half_angle_deg: Angle,
        /// How far it sees.
        range_m: Positive,
    },
}

/// Whose the things are, in the eyes of a perspective.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resource {
    /// What decides.
    pub by: Owning,
    /// By territory: how many times wider than the longest link within them the gap between two
    /// clusters must be.
    pub gap_ratio: Positive,
    /// As told: whose what lies where is.
    pub told: Vec<Region>,
}

/// What decides whose a thing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Owning {
    /// Nothing: all is everybody's.
    None,
    /// Where it lies, in one of two groups of things that are apart.
    Territory,
    /// Who last held it.
    Possession,
    /// The regions of the file.
    Told,
}

/// A region of the table and whose what lies in it is.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "WrittenRegion")]
pub struct Region {
    /// The agent: 0 the robot, n partner n.
    pub owner: u16,
    from_m: [Coordinate; 2],
    to_m: [Coordinate; 2],
}

/// A region as the file has it: the agent, and two corners by x and y of the base frame, in metres.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenRegion {
    owner: u16,
    from_m: [Coordinate; 2],
    to_m: [Coordinate; 2],
}

impl TryFrom<WrittenRegion> for Region {
    type Error = String;

    fn try_from(WrittenRegion { owner, from_m, to_m }: WrittenRegion) -> Result<Self, String> {
        if from_m.iter().zip(&to_m).all(|(from, to)| from < to) {
            Ok(Self { owner, from_m, to_m })
        } else {
            Err("a region is empty: each number of `to_m` must be above that of `from_m`".to_owned())
        }
    }
}

impl Region {
    /// Whether it holds a place of the base frame; its sides belong to it.
    #[must_use]
    pub fn holds(&self, place_m: [f64; 2]) -> bool {
        let sides = self.from_m.iter().zip(&self.to_m);
        place_m.iter().zip(sides).all(|(at, (from, to))| from.get() <= *at && *at <= to.get())
    }
}

/// An angle above zero and at most half a turn, in degrees.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Angle(f64);

impl TryFrom<f64> for Angle {
    type Error = OutOfRange;

    fn try_from(value: f64) -> Result<Self, OutOfRange> {
        // Written so that NaN fails.
        if value > 0.0 && value <= 180.0 {
            Ok(Self(value))
        } else {
            Err(OutOfRange::new(value, "above 0 and at most 180 degrees"))
        }
    }
}

impl Angle {
    /// The angle in radians.
    #[must_use]
    pub fn radians(self) -> f64 {
        self.0.to_radians()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_that_comes_with_leo_is_sound() {
        let perspective = Perspective::builtin();
        assert!((perspective.sight.cone_half_angle_deg.radians() - 60_f64.to_radians()).abs() < 1e-12);
        assert_eq!(perspective.robot.field, Field::Everything);
    }

    #[test]
    fn a_cone_wider_than_all_round_is_refused_with_its_line() {
        let text = BUILTIN.replace("cone_half_angle_deg = 60.0", "cone_half_angle_deg = 200.0");
        let said = parse::<Perspective>(&text, Path::new("p.toml")).unwrap_err().to_string();
        assert!(said.starts_with("p.toml:") && said.contains("200") && said.contains("180"), "{said}");
    }

    #[test]
    fn the_robot_may_have_a_cone_of_its_own() {
        let cone = r#"field = { kind = "cone", half_angle_deg = 70.0, range_m = 3.0 }"#;
        let text = BUILTIN.replace(r#"field = { kind = "everything" }"#, cone);
        let perspective = parse::<Perspective>(&text, Path::new("p.toml")).unwrap();
        assert!(matches!(perspective.robot.field, Field::Cone { .. }));
    }

    #[test]
    fn a_region_is_whose_it_is_told_to_be_and_an_empty_one_is_refused() {
        let told = |region: &str| {
            let text = BUILTIN.replace("told = []", &format!("told = [{region}]"));
            parse::<Perspective>(&text, Path::new("p.toml"))
        };
        let region = told("{ owner = 1, from_m = [0.8, -1.0], to_m = [1.2, 1.0] }").unwrap().resource.told[0];
        assert!(region.holds([0.8, 0.0]) && !region.holds([0.7, 0.0]) && !region.holds([f64::NAN, 0.0]));
        let said = told("{ owner = 1, from_m = [0.8, 1.0], to_m = [1.2, 1.0] }").unwrap_err().to_string();
        assert!(said.starts_with("p.toml:") && said.contains("a region is empty"), "{said}");
    }

    #[test]
    fn an_eye_that_is_nowhere_is_refused_with_its_line() {
        let text = BUILTIN.replace("eye_m = [0.06,", "eye_m = [nan,");
        let said = parse::<Perspective>(&text, Path::new("p.toml")).unwrap_err().to_string();
        assert!(said.starts_with("p.toml:") && said.contains("from -100 to 100 m"), "{said}");
    }
}

//! `perspective.toml`: the model of what a partner perceives.

use std::path::Path;

use scene::Samples;
use serde::Deserialize;
use settings::number::{Capacity, Coordinate, Milliseconds, NotNegative, Positive};
use settings::parse;

const BUILTIN: &str = include_str!("../perspective.toml");

/// The content of `perspective.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Perspective {
    /// The visibility and hearing of a partner (V, Eq. 8).
    pub sight: Sight,
    /// The frame of a partner (P, Eq. 9).
    pub frame: Frame,
    /// The memory of occluders.
    pub occluders: Occluders,
    /// The field of view of the robot itself.
    pub robot: Robot,
    /// The ownership of objects.
    pub ownership: Ownership,
}

impl Perspective {
    /// The built-in file, `config/perspective.toml` at compile time.
    #[must_use]
    #[expect(clippy::expect_used, reason = "the text is compiled in, and a test parses it")]
    pub fn builtin() -> Self {
        parse(BUILTIN, Path::new("config/perspective.toml")).expect("the built-in file is sound")
    }
}

/// The visibility and hearing of a partner.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sight {
    /// Half the opening angle of the partner's view cone.
    pub cone_half_angle_deg: Angle,
    /// The range of sight, in metres.
    pub range_m: Positive,
    /// The standard deviation of the line of sight, in degrees. If it is above zero, visibility is a probability.
    #[serde(default)]
    pub gaze_sd_deg: GazeDeviation,
    /// The points of an object that are tested for visibility; the object is seen if the majority is visible.
    pub samples: Samples,
    /// The margin around a remembered position, in metres. It must be in view and empty before the partner notices the
    /// object's absence.
    pub empty_margin_m: NotNegative,
    /// The range of hearing, in metres.
    pub hearing_range_m: Positive,
    /// A partner not observed for this long is absent.
    pub absent_after_ms: Milliseconds,
}

/// The frame of a partner.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// The frame is re-anchored after the partner has moved further than this, in metres.
    pub reanchor_m: Positive,
    /// The frame is re-anchored after the partner's heading has turned further than this.
    pub reanchor_deg: Angle,
}

/// The memory of occluders.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Occluders {
    /// Maximum number of remembered occluders.
    pub max_count: Capacity,
    /// An occluder observed within this distance of a remembered one is the same one, in metres.
    pub association_distance_m: Positive,
    /// An occluder that is in view and not observed for this long is removed.
    pub remove_after_ms: Milliseconds,
}

/// The field of view of the robot itself.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// The eye's position in the base frame, used while no source observes the robot's head.
    pub eye_m: [Coordinate; 3],
    /// The point that the eye looks at, in the base frame.
    pub looks_at_m: [Coordinate; 3],
    /// The region in which the absence of an object is noticed.
    pub field_of_view: Field,
}

/// The region in which the robot would see an object.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Field {
    /// Everywhere; the sensory processes survey the whole workspace.
    Everything,
    /// A cone before the eye, without what occluders hide.
    Cone {
        /// Half the opening angle of the cone.
        half_angle_deg: Angle,
        /// The range of sight, in metres.
        range_m: Positive,
    },
}

/// The ownership of objects, estimated in each perspective.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ownership {
    /// The rule.
    pub rule: OwnershipRule,
    /// For `territory`: the minimum ratio of the gap between two clusters to the longest link within them.
    pub min_gap_ratio: Positive,
    /// For `regions`: the owned regions.
    pub regions: Vec<Region>,
}

/// The rule by which an object's owner is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OwnershipRule {
    /// No ownership: every object is common.
    None,
    /// By position: the two groups of objects that a gap separates.
    Territory,
    /// The agent that held the object last.
    Possession,
    /// The regions in the file.
    Regions,
}

/// A region of the table and its owner.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RawRegion")]
pub struct Region {
    /// The owner: 0 for the robot, n for partner n.
    pub owner: u16,
    from_m: [Coordinate; 2],
    to_m: [Coordinate; 2],
}

/// A region in the file: the owner, and two corners by x and y of the base frame, in metres.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRegion {
    owner: u16,
    from_m: [Coordinate; 2],
    to_m: [Coordinate; 2],
}

impl TryFrom<RawRegion> for Region {
    type Error = String;

    fn try_from(RawRegion { owner, from_m, to_m }: RawRegion) -> Result<Self, String> {
        if from_m.iter().zip(&to_m).all(|(from, to)| from < to) {
            Ok(Self { owner, from_m, to_m })
        } else {
            Err("a region is empty: each number of `to_m` must be above that of `from_m`".to_owned())
        }
    }
}

impl Region {
    /// Whether a position (x, y in the base frame) is in the region, sides included.
    #[must_use]
    pub fn holds(&self, place_m: [f64; 2]) -> bool {
        let sides = self.from_m.iter().zip(&self.to_m);
        place_m.iter().zip(sides).all(|(at, (from, to))| from.get() <= *at && *at <= to.get())
    }
}

settings::ranged!(
    /// An angle above zero and at most half a turn, in degrees.
    Angle(f64): "above 0 and at most 180 degrees", |value| value > 0.0 && value <= 180.0
);

settings::ranged!(
    /// The standard deviation of a line of sight, in degrees; zero by default.
    #[derive(Default)]
    GazeDeviation(f64): "from 0 to 45 degrees", |value| (0.0..=45.0).contains(&value)
);

impl GazeDeviation {
    /// In radians.
    #[must_use]
    pub fn radians(self) -> f64 {
        self.0.to_radians()
    }
}

impl Angle {
    /// In radians.
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
        assert_eq!(perspective.robot.field_of_view, Field::Everything);
    }

    #[test]
    fn a_cone_wider_than_360_degrees_is_refused_with_its_line() {
        let text = BUILTIN.replace("cone_half_angle_deg = 60.0", "cone_half_angle_deg = 200.0");
        let said = parse::<Perspective>(&text, Path::new("p.toml")).unwrap_err().to_string();
        assert!(said.starts_with("p.toml:") && said.contains("200") && said.contains("180"), "{said}");
    }

    #[test]
    fn the_robot_may_have_a_cone_of_its_own() {
        let cone = r#"field_of_view = { kind = "cone", half_angle_deg = 70.0, range_m = 3.0 }"#;
        let text = BUILTIN.replace(r#"field_of_view = { kind = "everything" }"#, cone);
        let perspective = parse::<Perspective>(&text, Path::new("p.toml")).unwrap();
        assert!(matches!(perspective.robot.field_of_view, Field::Cone { .. }));
    }

    #[test]
    fn a_region_has_its_configured_owner_and_an_empty_one_is_refused() {
        let told = |region: &str| {
            let text = BUILTIN.replace("regions = []", &format!("regions = [{region}]"));
            parse::<Perspective>(&text, Path::new("p.toml"))
        };
        let region =
            told("{ owner = 1, from_m = [0.8, -1.0], to_m = [1.2, 1.0] }").unwrap().ownership.regions[0];
        assert!(region.holds([0.8, 0.0]) && !region.holds([0.7, 0.0]) && !region.holds([f64::NAN, 0.0]));
        let said = told("{ owner = 1, from_m = [0.8, 1.0], to_m = [1.2, 1.0] }").unwrap_err().to_string();
        assert!(said.starts_with("p.toml:") && said.contains("region"), "{said}");
    }

    #[test]
    fn an_eye_at_an_invalid_position_is_refused_with_its_line() {
        let text = BUILTIN.replace("eye_m = [0.06,", "eye_m = [nan,");
        let said = parse::<Perspective>(&text, Path::new("p.toml")).unwrap_err().to_string();
        assert!(said.starts_with("p.toml:") && said.contains("from -100 to 100 m"), "{said}");
    }
}

//! The raw form of a lesson file, as serde reads it. A value that the validation may reject carries its position in the
//! text.

use std::collections::BTreeMap;

use serde::Deserialize;
use settings::Spanned;
use settings::number::{Coordinate, Finite, NotNegative, Positive, Seconds, UnitInterval};

use super::{Needs, Role};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lesson {
    pub(super) title: String,
    pub(super) watch: String,
    #[serde(default)]
    pub(super) needs: Needs,
    pub(super) seed: u64,
    pub(super) robot: Robot,
    pub(super) teacher: Vec<Teacher>,
    pub(super) noise: Noise,
    pub(super) table_timing: TableTiming,
    pub(super) colour: BTreeMap<String, [UnitInterval; 3]>,
    pub(super) kind: BTreeMap<String, ObjectKind>,
    #[serde(default)]
    pub(super) demonstration: Vec<Spanned<Table>>,
    pub(super) novel: Option<Spanned<Table>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Robot {
    pub(super) position_m: [Coordinate; 3],
    pub(super) heading_deg: Finite,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Teacher {
    pub(super) number: Spanned<u16>,
    pub(super) eyes_m: [Coordinate; 3],
    pub(super) looks_at_m: Spanned<[Coordinate; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Noise {
    pub(super) position_sd_m: NotNegative,
    pub(super) confidence: UnitInterval,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TableTiming {
    pub(super) empty_s: Seconds,
    pub(super) occluders_first_s: Spanned<Seconds>,
    pub(super) keep_s: Seconds,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObjectKind {
    pub(super) role: Role,
    pub(super) shape: [UnitInterval; 4],
    pub(super) half_extents_m: [Positive; 3],
    pub(super) hole: bool,
    pub(super) markable: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    pub(super) objects: Vec<Object>,
    pub(super) occluders: Vec<Occluder>,
    pub(super) territory: Vec<Territory>,
    pub(super) script: Vec<Spanned<Step>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Object {
    pub(super) name: Spanned<String>,
    pub(super) kind: Spanned<String>,
    pub(super) colour: Spanned<String>,
    pub(super) position_m: [Coordinate; 2],
    /// If absent, the object stands on the table.
    pub(super) underside_m: Option<NotNegative>,
    pub(super) heading_deg: Finite,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Occluder {
    pub(super) name: Spanned<String>,
    pub(super) from_m: [Coordinate; 3],
    pub(super) to_m: Spanned<[Coordinate; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Territory {
    pub(super) owner: Spanned<u16>,
    pub(super) from_m: [Coordinate; 2],
    pub(super) to_m: Spanned<[Coordinate; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Step {
    pub(super) at_s: Spanned<Seconds>,
    pub(super) who: Spanned<u16>,
    pub(super) say: Option<Spanned<String>>,
    #[serde(rename = "move")]
    pub(super) object: Option<Spanned<String>>,
    pub(super) into: Option<Spanned<String>>,
    pub(super) onto: Option<Spanned<String>>,
    pub(super) to_m: Option<Spanned<[Coordinate; 2]>>,
    pub(super) underside_m: Option<Spanned<NotNegative>>,
    pub(super) heading_deg: Option<Spanned<Finite>>,
    pub(super) slide: Option<Spanned<String>>,
    pub(super) look_at_m: Option<Spanned<[Coordinate; 3]>>,
    pub(super) eyes_to_m: Option<Spanned<[Coordinate; 3]>>,
    pub(super) leave: Option<Spanned<bool>>,
    #[serde(rename = "return")]
    pub(super) comes_back: Option<Spanned<bool>>,
    pub(super) duration_s: Option<Spanned<Seconds>>,
}

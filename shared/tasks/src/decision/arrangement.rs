//! A learned spatial configuration.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use geometry::{Base, Person, Pose, Position};
use quantity::distance;
use quantity::number::float_of_count;
use serde::{Deserialize, Serialize};

use super::rule::Standing;
use crate::demonstration::{Effect, Object, Signature, Snapshot, View, changes};

/// Parts of two figures farther apart than this are in different places, in metres.
const SAME_PLACE_M: f64 = 0.04;
/// Sides that differ by no more than this are equal, in metres.
const SAME_SIDE_M: f64 = 0.004;
/// Headings closer than this are equal, in radians.
const SAME_TURN_RAD: f64 = 0.26;

/// A spatial configuration: objects in relative poses, in the frame of the perspective that saw them. It is the goal of
/// a task about positions rather than states.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Arrangement {
    /// The objects, lowest first.
    pub parts: Vec<ArrangementPart>,
}

/// One object of a configuration: its class features (the criteria) and its pose (the expectation).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArrangementPart {
    /// Its class features by name.
    pub features: BTreeMap<String, String>,
    /// Its centre relative to the centroid of the figure in the frame of the perspective (x forward, y left), in
    /// metres; z is above the table.
    pub offset_m: [f64; 3],
    /// Its heading about the vertical in the frame of the perspective, in radians.
    pub heading_rad: Option<f64>,
    /// Half its extents, in metres.
    pub half_extents_m: Option<[f64; 3]>,
}

/// A learned spatial configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct ArrangementRule {
    /// The goal configuration.
    pub arrangement: Arrangement,
    /// Rotation of the copy against the configuration that the robot saw, in radians, in (-π, π]; zero for the
    /// robot's own perspective.
    pub turn_rad: f64,
    /// Its score and rank among the configurations.
    pub standing: Standing,
    /// Its name, generated from the number of parts and the rotation.
    pub name: String,
}

impl Arrangement {
    /// The final configuration of the objects that were moved in a view. `None` if none was, or if one has no
    /// position.
    #[must_use]
    pub fn of(view: &View, moved_m: f64) -> Option<Self> {
        let changes = changes(&view.before, &view.after, moved_m);
        let moved = Signature::from([Effect::Moved]);
        let is_part =
            |object: &&Object| changes.get(&object.id).is_some_and(|change| change.signature == moved);
        let x_frame_base = frame(&view.after).inverse();
        let heading_rad = x_frame_base.heading_rad();
        let part = |object: &Object| {
            Some(ArrangementPart {
                features: object.features.clone(),
                offset_m: (x_frame_base * object.position()?).to_array(),
                heading_rad: object.heading_rad.map(|heading| wrapped(heading + heading_rad)),
                half_extents_m: object.half_extents_m,
            })
        };
        let mut parts =
            view.after.objects.iter().filter(is_part).map(part).collect::<Option<Vec<ArrangementPart>>>()?;
        if parts.is_empty() {
            return None;
        }
        let count = float_of_count(parts.len());
        let mean = |axis: fn(&ArrangementPart) -> f64| parts.iter().map(axis).sum::<f64>() / count;
        let middle = [mean(|part| part.offset_m[0]), mean(|part| part.offset_m[1])];
        // z is not centred: all perspectives share one table.
        let table_m = frame(&view.after).position_m()[2];
        for part in &mut parts {
            let [x, y, z] = part.offset_m;
            part.offset_m = [x - middle[0], y - middle[1], z + table_m];
        }
        parts.sort_by(|a, b| a.offset_m[2].total_cmp(&b.offset_m[2]));
        Some(Self { parts })
    }

    /// Whether two configurations match: a one-to-one assignment of parts with equal features, position and
    /// heading within the tolerances.
    #[must_use]
    pub fn looks_like(&self, other: &Self) -> bool {
        let mut left: Vec<&ArrangementPart> = other.parts.iter().collect();
        let all = self.parts.iter().all(|part| {
            let near = left.iter().enumerate().filter(|(_, other)| part.looks_like(other));
            let nearest = near.min_by(|(_, a), (_, b)| part.distance_m(a).total_cmp(&part.distance_m(b)));
            nearest.map(|(index, _)| index).map(|index| left.swap_remove(index)).is_some()
        });
        all && left.is_empty()
    }
}

impl ArrangementPart {
    /// The rotational symmetry, in radians: π, or π/2 if its sides are equal.
    #[must_use]
    pub fn period_rad(&self) -> f64 {
        let square = self.half_extents_m.is_some_and(|[x, y, _]| (x - y).abs() <= SAME_SIDE_M);
        if square { FRAC_PI_2 } else { PI }
    }

    fn distance_m(&self, other: &Self) -> f64 {
        distance(&self.offset_m, &other.offset_m)
    }

    fn looks_like(&self, other: &Self) -> bool {
        let turned = match (self.heading_rad, other.heading_rad) {
            (Some(a), Some(b)) => {
                let rest = (a - b).rem_euclid(self.period_rad());
                rest.min(self.period_rad() - rest) <= SAME_TURN_RAD
            }
            _ => true,
        };
        turned && self.features == other.features && self.distance_m(other) <= SAME_PLACE_M
    }
}

/// The configuration of an example, if any, and the rotation of a copy against what the robot saw.
#[derive(Clone, Debug)]
pub(crate) struct ShownArrangement {
    arrangement: Option<Arrangement>,
    turn_rad: f64,
}

impl ShownArrangement {
    pub(crate) fn of(view: &View, moved_m: f64) -> Self {
        let turn_rad = wrapped(-frame(&view.after).heading_rad());
        Self { arrangement: Arrangement::of(view, moved_m), turn_rad }
    }
}

/// The configurations shown by the examples of one perspective, best first.
///
/// P(h|D) ∝ P(D|h) P(h) as for object classes. All configurations have the same prior, because they have as many
/// classes and features as parts.
pub(crate) fn rank_arrangements(shown: &[ShownArrangement]) -> Vec<ArrangementRule> {
    let mut rules: Vec<ArrangementRule> = Vec::new();
    for ShownArrangement { arrangement, turn_rad } in shown {
        let Some(arrangement) = arrangement else { continue };
        if let Some(same) = rules.iter_mut().find(|rule| rule.arrangement.looks_like(arrangement)) {
            same.standing.tally += 1;
            continue;
        }
        rules.push(ArrangementRule {
            turn_rad: *turn_rad,
            standing: Standing { tally: 1, examples: shown.len(), ..Standing::default() },
            name: name(arrangement, *turn_rad),
            arrangement: arrangement.clone(),
        });
    }
    rules.sort_by_key(|rule| std::cmp::Reverse(rule.standing.tally));
    let all: usize = rules.iter().map(|rule| rule.standing.tally).sum();
    let best = rules.first().map_or(0, |rule| rule.standing.tally);
    let ahead = |tally: usize, rules: &[ArrangementRule]| {
        rules.iter().filter(|rule| rule.standing.tally > tally).count()
    };
    let ranks: Vec<usize> = rules.iter().map(|rule| 1 + ahead(rule.standing.tally, &rules)).collect();
    for (rule, rank) in rules.iter_mut().zip(ranks) {
        rule.standing.posterior = float_of_count(rule.standing.tally) / float_of_count(all);
        rule.standing.rank = rank;
        rule.standing.high_likelihood = rule.standing.tally == best;
    }
    rules
}

/// The name of a copy of a configuration.
fn name(arrangement: &Arrangement, turn_rad: f64) -> String {
    let things = match arrangement.parts.len() {
        1 => "one thing".to_owned(),
        count => format!("{count} things"),
    };
    if turn_rad.abs() <= SAME_TURN_RAD {
        format!("{things} as they stood before me")
    } else {
        format!("{things} turned by {:.0}°, as they stood before you", turn_rad.to_degrees().abs())
    }
}

/// The levelled frame of a snapshot's perspective.
fn frame(snapshot: &Snapshot) -> Pose<Base, Person> {
    let pose = Pose::from_parts(snapshot.frame_position_m, snapshot.frame_orientation_xyzw);
    pose.unwrap_or_else(Pose::identity).levelled()
}

/// An angle in (-π, π].
fn wrapped(angle_rad: f64) -> f64 {
    let rest = angle_rad.rem_euclid(TAU);
    if rest > PI { rest - TAU } else { rest }
}

/// The positions of a configuration's parts, in the robot's base frame, with the centroid at `middle_m`. The axes of
/// the perspective are aligned with the robot's.
pub fn part_positions<'a>(
    arrangement: &'a Arrangement,
    middle_m: [f64; 2],
) -> impl Iterator<Item = (&'a ArrangementPart, Position<Base>)> + Clone + 'a {
    let [middle_x, middle_y] = middle_m;
    arrangement.parts.iter().map(move |part| {
        let [x, y, z] = part.offset_m;
        (part, Position::new(middle_x + x, middle_y + y, z))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrangements(views: &[&View]) -> Vec<ArrangementRule> {
        rank_arrangements(&views.iter().map(|view| ShownArrangement::of(view, 0.03)).collect::<Vec<_>>())
    }

    /// The view of a teacher opposite the robot, or of the robot itself.
    fn view(perspective: u16, before: &[(&str, f64, f64)], after: &[(&str, f64, f64)]) -> View {
        let heading_rad = if perspective == 0 { 0.0 } else { PI };
        let place_m = if perspective == 0 { 0.0 } else { 1.5 };
        let frame = Pose::<Base, Person>::upright(place_m, 0.0, 0.0, heading_rad);
        let snapshot = |things: &[(&str, f64, f64)]| Snapshot {
            at_ns: 0,
            frame_position_m: frame.position_m(),
            frame_orientation_xyzw: frame.orientation_xyzw(),
            objects: (1..)
                .zip(things)
                .map(|(id, (colour, x, y))| Object {
                    id,
                    features: BTreeMap::from([("colour".to_owned(), (*colour).to_owned())]),
                    position_m: Some([*x, *y, 0.03]),
                    half_extents_m: Some([0.06, 0.02, 0.03]),
                    heading_rad: Some(0.5),
                    ..Object::default()
                })
                .collect(),
        };
        View { perspective, before: snapshot(before), after: snapshot(after), executables: Vec::new() }
    }

    const HEAP: [(&str, f64, f64); 3] = [("red", 1.2, 0.3), ("blue", 1.2, 0.0), ("green", 1.2, -0.3)];
    /// Red is on the robot's left.
    const BUILT: [(&str, f64, f64); 3] = [("red", 0.75, 0.1), ("blue", 0.75, -0.1), ("green", 1.2, -0.3)];

    #[test]
    fn moved_objects_are_the_arrangement_in_the_perspectives_frame() {
        let own = Arrangement::of(&view(0, &HEAP, &BUILT), 0.03).unwrap();
        let his = Arrangement::of(&view(1, &HEAP, &BUILT), 0.03).unwrap();
        let lateral = |arrangement: &Arrangement| {
            arrangement
                .parts
                .iter()
                .map(|part| (part.features["colour"].clone(), (part.offset_m[1] * 100.0).round()))
                .collect::<Vec<_>>()
        };
        assert_eq!(lateral(&own), [("red".to_owned(), 10.0), ("blue".to_owned(), -10.0)]);
        assert_eq!(lateral(&his), [("red".to_owned(), -10.0), ("blue".to_owned(), 10.0)]);
        assert!((his.parts[0].heading_rad.unwrap() - (0.5 - PI)).abs() < 1e-9);
        assert!(!own.looks_like(&his) && own.looks_like(&own));
    }

    #[test]
    fn an_arrangement_is_named_by_the_rotation_of_its_copy() {
        let names = [0, 1].map(|perspective| {
            let view = view(perspective, &HEAP, &BUILT);
            arrangements(&[&view])[0].name.clone()
        });
        assert!(!names[0].contains("180°") && names[1].contains("180°"), "{names:?}");
        insta::assert_snapshot!(names.join("\n"));
    }

    #[test]
    fn the_arrangement_shown_by_most_examples_ranks_first() {
        let shifted = BUILT.map(|(colour, x, y)| (colour, x - 0.2, y + 0.05));
        let other = [("red", 0.75, -0.1), ("blue", 0.75, 0.1), ("green", 1.2, -0.3)];
        let views = [view(0, &HEAP, &other), view(0, &HEAP, &BUILT), view(0, &HEAP, &shifted[..2])];
        let rules = arrangements(&views.iter().collect::<Vec<_>>());
        let seen: Vec<_> = rules
            .iter()
            .map(|rule| (rule.standing.tally, rule.standing.rank, rule.standing.high_likelihood))
            .collect();
        assert_eq!(seen, [(2, 1, true), (1, 2, false)]);
        assert!((rules.iter().map(|rule| rule.standing.posterior).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(arrangements(&[&view(0, &HEAP, &HEAP)]).is_empty(), "nothing was moved");
    }
}

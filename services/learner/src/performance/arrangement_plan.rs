use std::collections::BTreeMap;

use geometry::{Base, Position};
use invariant::require;
use motion::{Skill, Turn};
use tasks::{Arrangement, ArrangementPart, Object, Snapshot, describe_object, part_positions};

use super::free_space::{Footprint, find_free_place};
use super::{Plan, SAME_PLACE_M, Step, half_height_m};
use crate::vocabulary::Vocabulary;

/// An object is in place if it is at most this far from its goal position, in metres.
const IN_PLACE_M: f64 = 0.02;
/// Maximum horizontal distance of a lower object that supports one, in metres.
const BELOW_M: f64 = 0.03;
/// Half the height of an object without perceived extents, in metres.
const HALF_HEIGHT_M: f64 = 0.03;

/// Builds a spatial configuration from objects that match its parts, bottom up.
#[derive(Debug)]
pub(super) struct ArrangementPlan {
    arrangement: Arrangement,
    /// The assignment of objects to places; computed at the first step.
    placings: Option<Vec<Placing>>,
    /// Index of the placing selected last.
    chosen: usize,
}

#[derive(Clone, Debug)]
struct Placing {
    name: String,
    features: BTreeMap<String, String>,
    from_m: [f64; 3],
    to: Position<Base>,
    heading_rad: Option<f64>,
    period_rad: f64,
    state: PlacingState,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PlacingState {
    Open,
    InPlace,
    GivenUp,
}

impl ArrangementPlan {
    pub(super) fn new(arrangement: &Arrangement) -> Self {
        Self { arrangement: arrangement.clone(), placings: None, chosen: 0 }
    }

    /// Assigns objects to parts, and finds a free place for the configuration.
    fn plan(&self, vocabulary: &Vocabulary, own: &Snapshot) -> Result<Vec<Placing>, String> {
        let assign_objects = assign_objects(vocabulary, &self.arrangement, own)?;
        let taken = |object: &Object| assign_objects.iter().any(|taken| taken.id == object.id);
        let others: Vec<Footprint> =
            own.objects.iter().filter(|object| !taken(object)).filter_map(Footprint::of).collect();
        let lying: Vec<Footprint> =
            assign_objects.iter().filter_map(|object| Footprint::of(object)).collect();
        let occupied = [others, lying].concat();
        let middle_m = find_free_place(&self.arrangement, &occupied)
            .ok_or_else(|| format!("I find no free place for {} things", self.arrangement.parts.len()))?;
        // Objects for the same kind of part are interchangeable: each place gets the nearest of them.
        let mut left = assign_objects;
        let mut placings = Vec::new();
        for (part, to) in part_positions(&self.arrangement, middle_m) {
            let fits = left.iter().enumerate().filter(|(_, object)| object.part_features == part.features);
            let nearest = fits.filter_map(|(index, object)| Some((object.position()?.distance(&to), index)));
            let (_, index) = nearest
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .ok_or_else(|| "I do not know where things are".to_owned())?;
            let object = left.swap_remove(index).object;
            placings.push(Placing {
                name: describe_object(&vocabulary.language, object, own.objects.iter()),
                features: object.features.clone(),
                from_m: object.position_m.unwrap_or_default(),
                to,
                heading_rad: part.heading_rad,
                period_rad: part.period_rad(),
                state: PlacingState::Open,
            });
        }
        Ok(placings)
    }

    fn placing(&self) -> Option<&Placing> {
        self.placings.as_ref()?.get(self.chosen)
    }

    fn set_state(&mut self, state: PlacingState) {
        let placing = self.placings.as_mut().and_then(|placings| placings.get_mut(self.chosen));
        if let Some(placing) = require!(placing, "a step was chosen before it ended") {
            placing.state = state;
        }
    }
}

/// An object, and the class features of the part that it is assigned to.
struct AssignedObject<'a> {
    object: &'a Object,
    part_features: BTreeMap<String, String>,
}

impl std::ops::Deref for AssignedObject<'_> {
    type Target = Object;

    fn deref(&self) -> &Object {
        self.object
    }
}

/// Assigns an object to every part, one to one, by equal class features. If there are not enough objects, features are
/// dropped in the order of speech until there are.
fn assign_objects<'a>(
    vocabulary: &Vocabulary,
    arrangement: &Arrangement,
    own: &'a Snapshot,
) -> Result<Vec<AssignedObject<'a>>, String> {
    let names: Vec<&str> = vocabulary.language.features.iter().map(|words| words.name.as_str()).collect();
    let mut missing = String::new();
    for dropped in 0..names.len() {
        let matters = names.get(dropped..).unwrap_or(&[]);
        let alike = |part: &ArrangementPart, object: &Object| {
            matters.iter().all(|name| part.features.get(*name) == object.features.get(*name))
        };
        let mut left: Vec<&Object> =
            own.objects.iter().filter(|object| object.position_m.is_some()).collect();
        let mut actors = Vec::new();
        for part in &arrangement.parts {
            // Equality in these features is an equivalence relation, so a greedy choice is optimal.
            match left.iter().position(|object| alike(part, object)) {
                Some(index) => {
                    actors.push(AssignedObject {
                        object: left.remove(index),
                        part_features: part.features.clone(),
                    });
                }
                None => {
                    let like = Object { features: part.features.clone(), ..Object::default() };
                    let name = describe_object(&vocabulary.language, &like, own.objects.iter());
                    if missing.is_empty() {
                        missing = name;
                    }
                    break;
                }
            }
        }
        if actors.len() == arrangement.parts.len() {
            return Ok(actors);
        }
    }
    Err(format!("I have not enough of what it takes: there is no {missing} left"))
}

impl Plan for ArrangementPlan {
    fn wanted(&self) -> String {
        "in place".to_owned()
    }

    /// Selects the lowest object that is not in place.
    fn choose(&mut self, vocabulary: &Vocabulary, own: &Snapshot) -> Result<Option<Step>, String> {
        let placings = match self.placings.take() {
            Some(placings) => placings,
            None => self.plan(vocabulary, own)?,
        };
        let next = placings.iter().position(|placing| placing.state == PlacingState::Open);
        let step = next.and_then(|index| placings.get(index)).map(|placing| Step {
            name: placing.name.clone(),
            features: placing.features.clone(),
            place_m: placing.to.to_array(),
            wanted: self.wanted(),
            retries: 0,
        });
        self.chosen = next.unwrap_or(0);
        self.placings = Some(placings);
        Ok(step)
    }

    fn is_done(&self, step: &Step, own: &Snapshot) -> Option<bool> {
        own.nearest(&step.features, step.place_m, IN_PLACE_M).map(|_| true)
    }

    fn done(&mut self) {
        self.set_state(PlacingState::InPlace);
    }

    fn give_up(&mut self, _step: &Step) {
        self.set_state(PlacingState::GivenUp);
    }

    /// Always `None`: the work does not start without an object for every part.
    fn missing(&self, _own: &Snapshot) -> Option<String> {
        None
    }

    fn skill(&self, _vocabulary: &Vocabulary, step: &Step, own: &Snapshot) -> Result<Skill, String> {
        let placing = self.placing().ok_or("there is nothing to build")?;
        let placings = self.placings.as_deref().unwrap_or(&[]);
        let is_below = |other: &&Placing| {
            let offset = placing.to.point() - other.to.point();
            offset.z > 0.0 && offset.xy().norm() < BELOW_M && other.state == PlacingState::GivenUp
        };
        if let Some(below) = placings.iter().find(is_below) {
            return Err(format!("the {} that it would stand on is missing", below.name));
        }
        // The object is at its initial position, or where a failed attempt left it.
        let is_free = |object: &Object| {
            !placings.iter().any(|other| {
                other.state == PlacingState::InPlace
                    && object.distance(other.to.to_array()).is_some_and(|away_m| away_m <= IN_PLACE_M)
            })
        };
        let alike = own.objects.iter().filter(|object| object.features == step.features && is_free(object));
        let nearest = alike.filter_map(|object| Some((object.distance(placing.from_m)?, object)));
        let (_, object) = nearest
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(away_m, _)| *away_m <= SAME_PLACE_M || step.retries > 0)
            .ok_or_else(|| format!("the {} is no longer where it was", step.name))?;
        let turn = placing
            .heading_rad
            .zip(object.heading_rad)
            .map(|(shall, is)| Turn { by_rad: shall - is, period_rad: placing.period_rad });
        Ok(Skill::Place {
            thing: object.position().ok_or("I do not know where things are")?,
            half_height_m: half_height_m(object).unwrap_or(HALF_HEIGHT_M),
            to: placing.to,
            turn,
        })
    }
}

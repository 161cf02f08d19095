//! Transforms the memory into a perspective's frame that has moved.

use geometry::{Pose, Position};
use invariant::require;
use message::Feature;
use quantity::number::single;

use super::belief_system::BeliefSystem;
use super::percepts::{Kernel, Range, Region, origin};
use crate::storage::Sample;

impl BeliefSystem {
    /// Expresses all remembered positions and orientations in the perspective's new frame after it moved. `x_new_old`
    /// is the pose of the old frame in the new.
    ///
    /// Regions, and ranges of a position, depend on the frame. Their histories restart with one evaluation of the
    /// remembered position. Vectors of plug-in percepts are not transformed.
    pub fn reanchor<New: Copy, Old: Copy>(&mut self, x_new_old: &Pose<New, Old>) {
        // Rounding may have brought two beliefs closer than they were.
        self.is_clustered = false;
        let position = |position_m: [f32; 3]| position_in(x_new_old, position_m);
        let rotation = x_new_old.rotation();
        for index in 0..self.live_len() {
            let slot = require!(self.beliefs.arena.live().get(index), "belief {index} is live");
            let Some(&slot) = slot else { continue };
            for (number, percept) in (0..).zip(&self.percepts) {
                let Some((histories, row)) = self.beliefs.arena.histories_mut(slot) else { continue };
                match &percept.kernel {
                    Kernel::Position => histories.map(row, number, |feature| moved(x_new_old, feature)),
                    Kernel::Orientation => histories.map(row, number, |feature| turned(x_new_old, feature)),
                    Kernel::Region(_)
                    | Kernel::Range(_)
                    | Kernel::Extents
                    | Kernel::Source
                    | Kernel::State(_)
                    | Kernel::Nearest(_)
                    | Kernel::Plugin(_) => {}
                }
            }
            self.see_places_anew(slot);
            self.beliefs.refresh(slot, None);
            self.beliefs.features.reanchor(slot, position, &rotation);
            self.place(index);
        }
        if let Some(carriers) = &mut self.carriers {
            let turned = |offset_m: [f32; 3]| {
                rotation.map(|row| {
                    single(row.iter().zip(offset_m).map(|(part, metres)| part * f64::from(metres)).sum())
                })
            };
            carriers.reanchor(position, turned);
        }
    }

    /// Re-evaluates regions, and ranges of a position, for the remembered position. Parents come before their children,
    /// so they are already in the new frame.
    fn see_places_anew(&mut self, slot: u32) {
        for (number, percept) in (0..).zip(&self.percepts) {
            let Some((histories, row)) = self.beliefs.arena.histories_mut(slot) else { return };
            let above = percept.parent.and_then(|parent| self.percepts.get(usize::from(parent)));
            let parent = percept.parent.and_then(|parent| histories.newest(row, parent));
            let read = parent.filter(|_| above.is_some_and(|above| percept.kernel.reads(&above.kernel)));
            let sample = match &percept.kernel {
                Kernel::Region(region) => {
                    let of_thing = self.place.and_then(|place| histories.newest(row, place));
                    let of_place = read.filter(|read| read.feature.vector().is_some()).or(of_thing);
                    region_anew(region, of_place, histories.newest(row, number))
                }
                Kernel::Range(range) => match origin(&self.percepts, percept).kernel {
                    Kernel::Position | Kernel::Region(_) => range_anew(range, read, self.threshold),
                    Kernel::Orientation
                    | Kernel::Extents
                    | Kernel::Source
                    | Kernel::State(_)
                    | Kernel::Nearest(_)
                    | Kernel::Range(_)
                    | Kernel::Plugin(_) => continue,
                },
                Kernel::Position
                | Kernel::Orientation
                | Kernel::Extents
                | Kernel::Source
                | Kernel::State(_)
                | Kernel::Nearest(_)
                | Kernel::Plugin(_) => continue,
            };
            let is_asked =
                above.is_none_or(|above| parent.is_some_and(|parent| above.kernel.admits(parent.feature)));
            histories.begin(row, number, sample.filter(|_| is_asked));
        }
    }
}

/// Evaluates a region of a position. Match and confidence are those of its newest sample, or else those of the
/// position.
fn region_anew(region: &Region, of_place: Option<Sample>, newest: Option<Sample>) -> Option<Sample> {
    let of_place = of_place?;
    let degree = if region.holds(of_place.feature.vector()?) { 1.0 } else { 0.0 };
    Some(Sample { feature: Feature::Number(degree), ..newest.unwrap_or(of_place) })
}

/// Evaluates a range of the feature that its parent derived, with the parent's confidence, if it passes (Eq. 2).
fn range_anew(range: &Range, read: Option<Sample>, threshold: f64) -> Option<Sample> {
    let read = read?;
    let degree = range.degree(read.feature)?;
    let matching = Range::matching(degree);
    let passes = f64::from(matching) * f64::from(read.confidence) > threshold;
    passes.then_some(Sample { matching, feature: Feature::Number(degree), ..read })
}

fn moved<New: Copy, Old: Copy>(x_new_old: &Pose<New, Old>, feature: Feature) -> Feature {
    let Feature::Vector(position_m) = feature else { return feature };
    Feature::Vector(position_in(x_new_old, position_m))
}

fn position_in<New: Copy, Old: Copy>(x_new_old: &Pose<New, Old>, [x, y, z]: [f32; 3]) -> [f32; 3] {
    let p_old = Position::<Old>::new(f64::from(x), f64::from(y), f64::from(z));
    (*x_new_old * p_old).to_array().map(single)
}

fn turned<New: Copy, Old: Copy>(x_new_old: &Pose<New, Old>, feature: Feature) -> Feature {
    let Feature::Orientation(xyzw) = feature else { return feature };
    match Pose::<Old, geometry::Thing>::from_parts([0.0; 3], xyzw.map(f64::from)) {
        Some(x_old_thing) => Feature::Orientation((*x_new_old * x_old_thing).orientation_xyzw().map(single)),
        None => feature,
    }
}

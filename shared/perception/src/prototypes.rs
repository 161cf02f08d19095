use message::{Feature, Observation};
use quantity::number::single;

use crate::Evaluation;
use crate::percepts::{Nearest, Space};

/// Dimensions of the widest space.
const DIMENSIONS: usize = 4;

/// The nearest-prototype kernel.
#[derive(Clone)]
pub(crate) struct Prototypes {
    space: Space,
    scale: f64,
    /// Narrower spaces are padded with zeros, which change no distance.
    points: Vec<(u16, [f64; DIMENSIONS])>,
}

impl Prototypes {
    pub(crate) fn new(nearest: &Nearest) -> Self {
        let points = (0..).zip(&nearest.prototypes).map(|(symbol, prototype)| {
            let mut point = [0.0; DIMENSIONS];
            for (to, from) in point.iter_mut().zip(&prototype.at) {
                *to = *from;
            }
            (symbol, point)
        });
        Self { space: nearest.space, scale: nearest.scale.get(), points: points.collect() }
    }

    /// With d₁ and d₂ the distances of the nearest and the second nearest prototype: match max(0, 1 − d₁ / scale), and
    /// confidence 1 − (d₁ / d₂)². The confidence is 0 half way between two prototypes, and 1 if there is only one. Of
    /// equally near ones the first is chosen. No match if the attribute was not observed.
    pub(crate) fn classify(&self, observation: &Observation) -> Evaluation {
        self.point(observation).map_or(Evaluation::NONE, |point| self.nearest(&point))
    }

    /// Classifies a vector that a parent derived: half extents, or linear red, green and blue.
    pub(crate) fn read(&self, vector: [f32; 3]) -> Option<Evaluation> {
        match self.space {
            Space::Shape => None,
            Space::Colour => Some(self.nearest(&colour(vector))),
            Space::EdgeM => Some(self.nearest(&edge(vector))),
        }
    }

    #[inline]
    fn nearest(&self, point: &[f64; DIMENSIONS]) -> Evaluation {
        let (mut symbol, mut nearest, mut second) = (None, f64::INFINITY, f64::INFINITY);
        for (candidate, prototype) in &self.points {
            let squared = squared_distance(prototype, point);
            if squared < nearest {
                second = nearest;
                nearest = squared;
                symbol = Some(*candidate);
            } else if squared < second {
                second = squared;
            }
        }
        let Some(symbol) = symbol else { return Evaluation::NONE };
        let matching = (1.0 - nearest.sqrt() / self.scale).max(0.0);
        let ratio = if nearest > 0.0 { nearest / second } else { 0.0 };
        Evaluation {
            matching: single(matching),
            confidence: single((1.0 - ratio).clamp(0.0, 1.0)),
            feature: Feature::Symbol(symbol),
        }
    }

    /// The point of the observed attribute; `None` if it was not observed.
    fn point(&self, observation: &Observation) -> Option<[f64; DIMENSIONS]> {
        match self.space {
            Space::Shape => observation.shape().map(|shape| shape.map(f64::from)),
            Space::Colour => observation.colour().map(colour),
            Space::EdgeM => observation.half_extents().map(edge),
        }
    }
}

fn colour(rgb: [f32; 3]) -> [f64; DIMENSIONS] {
    let [red, green, blue] = rgb.map(f64::from);
    [red, green, blue, 0.0]
}

fn edge(half_extents_m: [f32; 3]) -> [f64; DIMENSIONS] {
    let volume: f64 = half_extents_m.iter().map(|half| 2.0 * f64::from(*half)).product();
    [volume.cbrt(), 0.0, 0.0, 0.0]
}

fn squared_distance(a: &[f64; DIMENSIONS], b: &[f64; DIMENSIONS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

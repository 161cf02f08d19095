use std::f64::consts::{PI, TAU};

use proptest::prelude::*;
use quantity::number::single;

use super::*;

/// d of two numbers as a plug-in, with q = 0 for all else.
struct Squared;

impl Distance for Squared {
    fn between(&self, one: &Feature, other: &Feature) -> Option<f64> {
        match (one, other) {
            (Feature::Number(one), Feature::Number(other)) => Some(f64::from(one - other).powi(2)),
            _ => None,
        }
    }
}

/// A belief's feature in the notation of Eq. 4: all rotations are about one axis.
#[derive(Clone, Copy, Debug)]
enum Had {
    Nothing,
    Place([f64; 3]),
    TurnRad(f64),
    Number(f64),
    Symbol(u16),
}

/// The axis of all rotations, of unit length.
const AXIS: [f64; 3] = [0.36, 0.48, 0.8];

impl Had {
    fn feature(self) -> Option<Feature> {
        Some(match self {
            Self::Nothing => return None,
            Self::Place(place_m) => Feature::Vector(place_m.map(single)),
            Self::TurnRad(turn_rad) => {
                let (sin, cos) = (turn_rad / 2.0).sin_cos();
                let [x, y, z] = AXIS.map(|part| single(part * sin));
                Feature::Orientation([x, y, z, single(cos)])
            }
            Self::Number(number) => Feature::Number(single(number)),
            Self::Symbol(symbol) => Feature::Symbol(symbol),
        })
    }
}

fn had() -> impl Strategy<Value = Had> {
    prop_oneof![
        1 => Just(Had::Nothing),
        2 => prop::array::uniform3(-2.0..2.0).prop_map(Had::Place),
        2 => (-PI..PI).prop_map(Had::TurnRad),
        2 => (-2.0..2.0).prop_map(Had::Number),
        2 => (0..3_u16).prop_map(Had::Symbol),
    ]
}

fn measures() -> impl Strategy<Value = Measure> {
    let plugin = Measure::Plugin("squared".to_owned());
    prop::sample::select(vec![
        Measure::Metres,
        Measure::AngleRad,
        Measure::Difference,
        Measure::Differs,
        plugin,
    ])
}

/// d, and `None` for q = 0.
fn d(measure: &Measure, a: Had, b: Had) -> Option<f64> {
    match (measure, a, b) {
        (Measure::Metres, Had::Place([x, y, z]), Had::Place([u, v, w])) => {
            Some((x - u).hypot(y - v).hypot(z - w))
        }
        (Measure::AngleRad, Had::TurnRad(a), Had::TurnRad(b)) => {
            // The opposite direction if that is shorter.
            let way_rad = (a - b).abs();
            Some(way_rad.min(TAU - way_rad))
        }
        (Measure::Difference, Had::Number(a), Had::Number(b)) => Some((a - b).abs()),
        (Measure::Differs, Had::Symbol(a), Had::Symbol(b)) => Some(if a == b { 0.0 } else { 1.0 }),
        (Measure::Plugin(_), Had::Number(a), Had::Number(b)) => Some((a - b) * (a - b)),
        _ => None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    /// D = Σ wᵢ·qᵢ·dᵢ (Eq. 4), divided by Σ wᵢ·qᵢ if normalised, written literally.
    #[test]
    fn the_distance_equals_the_weighted_sum_of_the_paper(
        terms in prop::collection::vec(
            (measures(), prop::sample::select(vec![0.0, 0.25, 0.5, 1.0, 2.0]), had(), had(), any::<bool>()), 1..6,
        ),
        threshold in 0.05..4.0_f64, normalised in any::<bool>(), infinite in any::<bool>(),
    ) {
        // In half of the cases the second has a feature of the same kind, so that the term applies.
        let terms: Vec<_> = terms.into_iter().map(|(measure, weight, a, b, alike)| {
            let b = match (alike, a, b) {
                (true, Had::Place(a), _) => Had::Place(a.map(|part| part + 0.01)),
                (true, Had::TurnRad(a), _) => Had::TurnRad(-a),
                (true, Had::Number(a), _) => Had::Number(a + 0.3),
                (true, alike, _) => alike,
                (false, _, b) => b,
            };
            (measure, weight, a, b)
        }).collect();
        let distance: Vec<_> = (0..).zip(&terms).map(|(percept, (measure, weight, ..))| settings::Distance {
            percept, measure: measure.clone(), weight: *weight,
        }).collect();
        let config = MetricSettings {
            threshold,
            normalised,
            no_term_applies: if infinite { NoTermApplies::Infinite } else { NoTermApplies::Zero },
            distance: &distance,
        };
        let metric = Metric::new(&config, |_| Ok::<_, ()>(Arc::new(Squared) as Arc<dyn Distance>)).unwrap();
        let features = |pick: fn(&(Measure, f64, Had, Had)) -> Had| -> Vec<_> {
            let of = |percept: u16| pick(&terms[usize::from(percept)]).feature();
            metric.percepts().map(of).collect()
        };
        let (a, b) = (features(|term| term.2), features(|term| term.3));

        // A term of zero weight does not apply.
        let applying = terms.iter().filter(|term| term.1 > 0.0);
        let applying: Vec<_> =
            applying.filter_map(|(measure, weight, a, b)| Some((weight, d(measure, *a, *b)?))).collect();
        let sum: f64 = applying.iter().map(|(weight, d)| *weight * d).sum();
        let weights: f64 = applying.iter().map(|(weight, _)| *weight).sum();
        let expected = match (applying.is_empty(), normalised) {
            (true, _) if infinite => f64::INFINITY,
            (true, _) => 0.0,
            (false, true) => sum / weights,
            (false, false) => sum,
        };
        let found = metric.below_threshold(&a, &b);
        prop_assert_eq!(found, metric.below_threshold(&b, &a));
        // Features have single precision, and the arc cosine is steep at small angles.
        const ROUNDING: f64 = 5e-3;
        match found {
            Some(found) => prop_assert!((found - expected).abs() < ROUNDING && found < threshold, "{expected}"),
            None => prop_assert!(expected > threshold - ROUNDING, "{expected}"),
        }
    }
}

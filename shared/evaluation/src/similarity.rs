/// A box in the image plane, with its sides along the axes. All four numbers are in one unit, such as pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageBox {
    /// The smaller horizontal coordinate.
    pub left: f64,
    /// The smaller vertical coordinate.
    pub top: f64,
    /// The horizontal side, not negative.
    pub width: f64,
    /// The vertical side, not negative.
    pub height: f64,
}

impl ImageBox {
    /// Intersection over union: 1 for equal boxes, 0 for boxes that do not overlap. It is 0 if either box has no area,
    /// and for invalid numbers.
    ///
    /// ```
    /// use evaluation::ImageBox;
    ///
    /// let one = ImageBox { left: 0.0, top: 0.0, width: 2.0, height: 2.0 };
    /// let other = ImageBox { left: 1.0, ..one };
    /// assert_eq!(one.iou(&other), 2.0 / 6.0);
    /// ```
    #[must_use]
    pub fn iou(&self, other: &Self) -> f64 {
        let is_finite = |place: &Self| {
            [place.left, place.top, place.width, place.height].iter().all(|number| number.is_finite())
        };
        // The smaller and the larger of a number and NaN are the number.
        if !is_finite(self) || !is_finite(other) {
            return 0.0;
        }
        let overlap = |from: [f64; 2], sides: [f64; 2]| {
            let [(begin, side), (other_begin, other_side)] = [(from[0], sides[0]), (from[1], sides[1])];
            ((begin + side).min(other_begin + other_side) - begin.max(other_begin)).max(0.0)
        };
        let horizontal = overlap([self.left, other.left], [self.width, other.width]);
        let vertical = overlap([self.top, other.top], [self.height, other.height]);
        let intersection = horizontal * vertical;
        let union = self.width * self.height + other.width * other.height - intersection;
        if intersection > 0.0 && union > 0.0 { (intersection / union).min(1.0) } else { 0.0 }
    }
}

/// Similarity of two positions in metres: 1 at the same place, 0.5 at the distance `cut_off_m`, 0 from twice that
/// distance on. So a threshold of 0.5 pairs what is at most `cut_off_m` apart, as `TrackEval` does for 3D positions.
/// It is 0 for invalid numbers.
///
/// ```
/// let similarity = evaluation::distance_similarity([0.0, 0.0, 0.0], [0.0, 0.3, 0.4], 0.5);
/// assert_eq!(similarity, 0.5);
/// ```
#[must_use]
pub fn distance_similarity(one_m: [f64; 3], other_m: [f64; 3], cut_off_m: f64) -> f64 {
    let similarity = 1.0 - quantity::distance(&one_m, &other_m) / (2.0 * cut_off_m);
    // NaN fails the comparison.
    if similarity > 0.0 { similarity } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_box() -> impl Strategy<Value = ImageBox> {
        let side = 0.0..50.0_f64;
        (-50.0..50.0_f64, -50.0..50.0_f64, side.clone(), side)
            .prop_map(|(left, top, width, height)| ImageBox { left, top, width, height })
    }

    #[test]
    fn boxes_without_area_or_with_invalid_numbers_are_not_similar() {
        let square = ImageBox { left: 0.0, top: 0.0, width: 1.0, height: 1.0 };
        assert!(square.iou(&square) >= 1.0);
        for other in [
            ImageBox { left: 1.0, ..square },
            ImageBox { width: 0.0, ..square },
            ImageBox { width: f64::NAN, ..square },
            ImageBox { top: f64::NAN, ..square },
            ImageBox { left: f64::INFINITY, ..square },
            ImageBox { height: -1.0, ..square },
        ] {
            assert_eq!((square.iou(&other), other.iou(&square)), (0.0, 0.0), "{other:?}");
        }
        assert!(distance_similarity([0.0; 3], [f64::NAN; 3], 1.0) <= 0.0);
        assert!(distance_similarity([0.0; 3], [0.0; 3], 0.0) <= 0.0);
        assert!(distance_similarity([0.0; 3], [0.0, 0.0, 5.0], 1.0) <= 0.0);
    }

    proptest! {
        #[test]
        fn iou_is_symmetric_and_a_share(one in any_box(), other in any_box()) {
            let iou = one.iou(&other);
            prop_assert!((0.0..=1.0).contains(&iou));
            prop_assert!((iou - other.iou(&one)).abs() < 1e-12);
        }
    }
}

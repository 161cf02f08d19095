//! How pixels become metres, and how metres become a box in the image plane.

use evaluation::ImageBox;

use super::mot::Row;

/// A person's height in metres, where no scale is given: the median height of the detections' boxes.
pub(super) const PERSON_M: f64 = 1.7;
/// How far ahead of the robot's base the image plane is, in metres.
const AHEAD_M: f64 = 2.0;

/// A picture of a fixed camera as a plane ahead of the robot: x is forward, so a pixel to the right is a step along -y,
/// and a pixel down a step along -z. All pixels have one size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Picture {
    pub(super) metres_per_pixel: f64,
    pub(super) frame_rate_hz: f64,
}

impl Picture {
    /// The instant of a frame; frame 1 is at 0.
    pub(super) fn at_ns(&self, frame: u32) -> u64 {
        let seconds = f64::from(frame.saturating_sub(1)) / self.frame_rate_hz;
        u64::try_from(quantity::number::round_i64(seconds * 1.0e9)).unwrap_or(0)
    }

    /// The frame of an instant.
    pub(super) fn frame(&self, at_ns: u64) -> u64 {
        let frame = quantity::number::float(at_ns) * 1.0e-9 * self.frame_rate_hz + 1.0;
        u64::try_from(quantity::number::round_i64(frame)).unwrap_or(0)
    }

    /// The centre of a box in pixels, in the robot's base frame.
    pub(super) fn position_m(&self, place: &ImageBox) -> [f64; 3] {
        let (right, down) = (place.left + place.width / 2.0, place.top + place.height / 2.0);
        [AHEAD_M, -right * self.metres_per_pixel, -down * self.metres_per_pixel]
    }

    /// The size of a box in pixels. It has no depth.
    pub(super) fn size_m(&self, place: &ImageBox) -> [f64; 3] {
        [0.0, place.width * self.metres_per_pixel, place.height * self.metres_per_pixel]
    }

    /// A box in the image plane in pixels.
    pub(super) fn in_pixels(&self, place: &ImageBox) -> ImageBox {
        let pixels = |metres: f64| metres / self.metres_per_pixel;
        ImageBox {
            left: pixels(place.left),
            top: pixels(place.top),
            width: pixels(place.width),
            height: pixels(place.height),
        }
    }
}

/// The box of an object in the image plane, in metres: as seen along x, with its sides along y and z.
pub(super) fn image_box(position_m: [f64; 3], size_m: [f64; 3]) -> ImageBox {
    let [(_, _), (y, width), (z, height)] = [0, 1, 2].map(|axis: usize| {
        let of = |numbers: [f64; 3]| numbers.get(axis).copied().unwrap_or(f64::NAN);
        (of(position_m), of(size_m))
    });
    ImageBox { left: -y - width / 2.0, top: -z - height / 2.0, width, height }
}

/// The scale at which the median height of the boxes is a person's; `None` without boxes.
pub(super) fn scale_of_persons(rows: &[Row]) -> Option<f64> {
    let mut heights: Vec<f64> = rows.iter().map(|row| row.place.height).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).map(|height| PERSON_M / height)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Picture = Picture { metres_per_pixel: 0.01, frame_rate_hz: 25.0 };

    #[test]
    fn a_box_keeps_its_place_through_metres_and_back() {
        let place = ImageBox { left: 100.0, top: 50.0, width: 40.0, height: 170.0 };
        let (position_m, size_m) = (PICTURE.position_m(&place), PICTURE.size_m(&place));
        // Ahead, to the right and below.
        assert!(
            (position_m[0] - 2.0).abs() + (position_m[1] + 1.2).abs() + (position_m[2] + 1.35).abs() < 1e-12
        );
        assert!((size_m[1] - 0.4).abs() + (size_m[2] - 1.7).abs() < 1e-12);
        let again = PICTURE.in_pixels(&image_box(position_m, size_m));
        assert!((1.0 - again.iou(&place)).abs() < 1e-12, "{again:?}");
    }

    #[test]
    fn frames_are_at_the_frame_rate_from_zero() {
        assert_eq!([1, 2, 26].map(|frame| PICTURE.at_ns(frame)), [0, 40_000_000, 1_000_000_000]);
        let odd = Picture { frame_rate_hz: 29.97, ..PICTURE };
        for frame in [1, 2, 3, 1000, 999_999] {
            assert_eq!(odd.frame(odd.at_ns(frame)), u64::from(frame));
        }
    }

    #[test]
    fn the_median_height_is_a_persons() {
        let row = |height| Row {
            frame: 1,
            id: -1,
            place: ImageBox { left: 0.0, top: 0.0, width: 10.0, height },
            confidence: 1.0,
        };
        assert_eq!(scale_of_persons(&[]), None);
        let scale = scale_of_persons(&[row(900.0), row(170.0), row(10.0)]).unwrap();
        assert!((scale - 0.01).abs() < 1e-12, "{scale}");
    }
}

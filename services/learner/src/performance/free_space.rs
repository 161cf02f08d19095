//! Search for free space on the table.

use tasks::{Arrangement, ArrangementPart, Object, part_positions};

/// The workspace of Leo's hands, in metres of its base frame: x forward, y left.
const REACH_X_M: [f64; 2] = [0.28, 0.48];
const REACH_Y_M: [f64; 2] = [-0.28, 0.28];
/// Spacing of the search grid, in metres.
const GRID_M: f64 = 0.01;
/// Clearance around a placed object, in metres.
const MARGIN_M: f64 = 0.012;
/// Half the side length of an object without perceived extents, in metres.
const HALF_SIDE_M: f64 = 0.03;

/// The oriented rectangle that an object covers, seen from above.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    middle_m: [f64; 2],
    half_m: [f64; 2],
    heading_rad: f64,
}

impl Footprint {
    /// The footprint of an object; `None` without a position.
    pub(super) fn of(object: &Object) -> Option<Self> {
        let [x, y, _] = object.position_m?;
        Some(Self {
            middle_m: [x, y],
            half_m: half_sides_m(object.half_extents_m),
            heading_rad: object.heading_rad.unwrap_or(0.0),
        })
    }

    /// Whether the distance of two rectangles is below the margin, by the separating axis theorem: no side direction of
    /// either separates them.
    fn collides(&self, other: &Self) -> bool {
        let [x, y] = [0, 1]
            .map(|axis| other.middle_m.get(axis).unwrap_or(&0.0) - self.middle_m.get(axis).unwrap_or(&0.0));
        [self, other].into_iter().flat_map(Self::sides).all(|[along_x, along_y]| {
            let apart_m = (x * along_x + y * along_y).abs();
            apart_m < self.extent_m([along_x, along_y]) + other.extent_m([along_x, along_y]) + MARGIN_M
        })
    }

    fn sides(&self) -> [[f64; 2]; 2] {
        let (sine, cosine) = self.heading_rad.sin_cos();
        [[cosine, sine], [-sine, cosine]]
    }

    /// Half its extent along a direction.
    fn extent_m(&self, [x, y]: [f64; 2]) -> f64 {
        let sides = self.sides().into_iter().zip(self.half_m);
        sides.map(|([side_x, side_y], half_m)| half_m * (side_x * x + side_y * y).abs()).sum()
    }
}

fn half_sides_m(half_extents_m: Option<[f64; 3]>) -> [f64; 2] {
    half_extents_m.map_or([HALF_SIDE_M; 2], |[x, y, _]| [x, y])
}

/// The centroid position for a configuration such that all parts are within the workspace and collide with nothing. It
/// is the grid point nearest to the centre of the workspace; `None` if there is none.
pub(super) fn find_free_place(arrangement: &Arrangement, occupied: &[Footprint]) -> Option<[f64; 2]> {
    let footprint = |part: &ArrangementPart, x: f64, y: f64| Footprint {
        middle_m: [x, y],
        half_m: half_sides_m(part.half_extents_m),
        heading_rad: part.heading_rad.unwrap_or(0.0),
    };
    let fits = |middle_m: [f64; 2]| {
        part_positions(arrangement, middle_m).all(|(part, to)| {
            let [x, y, _] = to.to_array();
            let within = |at: f64, [from, to]: [f64; 2]| (from..=to).contains(&at);
            let print = footprint(part, x, y);
            within(x, REACH_X_M)
                && within(y, REACH_Y_M)
                && !occupied.iter().any(|other| print.collides(other))
        })
    };
    let along = |[from, to]: [f64; 2]| {
        (0_u32..)
            .map(move |step| f64::from(step).mul_add(GRID_M, from))
            .take_while(move |at| *at <= to + 1e-9)
    };
    let middle = |[from, to]: [f64; 2]| f64::midpoint(from, to);
    let away_m = |[x, y]: [f64; 2]| (x - middle(REACH_X_M)).hypot(y - middle(REACH_Y_M));
    along(REACH_X_M)
        .flat_map(|x| along(REACH_Y_M).map(move |y| [x, y]))
        .filter(|place| fits(*place))
        .min_by(|a, b| away_m(*a).total_cmp(&away_m(*b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn print(middle_m: [f64; 2], half_m: [f64; 2], degrees: f64) -> Footprint {
        Footprint { middle_m, half_m, heading_rad: degrees.to_radians() }
    }

    #[test]
    fn two_bars_collide_depending_on_their_orientations() {
        let bar = print([0.0, 0.0], [0.06, 0.02], 0.0);
        assert!(!bar.collides(&print([0.0, 0.06], [0.06, 0.02], 0.0)), "side by side");
        assert!(bar.collides(&print([0.0, 0.06], [0.06, 0.02], 90.0)), "across");
        assert!(bar.collides(&print([0.07, 0.05], [0.06, 0.02], 45.0)));
        assert!(!bar.collides(&print([0.14, 0.0], [0.06, 0.02], 0.0)), "end to end");
    }

    #[test]
    fn an_arrangement_is_placed_in_free_space_or_not_at_all() {
        let part = |y: f64| ArrangementPart {
            features: std::collections::BTreeMap::new(),
            offset_m: [0.0, y, 0.03],
            heading_rad: None,
            half_extents_m: Some([0.03; 3]),
        };
        let arrangement = Arrangement { parts: vec![part(-0.05), part(0.05)] };
        let free = find_free_place(&arrangement, &[]).unwrap();
        assert!((free[0] - 0.38).abs() < 1e-9 && free[1].abs() < 1e-9, "{free:?}");
        let [x, y] = find_free_place(&arrangement, &[print([0.38, 0.0], [0.05, 0.05], 0.0)]).unwrap();
        assert!((x - 0.38).abs().max(y.abs() - 0.05) >= 0.09, "{x} {y}");
        let table = print([0.38, 0.0], [0.2, 0.3], 0.0);
        assert_eq!(find_free_place(&arrangement, &[table]), None);
    }
}

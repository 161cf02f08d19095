//! A wall hides a block from an eye: `cargo run -p leo-scene --example wall`.
//!
//! The eye looks at the table from the other side. The share of the block's sample points that it sees falls while the
//! wall grows.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;

use geometry::{Base, Eye, Pose, Position};
use scene::{Cone, Occluders, Samples, Sight};

fn main() -> Result<(), Box<dyn Error>> {
    let x_base_eye =
        Pose::<Base, Eye>::looking(&Position::new(1.5, 0.0, 0.55), &Position::new(0.4, 0.0, 0.02));
    let cone = Cone::new(60_f64.to_radians(), 3.0)?;
    let x_base_block = Pose::upright(0.4, 0.0, 0.02, 0.0);

    let mut shares = Vec::new();
    for half_height_m in [0.01, 0.04, 0.05, 0.06, 0.12] {
        let mut walls = Occluders::new(1);
        walls.add(&Pose::upright(0.5, 0.0, half_height_m, 0.0), [0.01, 0.2, half_height_m])?;
        let sight = Sight::new(x_base_eye, cone, &walls);
        let share = sight.visible_share(&x_base_block, [0.02; 3], Samples::Corners);
        println!("wall of {:.2} m: {:3.0} % of the block is visible", 2.0 * half_height_m, 100.0 * share);
        shares.push(share);
    }
    assert!(shares.is_sorted_by(|lower, higher| lower >= higher), "a higher wall hides no less");
    assert!(shares.first() > shares.last(), "the highest wall hides the block");
    Ok(())
}

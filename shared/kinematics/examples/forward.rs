//! Forward kinematics of Leo's body: `cargo run -p leo-kinematics --example forward`.
//!
//! The position of the left hand in the base frame, with the arm stretched and with the elbow bent by a right angle.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;
use std::f64::consts::FRAC_PI_2;

use kinematics::{Body, Side};

const URDF: &str = include_str!("../leo.urdf");

fn main() -> Result<(), Box<dyn Error>> {
    // The order of the names is the order of the positions.
    let movable = URDF.lines().filter(|line| line.contains("type=\"revolute\""));
    let names: Vec<&str> = movable.filter_map(|line| line.split('"').nth(1)).collect();
    let body = Body::from_urdf(URDF, &names)?;

    let mut positions_rad = vec![0.0; body.joints().len()];
    let stretched = body.hand(Side::Left, &positions_rad).origin();
    println!("stretched: {:.3?} m", stretched.to_array());

    let elbow = body.joint("left_elbow_pitch_joint").ok_or("the body has a left elbow")?;
    if let Some(position_rad) = positions_rad.get_mut(elbow) {
        *position_rad = -FRAC_PI_2;
    }
    let bent = body.hand(Side::Left, &positions_rad).origin();
    println!("bent:      {:.3?} m", bent.to_array());
    assert!(stretched.distance(&bent) > 0.1, "the hand moves with the elbow");
    Ok(())
}

//! The robot of `config/`.

use std::path::Path;
use std::sync::LazyLock;

use kinematics::Body;

pub(crate) const MOTOR: &str = include_str!("../../../../config/motor.toml");
const URDF: &str = include_str!("../../../../config/leo.urdf");

pub(crate) struct Leo {
    pub(crate) body: Body,
    pub(crate) rest_rad: Vec<f64>,
}

pub(crate) static LEO: LazyLock<Leo> = LazyLock::new(|| {
    let motor = config::motor::parse(MOTOR, Path::new("motor.toml")).expect("config/motor.toml is right");
    let names: Vec<&str> = motor.joints.iter().map(|joint| joint.name.as_str()).collect();
    let body = Body::from_urdf(URDF, &names).expect("config/leo.urdf is right");
    let rest_rad = motor.joints.iter().map(|joint| joint.joint_rad(0.0)).collect();
    Leo { body, rest_rad }
});

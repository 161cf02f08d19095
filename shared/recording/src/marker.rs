//! `visualization_msgs/MarkerArray`.

use nalgebra::Isometry3;

use crate::cdr::Cdr;

/// The shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// An arrow from the origin along x.
    Arrow,
    /// A box around the origin.
    Cube,
}

/// A marker to draw.
#[derive(Clone, Debug)]
pub(crate) struct Marker<'a> {
    /// Its namespace.
    pub(crate) kind: &'a str,
    /// Its number within the namespace.
    pub(crate) id: i32,
    pub(crate) form: Form,
    pub(crate) pose: Isometry3<f64>,
    /// Its extents, in metres.
    pub(crate) scale_m: [f64; 3],
    /// Red, green, blue and opacity, in [0, 1].
    pub(crate) colour_rgba: [f32; 4],
    /// Its label.
    pub(crate) text: &'a str,
}

/// Marker actions: add a marker, delete all markers.
const ADD: i32 = 0;
const DELETE_ALL: i32 = 3;

/// A message that replaces all markers drawn before.
pub(crate) fn markers(at_ns: u64, frame: &str, markers: &[Marker<'_>]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.length(markers.len() + 1);
    let nothing = Marker {
        kind: "",
        id: 0,
        form: Form::Cube,
        pose: Isometry3::identity(),
        scale_m: [0.0; 3],
        colour_rgba: [0.0; 4],
        text: "",
    };
    put(&mut cdr, at_ns, frame, DELETE_ALL, &nothing);
    for marker in markers {
        put(&mut cdr, at_ns, frame, ADD, marker);
    }
    cdr.finish()
}

fn put(cdr: &mut Cdr, at_ns: u64, frame: &str, action: i32, marker: &Marker<'_>) {
    cdr.header(at_ns, frame);
    cdr.string(marker.kind);
    cdr.i32(marker.id);
    cdr.i32(match marker.form {
        Form::Arrow => 0,
        Form::Cube => 1,
    });
    cdr.i32(action);
    pose(cdr, &marker.pose);
    cdr.f64s(&marker.scale_m);
    marker.colour_rgba.iter().for_each(|share| cdr.f32(*share));
    // Lifetime: for ever. Not frame-locked.
    cdr.time(0);
    cdr.bool(false);
    // No points and no colours of points; no texture: resource, image, coordinates.
    cdr.length(0);
    cdr.length(0);
    cdr.string("");
    cdr.header(0, "");
    cdr.string("");
    cdr.length(0);
    cdr.length(0);
    cdr.string(marker.text);
    // No mesh: resource, file, materials.
    cdr.string("");
    cdr.string("");
    cdr.length(0);
    cdr.bool(false);
}

/// A pose in the layout shared by `Pose` and `Transform`.
pub(crate) fn pose(cdr: &mut Cdr, pose: &Isometry3<f64>) {
    let (place, turn) = (pose.translation, pose.rotation);
    cdr.f64s(&[place.x, place.y, place.z, turn.i, turn.j, turn.k, turn.w]);
}

//! The body: joints and links from a URDF, forward and inverse kinematics.

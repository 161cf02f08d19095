//! What is visible from where: convex shapes, cones, rays.

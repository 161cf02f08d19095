//! What the body does: reach, grasp, carry, insert, as time-parameterised joint goals.

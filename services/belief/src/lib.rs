//! Belief process: one belief system per perspective, woken by the percept buffer.

//! Console process: tells people what happens.

//! Servos: the Dynamixel 2.0 protocol as a pure codec, control tables, a servo that behaves.

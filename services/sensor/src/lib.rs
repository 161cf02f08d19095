//! Sensor process: acquires observations, publishes the percept buffer.

//! Instants of the machine's monotonic clock, and sleeping until one.

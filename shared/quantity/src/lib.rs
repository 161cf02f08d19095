//! Numbers with their units in the type.

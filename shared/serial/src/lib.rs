//! Raw ttys and pseudo-terminals with deadlines below a millisecond.

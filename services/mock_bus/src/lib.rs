//! Mock servo bus: the other end of the wire, with whole control tables and faults.

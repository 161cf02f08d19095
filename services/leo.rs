//! Reads the command line and hands over to the process it names.

fn main() {}

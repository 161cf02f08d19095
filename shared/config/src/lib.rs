//! The files of Leo: configuration and lessons, typed, with errors that name file, line and field.

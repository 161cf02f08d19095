//! The architecture: which crate and which module may know which, where input and output may happen, and where unsafe
//! code may be.
#![expect(clippy::expect_used, reason = "a test that cannot read the sources has failed")]

mod glossary;
mod language;
mod layers;
mod modules;
mod paths;
mod published;
mod rules;
mod source;

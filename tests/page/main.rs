//! The page's server with a real robot: manual teaching, recordings of it, and misbehaving clients.
#![expect(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a test that meets what it does not expect has failed"
)]

mod arming;
mod browser;
mod death;
mod dice;
mod flood;
mod page;
mod robot;
mod strangers;
mod teaching;

//! The page's server over a real robot: teaching by hand, what is written down of it, and whoever says
//! what he should not.
#![expect(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::print_stderr,
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

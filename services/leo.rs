//! The program `leo`. Its commands are in the crate `commands`.

use std::process::ExitCode;

fn main() -> ExitCode {
    commands::run(env!("LEO_COMMIT"))
}

//! The program `leo`: parses the command line and runs the command.

mod command;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    process::restrict_umask();
    match command::Leo::parse_from(command::arguments()).run() {
        Ok(code) => code,
        Err(failure) => {
            // The only place where a command's error is printed.
            let mut out = std::io::stderr().lock();
            let _ = std::io::Write::write_all(&mut out, failure.message().as_bytes());
            failure.code
        }
    }
}

//! Reads the command line and hands over to what it names.

mod command;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    process::restrict_umask();
    match command::Leo::parse_from(command::arguments()).run() {
        Ok(code) => code,
        Err(failure) => {
            // The only place where an error of a command reaches its user.
            let mut out = std::io::stderr().lock();
            let _ = std::io::Write::write_all(&mut out, failure.told().as_bytes());
            failure.code
        }
    }
}

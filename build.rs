//! Tells the program which commit it was built from.

use std::process::Command;

fn main() {
    // A source tree without git, or with a change, still builds: it only says less.
    let described = Command::new("git").args(["describe", "--always", "--dirty"]).output();
    let commit = described
        .ok()
        .filter(|output| output.status.success())
        .and_then(|output| String::from_utf8(output.stdout).ok())
        .unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=LEO_COMMIT={}", commit.trim());
    // The log grows with every commit; the head alone only names the branch.
    println!("cargo::rerun-if-changed=.git/HEAD");
    println!("cargo::rerun-if-changed=.git/logs/HEAD");
}

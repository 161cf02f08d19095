use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A copy of a folder of this repository below the target folder, with the packages that its `package-lock.json` names.
/// `None` with a message without Node.js or its registry.
pub(crate) fn installed(folder: &str) -> Option<PathBuf> {
    let copy = copied(folder);
    if copy.is_none() {
        skip::skip("Node.js 20 with npm, and the npm registry, are needed: apt-get install nodejs npm");
    }
    copy
}

fn copied(folder: &str) -> Option<PathBuf> {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let name = from.file_name().expect("a name");
    let to = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // Other tests may install the same, in this process or another.
    let lock = File::create(to.with_extension("lock")).ok()?;
    lock.lock().ok()?;
    fs::create_dir_all(&to).expect("a folder");
    // Without changed versions nothing is installed again.
    let list = "package-lock.json";
    let is_installed =
        to.join("node_modules").is_dir() && fs::read(to.join(list)).ok() == fs::read(from.join(list)).ok();
    for entry in fs::read_dir(&from).expect("a folder of the repository").flatten() {
        if entry.path().is_file() {
            fs::copy(entry.path(), to.join(entry.file_name())).expect("copies");
        }
    }
    let install = || {
        let mut npm = Command::new("npm");
        npm.args(["ci", "--no-audit", "--no-fund"]).current_dir(&to);
        npm.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
    };
    (is_installed || install()).then_some(to)
}

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The interpreter of a virtual environment below the target folder that has a package (such as
/// `iceoryx2==0.10.0`) with a module. It is created if needed; `None` with a message if that fails.
pub(crate) fn interpreter(package: &str, module: &str) -> Option<PathBuf> {
    let python = made(package, module);
    if python.is_none() {
        let why = format!("`python3 -m venv` and `pip install {package}` do not work here");
        skip::skip(why);
    }
    python
}

fn made(package: &str, module: &str) -> Option<PathBuf> {
    let folder =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("python-{}", package.replace("==", "-")));
    let python = folder.join("bin/python");
    let succeeds = |command: &mut Command| {
        command.stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
    };
    // Other tests may create the same one, in this process or another.
    let lock = File::create(folder.with_extension("lock")).ok()?;
    lock.lock().ok()?;
    let works = || succeeds(Command::new(&python).arg("-c").arg(format!("import {module}")));
    if !works() {
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", package];
        let made = succeeds(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))
            && succeeds(Command::new(&python).args(install));
        if !made || !works() {
            return None;
        }
    }
    Some(python)
}

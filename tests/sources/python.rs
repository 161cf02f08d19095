use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::venv;

/// The interpreter of a virtual environment with the middleware.
pub(crate) struct Python(PathBuf);

/// A running example.
pub(crate) struct Example {
    process: Child,
    words: PathBuf,
}

impl Python {
    /// The environment; `None` if it cannot be created.
    pub(crate) fn find() -> Option<Self> {
        venv::interpreter("iceoryx2==0.10.0", "iceoryx2").map(Self)
    }

    /// A program of the repository with arguments, the last of which is the domain of a robot.
    pub(crate) fn run(&self, program: &str, arguments: &[&str], domain: &Path) -> Command {
        let mut command = Command::new(&self.0);
        command
            .arg("-B")
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join(program))
            .args(arguments)
            .arg(domain);
        command
    }

    /// Runs the example as source 1 of a robot.
    pub(crate) fn observe(&self, domain: &Path, centre: &[&str; 3]) -> Example {
        let words = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("observe-{}", std::process::id()));
        let file = fs::File::create(&words).expect("writes");
        let process = Command::new(&self.0)
            .arg("-B")
            .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/examples/python/observe.py"))
            .args(["--source", "1", "--rate", "50", "--domain"])
            .arg(domain)
            .arg("--centre")
            .args(centre)
            .stdin(Stdio::null())
            .stdout(file.try_clone().expect("a descriptor"))
            .stderr(file)
            .spawn()
            .expect("starts");
        Example { process, words }
    }
}

impl Example {
    /// Its output so far.
    pub(crate) fn said(&self) -> String {
        fs::read_to_string(&self.words).unwrap_or_default()
    }

    pub(crate) fn has_ended(&mut self) -> bool {
        self.process.try_wait().expect("asked").is_some()
    }

    pub(crate) fn kill(&mut self) {
        let _dead = self.process.kill().and_then(|()| self.process.wait().map(drop));
    }
}

impl Drop for Example {
    fn drop(&mut self) {
        self.kill();
        let _removed = fs::remove_file(&self.words);
    }
}

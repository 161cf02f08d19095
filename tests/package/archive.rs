//! The archive for machines without a build environment: what is in it, and that it installs.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::{ask, repository};

const PROGRAM: &str = env!("CARGO_BIN_EXE_leo");
/// What is installed beside the manual pages and the configuration.
const INSTALLED: [&str; 10] = [
    "bin/leo",
    "share/bash-completion/completions/leo",
    "share/doc/leo/CHANGELOG.md",
    "share/doc/leo/LICENSE",
    "share/doc/leo/LICENSE-APACHE",
    "share/doc/leo/LICENSE-MIT",
    "share/doc/leo/README.md",
    "share/doc/leo/operations.md",
    "share/fish/vendor_completions.d/leo.fish",
    "share/zsh/site-functions/_leo",
];

/// Runs a program, which must succeed.
fn run(command: &mut Command) -> Output {
    let output = command.output().expect("runs");
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// The files below a folder, by their paths in it.
fn files(folder: &Path) -> BTreeSet<String> {
    let (mut found, mut folders) = (BTreeSet::new(), vec![folder.to_owned()]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.insert(path.strip_prefix(folder).expect("is in it").display().to_string());
            }
        }
    }
    found
}

#[test]
fn the_archive_installs_the_program_its_manual_and_its_configuration() {
    for program in ["strip", "gzip", "tar"] {
        if ask(Command::new(program).arg("--version")).is_none() {
            return;
        }
    }
    let work = tempfile::tempdir().expect("a folder");
    let script = repository("package/archive.sh");
    let packed = run(Command::new(script).args(["--program", PROGRAM]).arg(work.path()));
    let said = String::from_utf8(packed.stdout).expect("text");
    let archive = PathBuf::from(said.lines().last().expect("a path"));
    run(Command::new("tar").arg("--extract").arg("--file").arg(&archive).arg("--directory").arg(work.path()));

    // The folder in the archive has its name without `.tar.gz`.
    let unpacked = archive.with_extension("").with_extension("");
    let prefix = work.path().join("prefix");
    run(Command::new(unpacked.join("install.sh")).arg(&prefix));

    let manual = work.path().join("manual");
    run(Command::new(PROGRAM).arg("manual").arg(&manual));
    let pages = files(&manual.join("man"));
    assert!(pages.len() > 20, "{pages:?}");
    let configuration = files(&repository("config"));
    let mut expected: BTreeSet<String> = INSTALLED.map(str::to_owned).into();
    expected.extend(pages.iter().map(|page| format!("share/man/man1/{page}.gz")));
    expected.extend(configuration.iter().map(|file| format!("share/leo/{file}")));
    assert_eq!(files(&prefix), expected);

    for page in &pages {
        let compressed = prefix.join(format!("share/man/man1/{page}.gz"));
        let shown = run(Command::new("gzip").args(["--decompress", "--stdout"]).arg(compressed));
        assert_eq!(shown.stdout, fs::read(manual.join("man").join(page)).expect("a page"), "{page}");
    }
    for (installed, made) in [
        ("bash-completion/completions/leo", "leo.bash"),
        ("zsh/site-functions/_leo", "_leo"),
        ("fish/vendor_completions.d/leo.fish", "leo.fish"),
    ] {
        let installed = fs::read(prefix.join("share").join(installed)).expect("is installed");
        assert_eq!(installed, fs::read(manual.join("completions").join(made)).expect("is made"), "{made}");
    }
    for file in &configuration {
        let installed = fs::read(prefix.join("share/leo").join(file)).expect("is installed");
        assert_eq!(installed, fs::read(repository("config").join(file)).expect("a file"), "{file}");
    }
    let installed = prefix.join("bin/leo");
    let version = |program: &Path| run(Command::new(program).arg("--version")).stdout;
    assert_eq!(version(&installed), version(Path::new(PROGRAM)));
    let believed =
        run(Command::new(&installed).args(["believe", "share/leo/traces/moved.jsonl"]).current_dir(&prefix));
    assert!(
        String::from_utf8_lossy(&believed.stdout).contains("What is believed at the end"),
        "{believed:?}"
    );
}

#[test]
fn an_unknown_option_of_the_archive_shows_its_usage() {
    let refused = Command::new(repository("package/archive.sh")).arg("--fast").output().expect("runs");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(refused.status.code() == Some(2) && said.contains("--program FILE FOLDER"), "{refused:?}");
    assert!(refused.stdout.is_empty(), "{refused:?}");
}

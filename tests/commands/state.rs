//! An unusable state directory: every command that writes to it refuses to start and reports the reason.

use std::os::unix::process::CommandExt as _;
use std::process::{Command, Stdio};

use rustix::process::getuid;

use crate::harness::{CommandOutput, leo, public_executable, write};
use crate::{NOBODY, assert_refused};

/// Shell commands that make the empty folder `$1` unusable, and the expected message for each.
const WAYS: [(&str, &str, &str); 9] = [
    (
        "on a disk that is read only",
        r#"mount -t tmpfs tmpfs "$1" && mkdir -m 700 "$1/leo" && mount -o remount,ro "$1""#,
        "Read-only file system",
    ),
    (
        "on a disk that is read only, not made yet",
        r#"mount -t tmpfs tmpfs "$1" && mount -o remount,ro "$1""#,
        "Read-only file system",
    ),
    (
        "on a full disk",
        r#"mount -t tmpfs -o size=64k tmpfs "$1" && mkdir -m 700 "$1/leo" && ! cat /dev/zero >"$1/fill" 2>&-"#,
        "No space left",
    ),
    (
        "on a disk without a free inode",
        r#"mount -t tmpfs -o nr_inodes=3 tmpfs "$1" && mkdir -m 700 "$1/leo" && : >"$1/fill""#,
        "No space left",
    ),
    (
        "below a folder that is read only",
        r#"mkdir -m 700 "$1/leo" "$1/leo/recordings" && mount --bind -o ro "$1/leo/recordings" "$1/leo/recordings""#,
        "Read-only file system",
    ),
    (
        "with a token that is read only",
        r#"mkdir -m 700 "$1/leo" && : >"$1/leo/page_token" && mount --bind -o ro "$1/leo/page_token" "$1/leo/page_token""#,
        "Read-only file system",
    ),
    ("behind a link", r#"mkdir -m 700 "$1/else" && ln -s else "$1/leo""#, "is a symbolic link"),
    ("open to everybody", r#"mkdir -m 700 "$1/leo" && chmod 777 "$1/leo""#, "may be written by other users"),
    ("in the place of a file", r#": >"$1/leo""#, "is a file, and not a directory"),
];

fn outcome(command: &mut Command) -> CommandOutput {
    let output = command.stdin(Stdio::null()).output().expect("starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("is text");
    CommandOutput { status: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

#[test]
fn an_unwritable_state_directory_refuses_every_writing_command() {
    let may_mount = || outcome(Command::new("unshare").args(["--mount", "true"])).status == Some(0);
    if !getuid().is_root() || !may_mount() {
        skip::skip("root is needed, and the right to mount");
        return;
    }
    let files = tempfile::tempdir().expect("a folder");
    let tasks = write(&files, "tasks.json", r#"{"leo_tasks": 1, "tasks": []}"#);
    let commands: [&[&str]; 3] =
        [&["run", "--for", "1"], &["tasks", "import", &tasks], &["tasks", "forget", "x"]];
    for (case, script, said) in WAYS {
        for arguments in commands {
            let (ours, folder) = leo(arguments);
            let script = format!(
                r#"{{ {script}; }} || exit 77; leo=$0; export XDG_STATE_HOME=$1; shift; exec "$leo" "$@""#
            );
            let mut command = Command::new("unshare");
            command.args(["--mount", "bash", "-c", &script]).arg(ours.get_program()).arg(folder.path());
            command.args(ours.get_args()).current_dir(env!("CARGO_MANIFEST_DIR"));
            let outcome = outcome(&mut command);
            assert_ne!(outcome.status, Some(77), "{case}: {outcome:?}");
            let state = folder.path().join("leo").display().to_string();
            assert_refused(&outcome, 2, &[&state, said, "XDG_STATE_HOME"]);
        }
    }
    // A directory of another user.
    let executable = public_executable(&files);
    for arguments in commands {
        let (_, folder) = leo(arguments);
        std::fs::create_dir(folder.path().join("leo")).expect("makes a folder");
        for (folder, mode) in [(folder.path().to_owned(), 0o755), (folder.path().join("leo"), 0o755)] {
            std::fs::set_permissions(folder, std::os::unix::fs::PermissionsExt::from_mode(mode))
                .expect("is ours");
        }
        let mut command = Command::new(&executable);
        command.args(arguments).uid(NOBODY).gid(NOBODY).current_dir("/");
        let outcome = outcome(command.env_clear().env("XDG_STATE_HOME", folder.path()));
        let state = folder.path().join("leo");
        let owned = folder::FolderError::OtherOwner { path: state, owner: 0 }.to_string();
        assert_refused(&outcome, 2, &[&owned, "XDG_STATE_HOME"]);
    }
}

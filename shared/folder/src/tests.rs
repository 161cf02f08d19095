use std::fs;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::time::Duration;

use rustix::fs::mkfifoat;

use super::*;

fn parent() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn a_folder_is_created_for_this_user_alone() {
    let parent = parent();
    let path = parent.path().join("own");
    assert!(Folder::open(&path).unwrap_err().is_missing());
    let folder = Folder::make(&path).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&path), 0o700);
    folder.replace("file", b"one").unwrap();
    assert_eq!((mode(&path.join("file")), folder.text("file").unwrap().as_str()), (0o600, "one"));
    assert_eq!(folder.create("file").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    folder.link("file", "other").unwrap();
    folder.remove("file").unwrap();
    assert_eq!((folder.has("file").unwrap(), folder.has("other").unwrap()), (false, true));
    assert_eq!(Folder::make(&path).unwrap().text("other").unwrap(), "one");
}

#[test]
fn a_link_is_not_followed_and_its_target_is_unchanged() {
    let parent = parent();
    let (precious, planted) = (parent.path().join("precious"), parent.path().join("leo-robot"));
    fs::create_dir(&precious).unwrap();
    fs::write(precious.join("learned"), "all").unwrap();
    symlink(&precious, &planted).unwrap();
    let with_slash = parent.path().join("leo-robot/");
    for opened in [
        Folder::open(&planted),
        Folder::make(&planted),
        Folder::open_for_root(&planted),
        Folder::open(&with_slash),
        Folder::make(&with_slash),
    ] {
        let refused = opened.unwrap_err();
        assert!(matches!(refused, FolderError::Link { .. }), "{refused:?}");
    }
    // Neither is a link inside a folder followed.
    let folder = Folder::make(&parent.path().join("own")).unwrap();
    symlink(precious.join("learned"), folder.path().join("file")).unwrap();
    symlink(&precious, folder.path().join("below")).unwrap();
    assert!(folder.open_for_reading("file").is_err() && folder.replace("file", b"none").is_err());
    assert!(folder.has("file").unwrap());
    folder.clear(&[]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    assert_eq!(fs::read_to_string(precious.join("learned")).unwrap(), "all");
}

#[test]
fn a_named_pipe_is_refused_without_waiting_for_its_other_end() {
    let parent = parent();
    let folder = Folder::make(&parent.path().join("own")).unwrap();
    mkfifoat(&folder.descriptor, "pipe", OWN_FILE).unwrap();
    let (sender, refused) = std::sync::mpsc::channel();
    // In a thread, because an open that waits would never return.
    std::thread::spawn(move || {
        let opened = [folder.open_for_reading("pipe").map(drop), folder.own("pipe").map(drop)];
        let text = folder.text("pipe").map(drop);
        let written = [folder.open_for_writing("pipe").map(drop), folder.replace("pipe", b"x")];
        sender.send((opened, text, written)).unwrap();
    });
    let (opened, text, written) = refused.recv_timeout(Duration::from_secs(20)).expect("an open waits");
    for error in opened.into_iter().chain([text]).map(Result::unwrap_err) {
        assert!(error.to_string().ends_with("/own/pipe is no regular file"), "{error}");
    }
    assert!(written.iter().all(Result::is_err), "{written:?}");
}

#[test]
fn a_folder_or_file_writable_by_others_is_refused() {
    let parent = parent();
    let path = parent.path().join("open");
    fs::create_dir(&path).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o777)).unwrap();
    let refused = Folder::make(&path).unwrap_err();
    assert!(matches!(refused, FolderError::WritableByOthers { mode: 0o777, .. }), "{refused:?}");
    let file = parent.path().join("file");
    fs::write(&file, "").unwrap();
    assert!(matches!(Folder::open(&file), Err(FolderError::NoFolder { .. })));
}

#[test]
fn clearing_a_folder_removes_all_levels_except_kept_names() {
    let parent = parent();
    let folder = Folder::make(&parent.path().join("own")).unwrap();
    fs::create_dir_all(folder.path().join("a/b/c")).unwrap();
    fs::write(folder.path().join("a/b/file"), "").unwrap();
    fs::write(folder.path().join("kept"), "").unwrap();
    folder.clear(&["kept"]);
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["kept"]);
}

#[test]
fn error_messages_match_the_snapshot() {
    let path = || PathBuf::from("/dev/shm/leo-a");
    let errors = [
        FolderError::Link { path: path() },
        FolderError::NoFolder { path: path() },
        FolderError::OtherOwner { path: path(), owner: 1001 },
        FolderError::WritableByOthers { path: path(), mode: 0o777 },
        FolderError::System { path: path(), source: io::ErrorKind::NotFound.into() },
    ];
    let outputs = [OutputError::Link, OutputError::Exists, OutputError::Taken];
    let wording: Vec<String> =
        errors.iter().map(ToString::to_string).chain(outputs.iter().map(ToString::to_string)).collect();
    insta::assert_snapshot!(wording.join("\n"));
}

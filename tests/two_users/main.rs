//! Attacks by another user of the same machine, and the robot of a user without rights. Needs root to act as two users.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _, symlink};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clock::Duration;
use folder::FolderError;
use rustix::process::{Pid, Signal, geteuid, kill_process};
use tempfile::TempDir;

/// UID of the other user; `nobody` on most machines.
const OTHER: u32 = 65_534;
/// Generous: the machine may be loaded.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// The message that a path belongs to a user.
fn owned(path: &Path, owner: u32) -> String {
    FolderError::OtherOwner { path: path.to_owned(), owner }.to_string()
}

/// The message that a path is a symbolic link.
fn linked(path: &Path) -> String {
    FolderError::Link { path: path.to_owned() }.to_string()
}

/// Whether this test can act as two users; prints a message if not.
fn is_root() -> bool {
    let is_root = geteuid().is_root();
    if !is_root {
        skip::skip("root is needed to be two users");
    }
    is_root
}

/// Runs a shell script as the other user.
fn other(script: &str) -> (bool, String) {
    by(OTHER, script)
}

/// Runs a shell script as a user; returns whether it succeeded, and its errors.
fn by(user: u32, script: &str) -> (bool, String) {
    let output = Command::new("/bin/sh").args(["-c", script]).uid(user).gid(user).current_dir("/").output();
    let output = output.expect("a shell");
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A robot's domain and its files.
struct Place {
    root: PathBuf,
    files: TempDir,
    /// The robot, while it runs.
    robot: Option<Child>,
    /// Whether every user may stop it.
    stop_by_any_user: bool,
    /// A process of the other user, while it runs.
    rogue: Option<Child>,
}

impl Place {
    fn new(name: &str) -> Self {
        let root = PathBuf::from(format!("/dev/shm/leo-{name}-{}", std::process::id()));
        Self {
            root,
            files: tempfile::tempdir().expect("a folder"),
            stop_by_any_user: true,
            robot: None,
            rogue: None,
        }
    }

    fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_leo"));
        let text = config::Robot::leo_text_with(&[]).replace("\"127.0.0.1:7780\"", "\"none\"");
        let key = "stop_by_any_user = ";
        let text = text.replace(&format!("{key}true"), &format!("{key}{}", self.stop_by_any_user));
        let config = self.files.path().join("leo.toml");
        fs::write(&config, text).expect("writes");
        command.args(["run", "--stay", "--verbose", "--config"]).arg(config).arg("--domain").arg(&self.root);
        command.env_remove("RUST_LOG").env("XDG_STATE_HOME", self.files.path()).stdin(Stdio::null());
        command.stdout(Stdio::null()).stderr(fs::File::create(self.log()).expect("writes"));
        command
    }

    /// A copy of this program that the other user may run.
    fn program_for_all(&self) -> PathBuf {
        let folder = self.files.path().join("program");
        let program = folder.join("leo");
        fs::create_dir(&folder).expect("writes");
        fs::copy(env!("CARGO_BIN_EXE_leo"), &program).expect("copies");
        for path in [self.files.path(), &folder, &program] {
            fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("root may");
        }
        program
    }

    /// Lets the other user bind the stop socket's name and answer with status 0 and a text.
    fn hold_stop_socket(&mut self, text: &str) {
        let (listens, ready) = (self.files.path().join("listens.py"), self.files.path().join("ready"));
        let script = format!(
            "import socket\nlistener = socket.socket(socket.AF_UNIX)\nlistener.bind('\\0leo-emergency-stop:{}')\n\
             listener.listen()\nprint('ready', flush=True)\nwhile True:\n    taken = listener.accept()[0]\n    \
             taken.sendall(b'0\\n{text}\\n')\n    taken.close()\n",
            self.root.display()
        );
        fs::write(&listens, script).expect("writes");
        let mut rogue = Command::new("python3");
        rogue.arg(&listens).uid(OTHER).gid(OTHER).stdout(fs::File::create(&ready).expect("writes"));
        rogue.stderr(Stdio::null());
        self.rogue = Some(rogue.spawn().expect("starts"));
        until(|| fs::read_to_string(&ready).is_ok_and(|said| said.contains("ready")));
    }

    fn log(&self) -> PathBuf {
        self.files.path().join("log")
    }

    fn said(&self) -> String {
        fs::read_to_string(self.log()).unwrap_or_default()
    }

    /// Starts a robot and waits until it runs.
    fn start(&mut self) {
        let mut command = self.command();
        self.start_with(&mut command);
    }

    /// As [`Self::start`], with a prepared command.
    fn start_with(&mut self, command: &mut Command) {
        self.robot = Some(command.spawn().expect("starts"));
        let end = clock::now() + MAX_WAIT;
        while !self.said().contains("all 65 joints follow") {
            let is_running =
                self.robot.as_mut().is_some_and(|robot| robot.try_wait().is_ok_and(|end| end.is_none()));
            assert!(is_running && clock::now() < end, "it does not run: {}", self.said());
            clock::sleep_until(clock::now() + Duration::from_millis(10));
        }
    }

    /// Starts a robot that must be refused; returns its exit status and log.
    fn refused(&self) -> (Option<i32>, String) {
        let mut robot = self.command().spawn().expect("starts");
        let mut status = None;
        until(|| {
            status = robot.try_wait().expect("ours");
            status.is_some()
        });
        let _killed = robot.kill();
        (status.expect("it ends by itself").code(), self.said())
    }

    /// The domain's files in shared memory.
    fn shared(&self) -> Vec<PathBuf> {
        let prefix = format!("{}_", self.root.display());
        let all = fs::read_dir("/dev/shm").expect("is mounted").flatten().map(|entry| entry.path());
        all.filter(|path| path.to_str().is_some_and(|path| path.starts_with(&prefix))).collect()
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        for mut process in self.robot.take().into_iter().chain(self.rogue.take()) {
            let _dead = process.kill().and_then(|()| process.wait());
        }
        for path in self.shared() {
            let _gone = fs::remove_file(path);
        }
        if fs::symlink_metadata(&self.root).is_ok_and(|stat| stat.is_dir()) {
            let _gone = fs::remove_dir_all(&self.root);
        } else {
            let _gone = fs::remove_file(&self.root);
        }
    }
}

fn until(mut holds: impl FnMut() -> bool) {
    let end = clock::now() + MAX_WAIT;
    while !holds() {
        assert!(clock::now() < end, "it does not come to that");
        clock::sleep_until(clock::now() + Duration::from_millis(10));
    }
}

fn signal(pid: u32, signal: Signal) {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw).expect("a process number");
    kill_process(pid, signal).expect("it runs");
}

/// The PID of a robot's sensor process.
fn sensor_of(domain: &Path) -> Option<u32> {
    fs::read_dir("/proc").expect("is mounted").flatten().find_map(|entry| {
        let pid = entry.file_name().to_str()?.parse().ok()?;
        let line = fs::read_to_string(entry.path().join("cmdline")).ok()?;
        let words: Vec<&str> = line.split('\0').collect();
        (words.get(1) == Some(&"sensor") && words.contains(&domain.to_str()?)).then_some(pid)
    })
}

/// Collects everything below a folder.
fn below(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        all.push(entry.path());
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            below(&entry.path(), all);
        }
    }
}

#[test]
fn another_user_opens_no_segment_and_damaged_segments_are_created_again() {
    if !is_root() {
        return;
    }
    let mut place = Place::new("two-open");
    place.start();
    let shared = place.shared();
    assert!(shared.len() > 20, "{shared:?}");
    let mut all = vec![place.root.clone()];
    below(&place.root, &mut all);
    for path in shared.iter().chain(&all) {
        let path = path.display();
        let (opens, _) = other(&format!("[ -r '{path}' ] || [ -w '{path}' ]"));
        assert!(!opens, "{path} can be opened by another user");
    }
    let is_segment = |path: &&PathBuf| path.to_str().is_some_and(|path| path.ends_with(".global_mgmt"));
    let segment = shared.iter().find(is_segment).expect("every domain has one");
    assert_eq!(fs::metadata(segment).expect("is there").mode() & 0o777, 0o600);
    let (wrote, why) = other(&format!("printf 0123456789abcdef > '{}'", segment.display()));
    assert!(!wrote && why.contains("denied"), "{why}");

    // Accidental damage by the owner does not keep a process from restarting.
    fs::write(segment, [0xA5; 16]).expect("this user may");
    until(|| place.said().contains("it was recreated"));
    assert!(place.said().contains(&segment.display().to_string()), "{}", place.said());
    let sensor = || sensor_of(&place.root);
    let before = sensor().expect("it runs");
    signal(before, Signal::KILL);
    until(|| sensor().is_some_and(|now| now != before));
    until(|| place.said().contains("starts anew"));
    let mut robot = place.robot.take().expect("it runs");
    signal(robot.id(), Signal::TERM);
    assert!(robot.wait().expect("ours").success());
    // Learned tasks and black boxes.
    let mut written = Vec::new();
    below(&place.files.path().join("leo"), &mut written);
    assert!(!written.is_empty());
    for path in written {
        assert_eq!(fs::metadata(&path).expect("is there").mode() & 0o077, 0, "{}", path.display());
    }
    assert!(place.shared().is_empty(), "{:?}", place.shared());
}

#[test]
fn a_process_of_the_same_user_may_write_to_every_segment() {
    if !is_root() {
        return;
    }
    let mut place = Place::new("two-same");
    let program = place.program_for_all();
    let state = place.files.path().join("state");
    fs::create_dir(&state).expect("writes");
    std::os::unix::fs::chown(&state, Some(OTHER), Some(OTHER)).expect("root may");
    // Root may open every file, so the robot is that of another user.
    let command = place.command();
    let mut robot = Command::new(program);
    robot.args(command.get_args()).env_remove("RUST_LOG").env("XDG_STATE_HOME", state).uid(OTHER).gid(OTHER);
    robot.current_dir("/").stdin(Stdio::null()).stdout(Stdio::null());
    robot.stderr(fs::File::create(place.log()).expect("writes"));
    place.start_with(&mut robot);
    let shared = place.shared();
    assert!(shared.len() > 20, "{shared:?}");
    for path in shared {
        let path = path.display();
        // Opens the file for writing and writes nothing. Opening it as a new one would be refused to other users in any
        // case, because of the folder.
        let open = format!("dd if=/dev/null of='{path}' conv=notrunc,nocreat");
        let may_write = |user: u32| by(user, &open).0;
        assert!(may_write(OTHER), "{path} cannot be written by its user");
        assert!(!may_write(OTHER - 1), "{path} can be written by another user");
    }
}

/// Programs that compute all the time; ended when dropped.
struct BusyMachine(Vec<Child>);

impl BusyMachine {
    /// Three for each core: the robot's processes wait for tens of milliseconds.
    fn new() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let busy = || Command::new("/bin/sh").args(["-c", "while :; do :; done"]).spawn().expect("a shell");
        Self((0..3 * cores).map(|_| busy()).collect())
    }
}

impl Drop for BusyMachine {
    fn drop(&mut self) {
        for busy in &mut self.0 {
            let _dead = busy.kill().and_then(|()| busy.wait());
        }
    }
}

#[test]
fn a_user_without_rights_on_a_busy_machine_gets_two_warnings() {
    if !is_root() {
        return;
    }
    let place = Place::new("two-busy");
    let program = place.program_for_all();
    let state = place.files.path().join("state");
    fs::create_dir(&state).expect("writes");
    std::os::unix::fs::chown(&state, Some(OTHER), Some(OTHER)).expect("root may");
    let _busy = BusyMachine::new();
    let mut robot = Command::new(program);
    robot.args(["run", "--for", "15", "--set", "console.address=none", "--domain"]).arg(&place.root);
    robot.env_clear().env("XDG_STATE_HOME", state).uid(OTHER).gid(OTHER).current_dir("/");
    let ended = robot.stdin(Stdio::null()).output().expect("starts");
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(ended.status.success(), "{:?}: {said}", ended.status);
    let warnings: Vec<&str> = said.lines().filter(|line| line.contains(" WARN ")).collect();
    let is_expected = |line: &&&str| {
        line.contains("timing is not guaranteed")
            || line.contains("the mock bus was starved of processor time")
    };
    let unexpected: Vec<_> = warnings.iter().filter(|line| !is_expected(line)).collect();
    assert!(unexpected.is_empty() && (1..=2).contains(&warnings.len()), "{said}");
}

#[test]
fn shared_memory_of_another_user_is_one_clear_error() {
    if !is_root() {
        return;
    }
    let place = Place::new("two-before");
    let file = format!("{}_node.0_10_0.global_mgmt", place.root.display());
    assert!(other(&format!("printf '' > {file}")).0);
    let (status, said) = place.refused();
    assert_eq!(status, Some(1), "{said}");
    let foreign = transport::DomainError::Foreign { path: file.into(), owner: OTHER };
    assert!(said.contains(&foreign.to_string()), "{said}");
}

#[test]
fn a_link_that_another_user_has_planted_is_not_followed() {
    if !is_root() {
        return;
    }
    let place = Place::new("two-link");
    let precious = place.files.path().join("precious");
    fs::create_dir(&precious).expect("writes");
    for file in ["learned.store", "supervisor.lock", "emergency-stop"] {
        fs::write(precious.join(file), "all").expect("writes");
    }
    // The kernel would not let root follow another user's link in such a folder, so root's own link is tested
    // too.
    let planted: [&dyn Fn(); 2] = [
        &|| assert!(other(&format!("ln -s '{}' '{}'", precious.display(), place.root.display())).0),
        &|| symlink(&precious, &place.root).expect("writes"),
    ];
    for plant in planted {
        plant();
        let (status, said) = place.refused();
        assert_eq!(status, Some(1), "{said}");
        assert!(said.contains(&linked(&place.root)), "{said}");
        let stop = Command::new(env!("CARGO_BIN_EXE_leo"))
            .args(["emergency-stop", "--release", "--domain"])
            .arg(&place.root)
            .output()
            .expect("runs");
        assert!(!stop.status.success());
        assert_eq!(fs::read_dir(&precious).expect("is there").count(), 3, "{said}");
        fs::remove_file(&place.root).expect("is a link");
    }
}

#[test]
fn a_folder_of_another_user_is_refused_whatever_its_mode() {
    if !is_root() {
        return;
    }
    let place = Place::new("two-folder");
    assert!(other(&format!("mkdir -m 777 '{}'", place.root.display())).0);
    let (status, said) = place.refused();
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains(&format!("number {OTHER}")), "{said}");
    fs::remove_dir(&place.root).expect("nothing is in it");
}

#[test]
fn an_ordinary_user_learns_the_owner_of_an_inaccessible_folder() {
    if !is_root() {
        return;
    }
    let place = Place::new("two-ordinary");
    fs::DirBuilder::new().mode(0o700).create(&place.root).expect("writes");
    let program = place.program_for_all();
    let state = place.files.path().join("state");
    fs::create_dir(&state).expect("writes");
    std::os::unix::fs::chown(&state, Some(OTHER), Some(OTHER)).expect("root may");
    let leo = |arguments: &str| {
        other(&format!(
            "XDG_STATE_HOME='{}' '{}' {arguments} --domain '{}'",
            state.display(),
            program.display(),
            place.root.display()
        ))
    };
    for arguments in ["run --stay", "emergency-stop", "top --openmetrics"] {
        let (succeeds, said) = leo(arguments);
        assert!(!succeeds && said.contains("number 0"), "{arguments}: {said}");
    }
}

#[test]
fn learned_tasks_are_never_read_from_another_users_files() {
    if !is_root() {
        return;
    }
    let files = tempfile::tempdir().expect("a folder");
    fs::set_permissions(files.path(), fs::Permissions::from_mode(0o755)).expect("root may");
    let program = files.path().join("leo");
    fs::copy(env!("CARGO_BIN_EXE_leo"), &program).expect("copies");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("root may");
    let list =
        |state: &Path| other(&format!("'{}' tasks list --state '{}'", program.display(), state.display()));
    let refused = |state: &Path, words: &str| {
        let (succeeds, said) = list(state);
        assert!(!succeeds && said.contains(words), "{words}: {said}");
        said
    };

    let of_root = files.path().join("of-root");
    fs::DirBuilder::new().create(&of_root).expect("writes");
    fs::set_permissions(&of_root, fs::Permissions::from_mode(0o777)).expect("root may");
    refused(&of_root, &owned(&of_root, 0));
    assert_eq!(fs::read_dir(&of_root).expect("is there").count(), 0, "nothing is made in it");

    let own = files.path().join("own");
    fs::DirBuilder::new().mode(0o700).create(&own).expect("writes");
    std::os::unix::fs::chown(&own, Some(OTHER), Some(OTHER)).expect("root may");
    let link = files.path().join("link");
    symlink(&own, &link).expect("writes");
    refused(&link, &linked(&link));
    assert_eq!(fs::read_dir(&own).expect("is there").count(), 0, "nothing is made behind it");
    for name in ["learned.store", "learned.copy.store", "learned.redb"] {
        fs::write(own.join(name), "of root").expect("writes");
        fs::set_permissions(own.join(name), fs::Permissions::from_mode(0o666)).expect("root may");
        let said = refused(&own, &own.join(name).display().to_string());
        assert!(said.contains("number 0"), "{said}");
        assert_eq!(fs::read_to_string(own.join(name)).expect("is there"), "of root");
        fs::remove_file(own.join(name)).expect("is there");
    }

    // Files that root creates there belong to that user.
    let listed = Command::new(&program).args(["tasks", "list", "--state"]).arg(&own).output().expect("runs");
    assert!(listed.status.success(), "{listed:?}");
    let mut seen = 0;
    for entry in fs::read_dir(&own).expect("is there").flatten() {
        assert_eq!(entry.metadata().expect("is there").uid(), OTHER, "{:?}", entry.path());
        seen += 1;
    }
    assert!(seen > 0, "no file was seen");
    let (succeeds, said) = list(&own);
    assert!(succeeds, "{said}");
}

#[test]
fn root_stops_and_releases_another_users_robot_without_reading_it() {
    if !is_root() {
        return;
    }
    let place = Place::new("two-root");
    let root = place.root.display();
    // Reading their configuration would be an error.
    let made = format!(
        "mkdir -m 700 {root} {root}/configuration && touch {root}/iceoryx2.toml && echo x > \
         {root}/configuration/leo.toml"
    );
    assert!(other(&made).0);
    let leo = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_leo")).args(arguments).arg("--domain").arg(&place.root).output();
        let output = output.expect("runs");
        (output.status.code(), String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned())
    };
    let (status, said) = leo(&["emergency-stop"]);
    assert_eq!(status, Some(1), "{said}");
    assert!(said.contains(&format!("sudo -u '#{OTHER}' ")), "{said}");
    assert!(other(&format!("grep -q 'leo emergency-stop' {root}/emergency-stop")).0, "they see why");
    let (status, said) = leo(&["emergency-stop", "--release"]);
    assert!(status == Some(0) && said.contains("released"), "{said}");
    let (status, said) = leo(&["top", "--openmetrics"]);
    assert!(status != Some(0) && said.contains(&owned(&place.root, OTHER)), "{said}");
}

#[test]
fn any_user_may_stop_a_robot_but_give_no_other_command() {
    if !is_root() {
        return;
    }
    let mut place = Place::new("two-stop");
    let program = place.program_for_all();
    place.start();
    let leo = |arguments: &str| {
        other(&format!("'{}' {arguments} --domain '{}' 1>&2", program.display(), place.root.display()))
    };
    let (succeeds, said) = leo("emergency-stop");
    assert!(succeeds && said.contains("65 servos") && said.contains("number 0"), "{said}");
    let by = format!("EMERGENCY STOP (leo emergency-stop of the user with the number {OTHER})");
    until(|| place.said().contains(&by));
    for arguments in ["emergency-stop --release", "arm"] {
        let (succeeds, said) = leo(arguments);
        assert!(!succeeds, "{arguments}: {said}");
    }
    assert!(place.root.join("emergency-stop").exists());
}

#[test]
fn a_foreign_holder_of_the_stop_socket_is_reported_and_ignored() {
    if !is_root() {
        return;
    }
    let mut place = Place::new("two-name");
    let program = place.program_for_all();
    place.hold_stop_socket("all is well");
    place.start();
    assert!(place.said().contains("no stop socket"), "{}", place.said());
    let stop = format!("'{}' emergency-stop --domain '{}'", program.display(), place.root.display());
    let stopped =
        Command::new("/bin/sh").args(["-c", &stop]).uid(OTHER + 1).gid(OTHER).output().expect("a shell");
    let said = String::from_utf8_lossy(&[stopped.stdout, stopped.stderr].concat()).into_owned();
    assert!(!stopped.status.success(), "{said}");
    assert!(said.contains(&format!("number {OTHER} ")), "{said}");
}

#[test]
fn a_user_without_the_right_to_stop_learns_the_owner() {
    if !is_root() {
        return;
    }
    let mut place = Place::new("two-own");
    place.stop_by_any_user = false;
    let program = place.program_for_all();
    place.start();
    let stop = format!("'{}' emergency-stop --domain '{}'", program.display(), place.root.display());
    let (succeeds, said) = other(&stop);
    assert!(!succeeds && said.contains("number 0"), "{said}");
    assert!(!place.root.join("emergency-stop").exists());
}

#[test]
fn output_of_another_users_robot_is_listed_under_its_name() {
    if !is_root() {
        return;
    }
    let mut place = Place::new("two-words");
    let root = place.root.display().to_string();
    assert!(other(&format!("mkdir -m 700 {root}")).0);
    place.hold_stop_socket(&format!("{root}: stopped\\n/dev/shm/leo-robot: all is well"));
    let stop = Command::new(env!("CARGO_BIN_EXE_leo")).args(["emergency-stop", "--domain", &root]).output();
    let said = String::from_utf8_lossy(&stop.expect("runs").stdout).into_owned();
    let own = format!(
        "{root}: stopped\n  /dev/shm/leo-robot: all is well; it is released by the user with the number {OTHER}"
    );
    assert!(said.starts_with(&own), "{said}");
}

//! `leo teach --record` and `leo record`: the content of the file, and behaviour on a full disk.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use folder::Existing;
use geometry::Pose;
use message::TopicId;
use recording::{Frame, Reader, Subject, Time};
use tempfile::TempDir;

use crate::assert_refused;
use crate::harness::{CommandOutput, Leo, leo, redacted, run_leo, short_lesson, wait_until, write};

/// The path of a file in a folder.
pub(crate) fn file(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

/// Records a lesson and checks that nothing is reported on standard error.
pub(crate) fn recorded(lesson: &str, to: &str) -> CommandOutput {
    let output = run_leo(&["teach", lesson, "--record", to]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    output
}

pub(crate) fn frames(file: &str) -> Vec<Frame> {
    let reader = Reader::open(Path::new(file)).expect("is a recording");
    reader.map(|frame| frame.expect("is whole")).collect()
}

/// Number of frames of a topic that a replay found equal.
pub(crate) fn equal(output: &CommandOutput, buffer: &str) -> Option<usize> {
    let line = output.out.lines().find(|line| line.split_whitespace().next() == Some(buffer))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[test]
fn a_recording_with_an_older_configuration_is_replayed() {
    let folder = tempfile::tempdir().expect("a folder");
    let (lesson, new) = (write(&folder, "short.toml", &short_lesson()), file(&folder, "new.mcap"));
    recorded(&lesson, &new);
    let mut reader = Reader::open(Path::new(&new)).expect("is a recording");
    let frames: Vec<Frame> = reader.by_ref().map(|frame| frame.expect("is whole")).collect();
    let about = reader.about().expect("it says what it is of");
    const FILES: [&str; 5] = ["leo.toml", "percepts.toml", "perspective.toml", "motor.toml", "leo.urdf"];
    let mut files: std::collections::BTreeMap<&str, String> =
        FILES.into_iter().map(|name| (name, reader.files()[name].clone())).collect();
    let key = "boost_serial_kworkers";
    let leo = files.get_mut("leo.toml").expect("is there");
    assert!(leo.contains(key));
    *leo = leo.lines().filter(|line| !line.starts_with(key)).map(|line| format!("{line}\n")).collect();
    let subject = Subject {
        robot: config::Robot::load(None).expect("the built-in one"),
        files: files.into_iter().collect(),
        time: Time::Lockstep,
        partners: about.partners,
        x_world_base: about.x_world_base(),
        program: "an older Leo".to_owned(),
    };
    let older = file(&folder, "older.mcap");
    let mut writer =
        recording::Writer::new(fs::File::create(&older).expect("can be made"), &subject).expect("begins");
    frames.iter().for_each(|frame| writer.write(frame).expect("room on the disk"));
    writer.finish().expect("room on the disk");
    let output = run_leo(&["replay", &older]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let older = output.out.lines().find(|line| line.contains(key)).expect("it is told");
    assert!(older.contains("leo.toml"), "{older}");
    insta::assert_snapshot!(redacted(older, &[(&folder.path().display().to_string(), "[files]")]));
    assert!(equal(&output, "leo/beliefs/1").is_some_and(|frames| frames > 0), "{output:?}");
}

#[test]
fn an_impossible_recording_or_replay_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let text = write(&folder, "notes.txt", "these are no frames of anything\n");
    let foreign = run_leo(&["replay", &text]);
    assert_refused(&foreign, 2, &["notes.txt", "leo teach"]);
    assert_refused(&run_leo(&["replay", "/nowhere/x.mcap"]), 2, &["/nowhere/x.mcap"]);
    let both = ["teach", &lesson, &lesson, "--record", "x.mcap"];
    let two = run_leo(&both);
    assert_refused(&two, 2, &["--record"]);
    let nowhere = run_leo(&["teach", &lesson, "--record", "/nowhere/x.mcap"]);
    assert_refused(&nowhere, 2, &["/nowhere/x.mcap", "folder"]);
    // The disk is full from the first byte on.
    let full = run_leo(&["teach", &lesson, "--record", "/dev/full"]);
    assert_refused(&full, 1, &["/dev/full", &std::io::Error::from(rustix::io::Errno::NOSPC).to_string()]);
    for (arguments, words) in [
        (["replay", &text, "--speed", "-1"], "from 0.001 to 1000"),
        (["replay", &text, "--from", "NaN"], "above 0"),
        (["record", &text, "--domain", "/dev/shm/leo-nobody-is-here"], "leo run"),
    ] {
        let output = run_leo(&arguments);
        assert_eq!((output.status, output.out.as_str()), (Some(2), ""), "{arguments:?} {output:?}");
        assert!(output.err.contains(words), "{arguments:?} {output:?}");
    }
    let crossed = ["replay", text.as_str(), "--from", "5", "--to", "4"];
    let crossed = run_leo(&crossed);
    assert_refused(&crossed, 2, &["--to", "--from"]);
    let all = [foreign, two, full, crossed].map(|output| output.err).concat();
    insta::assert_snapshot!(redacted(&all, &[(&folder.path().display().to_string(), "[files]")]));
}

#[test]
fn a_full_disk_keeps_the_part_written_before() {
    if !rustix::process::getuid().is_root() {
        skip::skip("only root can mount a small disk");
        return;
    }
    let (command, files) = leo(&[]);
    let to = files.path().join("disk/x.mcap").display().to_string();
    let script = "mkdir \"${1%/*}\"; mount -t tmpfs -o size=2m tmpfs \"${1%/*}\" || exit 77
        \"$0\" teach config/lessons/task1.toml --record \"$1\"; echo \"taught: $?\"
        \"$0\" replay \"$1\"; echo \"replayed: $?\"";
    let mut inside = Command::new("unshare");
    inside.args(["-m", "sh", "-c", script]).arg(command.get_program()).arg(&to);
    inside.current_dir(env!("CARGO_MANIFEST_DIR")).stdin(std::process::Stdio::null());
    let output = Leo::start(inside, files).end();
    if output.status == Some(77) || output.err.contains("unshare") {
        skip::skip(format_args!("no mount namespace of its own here: {}", output.err));
        return;
    }
    let error = recording::RecordError::Write { file: to.into(), source: rustix::io::Errno::NOSPC.into() };
    assert!(output.err.contains(&error.to_string()), "{output:?}");
    let is_cut = output.err.lines().last().is_some_and(|line| line.contains("is truncated"));
    assert!(output.err.lines().count() == 2 && is_cut, "{output:?}");
    assert!(output.out.contains("taught: 1") && output.out.contains("replayed: 0"), "{output:?}");
    assert!(equal(&output, "leo/beliefs/1").is_some_and(|frames| frames > 100), "{output:?}");
}

/// A running robot and its domain.
struct Robot(Leo, PathBuf);

fn robot() -> Robot {
    let (command, files) = leo(&["run"]);
    let robot = Leo::start(command, files);
    assert!(wait_until(|| robot.said("out").contains("the teacher:")), "{}", robot.said("err"));
    let domain = robot.domain();
    Robot(robot, domain)
}

/// Records to a disk of 40 MB with 6 MB free, and then to what is left of it. The disk is removed with the
/// script; a copy of the file is kept.
const ONTO_A_SMALL_DISK: &str = "mount -t tmpfs -o size=40m tmpfs \"$1\" || exit 77
    head -c 34m /dev/zero > \"$1/others\"
    \"$0\" record \"$1/full.mcap\" --domain \"$3\"; status=$?
    df --output=avail \"$1\" | tail -1
    \"$0\" record \"$1/again.mcap\" --domain \"$3\"; test ! -e \"$1/again.mcap\" || exit 3
    \"$0\" record \"$1/last.mcap\" --last 5 --for 1 --domain \"$3\"; test ! -e \"$1/last.mcap\" || exit 4
    cp \"$1/full.mcap\" \"$2\"; exit $status";

#[test]
fn a_full_disk_ends_only_the_recording_and_leaves_free_space() {
    let folder = tempfile::tempdir().expect("a folder");
    let Robot(robot, domain) = robot();
    let [disk, copy] = ["disk", "copy.mcap"].map(|name| file(&folder, name));
    fs::create_dir(&disk).expect("makes");
    let output = Command::new("unshare")
        .args(["--mount", "sh", "-c", ONTO_A_SMALL_DISK, env!("CARGO_BIN_EXE_leo"), &disk, &copy])
        .arg(&domain)
        .output();
    let has_disk =
        |output: &Output| output.status.code() != Some(77) && !output.stderr.starts_with(b"unshare:");
    let Some(output) = output.ok().filter(has_disk) else {
        skip::skip("needs `unshare --mount` and the right to mount a tmpfs");
        return;
    };
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let err = String::from_utf8_lossy(&output.stderr);
    let [ended, refused, last] = err.lines().collect::<Vec<_>>()[..] else { panic!("{err}") };
    for (said, name) in [(ended, "full.mcap"), (refused, "again.mcap"), (last, "last.mcap")] {
        assert!(said.contains(name) && said.contains("3 MB"), "{said}");
    }
    let left_kb: u64 = String::from_utf8_lossy(&output.stdout).trim().parse().expect("kilobytes");
    assert!(left_kb > 500, "{left_kb} kB are left to others");
    let mut reader = Reader::open(Path::new(&copy)).expect("is a recording");
    let read = reader.by_ref().inspect(|frame| assert!(frame.is_ok(), "{frame:?}")).count();
    assert!(read > 500 && !reader.is_cut(), "{read}");
    // The robot is still running and can be recorded.
    let whole = file(&folder, "whole.mcap");
    let output = run_leo(&["record", &whole, "--for", "1", "--domain", &domain.display().to_string()]);
    assert_eq!(output.status, Some(0), "{output:?}");
    assert!(frames(&whole).len() > 500);
    robot.interrupt();
    let output = robot.end();
    assert_eq!(output.status, Some(0), "{output:?}");
    assert!(!output.out.contains("starts anew") && !output.err.contains("starts anew"), "{output:?}");
}

#[test]
fn recording_does_not_disturb_a_running_robot() {
    let folder = tempfile::tempdir().expect("a folder");
    let Robot(robot, domain) = robot();
    let domain = domain.display().to_string();
    let [whole, killed, to_the_end] = ["1.mcap", "2.mcap", "3.mcap"].map(|name| file(&folder, name));
    let record = |to: &str| {
        let (command, files) = leo(&["record", to, "--domain", &domain]);
        Leo::start(command, files)
    };
    let holds = |to: &str, count: usize| {
        wait_until(|| Reader::open(Path::new(to)).is_ok_and(|reader| reader.flatten().count() > count))
    };

    // Two recorders at once: one is killed, and its file can be read.
    let (first, second) = (record(&whole), record(&killed));
    assert!(holds(&killed, 500), "{}", second.said("err"));
    second.kill();
    let mut reader = Reader::open(Path::new(&killed)).expect("is a recording");
    assert!(reader.by_ref().all(|frame| frame.is_ok()) && reader.is_cut());

    // Ctrl-C ends the other one.
    assert!(holds(&whole, 500), "{}", first.said("err"));
    first.interrupt();
    let output = first.end();
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert!(output.out.contains("leo/beliefs/1 ") && output.out.contains("dropped"), "{output:?}");
    let mut reader = Reader::open(Path::new(&whole)).expect("is a recording");
    assert_eq!(reader.about().map(|about| about.time), Some(Time::Wall));
    let count = reader.by_ref().filter(Result::is_ok).count();
    assert!(!reader.is_cut());
    let said: usize =
        output.out.lines().filter_map(|line| line.split_whitespace().nth(1)?.parse::<usize>().ok()).sum();
    assert_eq!(said, count, "{output:?}");

    // A full disk ends the recording but not the robot.
    let full = run_leo(&["record", "/dev/full", "--domain", &domain]);
    assert_refused(&full, 1, &["/dev/full", "No space left"]);

    // A recording in wall time is replayed without comparison.
    let output = run_leo(&["replay", &whole]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert!(output.out.contains("nothing was compared: "), "{output:?}");
    // The replayed output itself is reproducible.
    let again = file(&folder, "again.mcap");
    let output = run_leo(&["replay", &whole, "--record", &again]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let output = run_leo(&["replay", &again]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert!(equal(&output, "leo/beliefs/1").is_some_and(|frames| frames > 50), "{output:?}");
    assert!(!output.out.contains("not compared"), "{output:?}");

    // The recording ends with the robot. A recorder that keeps the last seconds in memory writes them then.
    let last = file(&folder, "last.mcap");
    let (command, files) = leo(&["record", &last, "--domain", &domain, "--last", "1"]);
    let third = record(&to_the_end);
    let fourth = Leo::start(command, files);
    assert!(holds(&to_the_end, 8000), "{}", third.said("err"));
    assert!(!Path::new(&last).exists());
    robot.interrupt();
    for recorder in [third, fourth] {
        let output = recorder.end();
        assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    }
    let lasts = |file: &str| {
        let instants: Vec<u64> = frames(file)
            .iter()
            .filter(|frame| frame.topic == TopicId::Percepts)
            .map(|frame| frame.at_ns)
            .collect();
        (instants.len(), instants.iter().max().copied().expect("some"))
    };
    let ((all, until), (some, until_then)) = (lasts(&to_the_end), lasts(&last));
    assert!(some < all && some > 100, "{some} of {all}");
    assert!(until.abs_diff(until_then) < 1_000_000_000, "{until} {until_then}");
    // A busy machine may cause warnings, but no process died.
    let ended = robot.end();
    assert_eq!(ended.status, Some(0), "{ended:?}");
    assert!(!ended.err.contains("died") && !ended.err.contains("killed"), "{ended:?}");
}

#[test]
fn a_pipe_that_is_not_read_keeps_no_recording_from_ending() {
    let folder = tempfile::tempdir().expect("a folder");
    let Robot(robot, domain) = robot();
    let (pipe, domain) = (file(&folder, "pipe"), domain.display().to_string());
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("starts").success());
    let record = || leo(&["record", &pipe, "--domain", &domain]);
    let (mut command, _files) = record();
    let refused = command.output().expect("starts");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(1) && said.contains("no program reads"), "{refused:?}");
    // A reader that has opened the pipe, and reads nothing until the command has ended.
    let nonblocking = rustix::fs::OFlags::RDONLY | rustix::fs::OFlags::NONBLOCK;
    let reader = rustix::fs::open(&pipe, nonblocking, rustix::fs::Mode::empty()).expect("opens");
    let (command, files) = record();
    let recorder = Leo::start(command, files);
    let is_full = || rustix::io::ioctl_fionread(&reader).is_ok_and(|bytes| bytes >= 32_768);
    assert!(wait_until(is_full), "{}", recorder.said("err"));
    recorder.interrupt();
    let ended = recorder.end();
    assert!(ended.status == Some(1) && ended.err.contains("its reader has read nothing"), "{ended:?}");
    robot.interrupt();
    assert_eq!(robot.end().status, Some(0));
}

/// The recorder within a longer-lived process: started, queried and stopped, twice.
#[test]
fn a_recording_process_continues_its_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let Robot(robot, domain) = robot();
    let domain = transport::Domain::at(&domain).expect("a domain");
    // The process is also a node of the domain.
    let queues = transport::Queues { frames: 1, overflow_policy: transport::OverflowPolicy::DropOldest };
    let node = transport::Node::join(&domain, "test", 1, queues).expect("joins");
    for name in ["1.mcap", "2.mcap"] {
        let to = file(&folder, name);
        let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test").expect("built in");
        let recorder = recording::Recorder::start(
            &domain,
            subject,
            &folder::Output::named(Path::new(&to), Existing::Keep),
        )
        .expect("starts");
        assert!(wait_until(
            || recorder.counts().of(TopicId::Beliefs(1)).written > 100 || recorder.has_ended()
        ));
        assert!(!recorder.has_ended());
        let counts = recorder.stop().expect("is whole");
        let read = u64::try_from(frames(&to).len()).expect("fits");
        assert_eq!(counts.total().written, read);
    }
    let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test").expect("built in");
    let full = recording::Recorder::start(
        &domain,
        subject,
        &folder::Output::named(Path::new("/dev/full"), Existing::Keep),
    )
    .expect_err("is refused");
    assert!(full.to_string().contains("/dev/full"), "{full}");
    // The last seconds can be written at any time.
    let subject = Subject::load(None, Time::Wall, None, Pose::identity(), "a test").expect("built in");
    let recorder =
        recording::Recorder::keep(&domain, subject, std::time::Duration::from_secs(60), usize::MAX);
    let recorder = recorder.expect("starts");
    for name in ["3.mcap", "4.mcap"] {
        let seen = recorder.counts().of(TopicId::Beliefs(1)).written;
        assert!(wait_until(|| recorder.counts().of(TopicId::Beliefs(1)).written > seen + 100));
        let to = file(&folder, name);
        let saved = recorder
            .last()
            .expect("is kept")
            .write(&folder::Output::named(Path::new(&to), Existing::Replace))
            .expect("is written");
        assert_eq!(saved, u64::try_from(frames(&to).len()).expect("fits"));
    }
    assert!(
        recorder
            .last()
            .expect("is kept")
            .write(&folder::Output::named(Path::new("/dev/full"), Existing::Keep))
            .is_err()
    );
    recorder.stop().expect("ends");
    drop(node);
    robot.interrupt();
    assert_eq!(robot.end().status, Some(0));
}

#[test]
fn a_recording_overwrites_no_file_and_follows_no_link_by_default() {
    let folder = tempfile::tempdir().expect("a folder");
    let lesson = write(&folder, "short.toml", &short_lesson());
    let [theirs, link] = ["theirs.mcap", "link.mcap"].map(|name| file(&folder, name));
    fs::write(&theirs, "kept").expect("writes");
    std::os::unix::fs::symlink(&theirs, &link).expect("links");
    let record = |to: &str, more: &[&str]| run_leo(&[&["teach", &lesson, "--record", to], more].concat());
    assert_refused(&record(&theirs, &[]), 2, &[&theirs, "exists already", "--force"]);
    for more in [&[][..], &["--force"]] {
        assert_refused(&record(&link, more), 2, &[&link, "symbolic link"]);
    }
    assert_eq!(fs::read_to_string(&theirs).expect("reads"), "kept");
    // The option's older name.
    let output = record(&theirs, &["--overwrite"]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    assert!(!frames(&theirs).is_empty());
}

//! Compares acknowledged with durable changes, while real processes are killed and stopped, their disk fills up and
//! their clocks jump.
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use store::{Entry, Lost, Store, WriteError};

/// The environment variable with the path of the small disk.
const DISK: &str = "LEO_TEST_DISK";
const LIVES: u64 = 24;
const TASKS: u64 = 4;

/// Mounts a small private disk in a mount namespace and runs the histories on it.
const SCRIPT: &str = r#"
mount -t tmpfs -o size=400k tmpfs "$1" || exit 77
LEO_TEST_DISK="$1" exec "$0" histories --exact --ignored --nocapture
"#;

#[test]
fn acknowledged_writes_survive_kills_full_disks_and_clock_jumps() {
    let disk = tempfile::tempdir().expect("a folder");
    let mut inside = Command::new("unshare");
    inside.args(["--mount", "sh", "-c", SCRIPT]).arg(program()).arg(disk.path());
    let output = inside.output().expect("`unshare` is there");
    let (said, complained) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if output.status.code() == Some(77) || complained.starts_with("unshare:") {
        return skip::skip("needs `unshare --mount` and the right to mount a tmpfs");
    }
    assert!(output.status.success(), "{said}\n{complained}");
    println!("{said}");
}

fn program() -> PathBuf {
    std::env::current_exe().expect("has a path")
}

fn disk() -> Option<PathBuf> {
    std::env::var_os(DISK).map(PathBuf::from)
}

fn item(place: u64) -> String {
    format!("{place} {}", "x".repeat(900))
}

/// The next number of a pseudo-random sequence, below a bound.
fn below(state: &mut u64, bound: u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state % bound
}

/// A writer process: puts items until it is killed, and reports the acknowledged ones.
#[test]
#[ignore = "it writes until it is killed: the histories start it"]
fn writer() {
    let Some(disk) = disk() else { return };
    let path = disk.join("leo/learned.store");
    let mut store = Store::open(&path).unwrap_or_else(|error| panic!("{error}"));
    say("begun", "", 0);
    assert_eq!(store.findings().lost, Lost::Nothing, "{}", store.findings());
    assert!(store.findings().damaged.is_empty(), "{}", store.findings());
    let held = store.load::<String, String>().expect("is readable");
    let mut next: BTreeMap<String, u64> =
        held.iter().map(|entry| (entry.key.clone(), (0..).zip(&entry.items).count() as u64)).collect();
    for round in 0.. {
        let key = format!("task {}", round % TASKS);
        let place = next.entry(key.clone()).or_default();
        // As in the learner: a failed write is retried on a newly opened store.
        loop {
            match store.put(&key, &"head", *place, &item(*place)) {
                Ok(()) => break,
                Err(WriteError::Unwritable { .. } | WriteError::RepairFailed(_)) => say("full", &key, *place),
                Err(error) => panic!("{error}"),
            }
            drop(store);
            store = Store::open(&path).unwrap_or_else(|error| panic!("{error}"));
        }
        say("acknowledged", &key, *place);
        *place += 1;
        if *place > 20 {
            // The disk is small. Removed entries free their space when the store is opened again.
            if store.forget(&key).is_ok() {
                say("forgotten", &key, 0);
                *place = 0;
            }
            drop(store);
            store = Store::open(&path).unwrap_or_else(|error| panic!("{error}"));
        }
    }
}

fn say(what: &str, key: &str, place: u64) {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{what};{key};{place}").and_then(|()| out.flush()).expect("somebody listens");
}

/// A writer process in its own process group, with an offset of its clock.
struct Writer {
    child: Child,
    lines: Receiver<String>,
}

impl Writer {
    fn start(clock_s: i64, jumps: bool) -> Self {
        let mut command = if jumps {
            let mut command = Command::new("unshare");
            command.args(["--time", "--fork", "--monotonic", &clock_s.to_string()]).arg(program());
            command
        } else {
            Command::new(program())
        };
        command.args(["writer", "--exact", "--ignored", "--nocapture"]).process_group(0);
        let mut child = command.stdout(Stdio::piped()).stdin(Stdio::null()).spawn().expect("starts");
        let out = BufReader::new(child.stdout.take().expect("is piped"));
        let (to, lines) = channel();
        std::thread::spawn(move || out.lines().map_while(Result::ok).try_for_each(|line| to.send(line)));
        let writer = Self { child, lines };
        // `unshare` must not be stopped before it has started its child.
        while writer.line() != "begun;;0" {}
        writer
    }

    fn line(&self) -> String {
        match self.lines.recv_timeout(Duration::from_secs(60)) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => panic!("it says nothing"),
            Err(RecvTimeoutError::Disconnected) => panic!("it ended by itself"),
        }
    }

    fn signal(&self, name: &str) {
        let signal = format!("kill -s {name} -- -{}", self.child.id());
        let sent = Command::new("sh").args(["-c", &signal]).status().expect("there is a shell");
        assert!(sent.success(), "it ended by itself");
    }
}

/// The acknowledged changes: the number of items by task.
#[derive(Default)]
struct Acknowledged {
    count: BTreeMap<String, u64>,
    lines: u64,
    full: u64,
}

impl Acknowledged {
    fn note(&mut self, line: &str) {
        let mut parts = line.split(';');
        let (Some(what), Some(key), Some(place)) = (parts.next(), parts.next(), parts.next()) else { return };
        match what {
            "acknowledged" => {
                self.count.insert(key.to_owned(), place.parse::<u64>().expect("a number") + 1);
                self.lines += 1;
            }
            "forgotten" => drop(self.count.remove(key)),
            "full" => self.full += 1,
            _ => {}
        }
    }

    /// Compares them with the durable contents, and continues from those.
    fn compare(&mut self, path: &Path) {
        let mut store = Store::open(path).unwrap_or_else(|error| panic!("{error}"));
        assert!(store.findings().damaged.is_empty(), "{}", store.findings());
        let held: Vec<Entry<String, String>> = store.load().expect("is readable");
        let mut durable = BTreeMap::new();
        for Entry { key, items, .. } in held {
            for (place, found) in (0..).zip(&items) {
                assert_eq!(*found, item(place), "{key}");
            }
            durable.insert(key, (0_u64..).zip(&items).map(|(place, _)| place + 1).max().unwrap_or(0));
        }
        for (key, count) in &self.count {
            let there = durable.get(key).copied().unwrap_or(0);
            // A change in progress may be durable: one more item, or, for a full task, its removal.
            let was_forgotten = *count > 20 && there == 0;
            assert!(
                there == *count || there == count + 1 || was_forgotten,
                "{key}: {count} acknowledged, {there} there"
            );
        }
        self.count = durable;
    }
}

/// Runs writers one after the other, and kills or disturbs each in every way.
#[test]
#[ignore = "it needs a disk of its own: the test above makes one"]
fn histories() {
    let Some(disk) = disk() else { return };
    let (path, fill) = (disk.join("leo/learned.store"), disk.join("fill"));
    let has_clocks = Command::new("unshare")
        .args(["--time", "--fork", "true"])
        .status()
        .is_ok_and(|status| status.success());
    let (mut chance, mut acknowledged) = (2006, Acknowledged::default());
    let (mut stops, mut fills) = (0, 0);
    acknowledged.compare(&path);
    for _life in 0..LIVES {
        let clock_s = i64::try_from(below(&mut chance, 100_000_000)).expect("small");
        let writer = Writer::start(clock_s, has_clocks);
        for _ in 0..1 + below(&mut chance, 4) {
            match below(&mut chance, 3) {
                0 => {
                    writer.signal("STOP");
                    writer.signal("CONT");
                    stops += 1;
                }
                1 => {
                    fill_up(&fill);
                    fills += 1;
                }
                _ => drop(fs::remove_file(&fill)),
            }
            let lines = below(&mut chance, 30);
            for _ in 0..lines {
                acknowledged.note(&writer.line());
            }
        }
        writer.signal("KILL");
        let Writer { mut child, lines } = writer;
        child.wait().expect("is ours");
        lines.iter().for_each(|line| acknowledged.note(&line));
        let _gone = fs::remove_file(&fill);
        acknowledged.compare(&path);
    }
    println!(
        "{LIVES} lives killed, {stops} stops, the disk filled {fills} times, {} items acknowledged, {} refused, \
         clocks jump: {has_clocks}; nothing is lost",
        acknowledged.lines, acknowledged.full
    );
    assert!(acknowledged.lines > 300 && acknowledged.full > 0 && stops > 0, "too little happened");
}

/// Fills the disk.
fn fill_up(fill: &Path) {
    let Ok(mut file) = File::create(fill) else { return };
    while file.write_all(&[1; 1024]).is_ok() {}
}

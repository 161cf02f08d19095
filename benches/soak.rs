//! Soak test: the whole robot at full rate with a repeated lesson, a recording, three pages, scraped metrics,
//! requested black box dumps, and faults on buses, percepts and processes. Checks that memory, descriptors,
//! shared memory and disk use do not grow after warm-up.
//!
//! `cargo bench --bench soak [-- SECONDS]` (default 600, of which the first quarter is warm-up). The exit
//! status is 1 if something grew, a process was restarted, or the recorder dropped a frame.
#![expect(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a bench that cannot measure has failed, and prints"
)]

#[expect(dead_code, reason = "other benches use the rest")]
mod robot;

use std::collections::BTreeMap;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use clock::{Duration, Instant};
use quantity::number::{float, float_of_count};
use robot::{Robot, descriptors, files_below, leo, pause, shared_memory, wait_until};
use rustix::process::{Pid, Signal, kill_process};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::{Message, WebSocket};

const PAGES: usize = 3;
/// Sampling period.
const LOOK_EVERY: Duration = Duration::from_secs(5);
/// Period of the lesson; Task 1 takes 51 s.
const PLAY_EVERY: Duration = Duration::from_secs(60);
/// The black box takes two minutes to fill ...
const WARM_UP: Duration = Duration::from_secs(150);
/// ... and a dump is requested when it is full, and periodically. So its buffers are allocated during warm-up
/// and not at the first quarantine.
const ASK_FIRST: Duration = Duration::from_secs(122);
const ASK_EVERY: Duration = Duration::from_secs(60);
/// Allowed growth: a share, plus an absolute amount by unit.
const SHARE: f64 = 0.05;
const BESIDES: [(&str, f64); 4] = [("kB", 1500.0), ("descriptors", 3.0), ("files", 3.0), ("bytes", 64e3)];

/// Allowed growth for each lesson, because Leo stores the examples: two of 16 kB, in two copies.
const A_LESSON: [(&str, f64); 2] = [("learner kB", 300.0), ("bytes of what was learned", 80e3)];

/// Permanent faults that end no process, because the processes' resources are compared.
const CAMPAIGN: &str = r#"
seed = 2006
bus = ["drop p=0.005", "flip p=0.005", "noise p=0.005", "late p=0.002 by=8ms"]

[[percepts]]
kind = "drop"
probability = 0.01

[[percepts]]
kind = "nan"
probability = 0.005

[[percepts]]
kind = "reorder"
probability = 0.02
"#;

/// Period of stopped or slowed processes.
const HOLD_EVERY_S: u64 = 30;

fn campaign(seconds: u64) -> String {
    let holds = (HOLD_EVERY_S..seconds).step_by(usize::try_from(HOLD_EVERY_S).expect("small"));
    let hold = |(number, at): (usize, u64)| {
        let held = [
            ("stop", "motor", 0.3),
            ("slow", "learner", 2.0),
            ("stop", "sensor", 0.3),
            ("slow", "belief", 2.0),
        ];
        let (kind, process, long) = held.get(number % held.len()).copied().expect("one of them");
        format!(
            "\n[[processes]]\nkind = \"{kind}\"\nprocess = \"{process}\"\nat_s = {at}.0\nduration_s = {long}\n"
        )
    };
    CAMPAIGN.to_owned() + &holds.enumerate().map(hold).collect::<String>()
}

fn main() -> ExitCode {
    let seconds = std::env::args().filter_map(|argument| argument.parse().ok()).next().unwrap_or(600);
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let text = config::Robot::leo_text_with(&[
        // Long heartbeat time-outs, because the machine may be busy: no process shall be restarted.
        ("supervisor.heartbeat_timeout_ms", 30_000.0),
        ("supervisor.heartbeat_timeout_others_ms", 30_000.0),
    ])
    .replace("\"127.0.0.1:7780\"", "\"127.0.0.1:0\"");
    fs::write(folder.join("leo.toml"), text).expect("writes");
    let faults = folder.join("campaign.toml");
    fs::write(&faults, campaign(seconds)).expect("writes");
    let domain = PathBuf::from(format!("/dev/shm/leo-soak-{}", std::process::id()));
    let mut robot = Robot::start(&domain, folder, &["--faults", &faults.display().to_string()]);
    let came = wait_until(Duration::from_secs(60), || robot.is_back(&[]) && robot.page().is_some());
    assert!(came.is_some(), "the robot does not start: {}", robot.said());
    let at = robot.page().expect("it has a page");
    let file = folder.join("soak.mcap");
    let mut recorder =
        leo(&["record", "--domain"]).arg(&domain).arg(&file).stdout(Stdio::piped()).spawn().expect("starts");
    let recorder_pid = i32::try_from(recorder.id()).expect("a process number");
    let stop = Arc::new(AtomicBool::new(false));
    let [shown, scraped] = [(); 2].map(|()| Arc::new(AtomicU64::new(0)));
    let pages: Vec<_> = (0..PAGES)
        .map(|number| {
            let (at, stop, shown) = (at.clone(), Arc::clone(&stop), Arc::clone(&shown));
            thread::spawn(move || page(&at, number == 0, &stop, &shown))
        })
        .collect();
    let scraper = {
        let (at, stop, scraped) = (at.clone(), Arc::clone(&stop), Arc::clone(&scraped));
        thread::spawn(move || scrape(&at, &stop, &scraped))
    };

    let began = clock::now();
    let asker = {
        let (domain, stop) = (domain.clone(), Arc::clone(&stop));
        thread::spawn(move || ask(&domain, began + ASK_FIRST, &stop))
    };
    let mut samples = Vec::new();
    while clock::now().since(began) < Duration::from_secs(seconds) {
        pause(LOOK_EVERY);
        samples.push((clock::now(), held(&robot, recorder_pid, folder)));
    }
    let rows = robot.rows();
    stop.store(true, Ordering::Relaxed);
    pages.into_iter().for_each(|page| page.join().expect("a page runs on"));
    scraper.join().expect("the scraper runs on");
    let asked = asker.join().expect("the requester runs on");
    // Stopped before the robot, so that its counts cover what it saw.
    let _sent = kill_process(Pid::from_raw(recorder_pid).expect("a number"), Signal::INT);
    let mut told = String::new();
    recorder.stdout.take().expect("piped").read_to_string(&mut told).expect("text");
    let recorded = recorder.wait().expect("it ends").success();
    let bytes = fs::metadata(&file).map_or(0, |file| file.len());
    let ended = robot.end(Signal::INT);
    let left = shared_memory(&domain).0;

    println!(
        "{seconds} s, {PAGES} pages, {} bytes received by them, {} scrapes, {asked} black-box files requested",
        shown.load(Ordering::Relaxed),
        scraped.load(Ordering::Relaxed)
    );
    for row in &rows {
        let [overruns, drops, restarts, faults] =
            ["overruns", "drops", "restarts", "page_faults"].map(|key| &row[key]);
        let [process, cycles] = ["process", "cycles"].map(|key| &row[key]);
        let [wakeup, age] =
            ["/wakeup_us/p99", "/age_us/p99"].map(|key| row.pointer(key).cloned().unwrap_or_default());
        println!(
            "{process}: {cycles} cycles, {overruns} overruns, {drops} drops, {restarts} restarts, {faults} page \
             faults, p99 wake-up {wakeup} us, age {age} us"
        );
    }
    println!(
        "\n{told}recording: {:.0} MB, {:.2} MB/s\n",
        float(bytes) / 1e6,
        float(bytes) / 1e6 / float(seconds)
    );
    let mut wrong = compared(&samples, began + WARM_UP.max(Duration::from_secs(seconds / 4)));
    for row in rows.iter().filter(|row| row["restarts"].as_u64() != Some(0)) {
        wrong.push(format!("{} was restarted {} times", row["process"], row["restarts"]));
    }
    for row in rows.iter().filter(|row| row["broken_invariants"].as_u64() != Some(0)) {
        wrong.push(format!("{} found {} broken invariants", row["process"], row["broken_invariants"]));
    }
    if !told.contains("nothing was dropped") || !recorded {
        wrong.push("the recorder dropped frames".to_owned());
    }
    if robot.said().contains("panicked") || !ended || left > 0 {
        wrong.push(format!(
            "the robot did not end in order; {left} files are left in shared memory: {}",
            robot.said()
        ));
    }
    wrong.iter().for_each(|what| println!("WRONG: {what}"));
    if wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Current resource use by name, with the unit at the end.
fn held(robot: &Robot, recorder: i32, folder: &Path) -> BTreeMap<String, f64> {
    let mut held = BTreeMap::new();
    let mut processes = robot.processes();
    processes.insert("supervisor".to_owned(), robot.pid());
    processes.insert("recorder".to_owned(), recorder);
    for (name, pid) in processes {
        let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        let own = status.lines().find_map(|line| line.strip_prefix("RssAnon:")?.trim().strip_suffix(" kB"));
        let own: f64 = own.and_then(|own| own.trim().parse().ok()).unwrap_or(0.0);
        held.insert(format!("{name} kB"), own);
        held.insert(format!("{name} descriptors"), float_of_count(descriptors(pid)));
    }
    let (files, bytes) = shared_memory(&robot.domain);
    held.insert("shared memory files".to_owned(), float_of_count(files));
    held.insert("shared memory bytes".to_owned(), float(bytes));
    // Expected growth: by examples, and up to the quota of black box files.
    let (files, bytes) = files_below(&folder.join("leo/recordings"));
    let learned = files_below(&folder.join("leo")).1.saturating_sub(bytes);
    held.insert("bytes of what was learned".to_owned(), float(learned));
    held.insert("files of the black box".to_owned(), float_of_count(files));
    held
}

/// Prints the first and the last quarter after warm-up; returns what has grown.
fn compared(samples: &[(Instant, BTreeMap<String, f64>)], warm: Instant) -> Vec<String> {
    let warm: Vec<_> = samples.iter().filter(|(at, _)| *at >= warm).map(|(_, held)| held).collect();
    let quarter = (warm.len() / 4).max(1);
    let mean = |of: &[&BTreeMap<String, f64>], name: &str| {
        of.iter().filter_map(|held| held.get(name)).sum::<f64>() / float_of_count(of.len().max(1))
    };
    // Lessons between the middles of the two quarters, and one that had begun.
    let lessons = (float_of_count(warm.len()) * 0.75 * LOOK_EVERY.as_secs_f64() / PLAY_EVERY.as_secs_f64())
        .ceil()
        + 1.0;
    let (first, last) = (warm.get(..quarter).unwrap_or(&[]), warm.get(warm.len() - quarter..).unwrap_or(&[]));
    let mut wrong = Vec::new();
    println!("{:<28} {:>12} {:>12}", "", "after warm-up", "at the end");
    for name in warm.last().into_iter().flat_map(|held| held.keys()) {
        let (before, after) = (mean(first, name), mean(last, name));
        println!("{name:<28} {before:>12.0} {after:>12.0}");
        let max = match A_LESSON.iter().find(|(grows, _)| grows == name) {
            Some((_, a_lesson)) => Some(before + lessons * a_lesson),
            None => {
                let besides = BESIDES.iter().find(|(unit, _)| name.ends_with(unit));
                besides.map(|(_, besides)| before * (1.0 + SHARE) + besides)
            }
        };
        if max.is_some_and(|max| after > max) {
            // The course shows whether it is a step, saturates, or continues.
            let ten = warm.chunks(warm.len().div_ceil(10)).map(|some| format!("{:.0}", mean(some, name)));
            wrong.push(format!(
                "{name}: grew from {before:.0} to {after:.0}; means of tenths: {}",
                ten.collect::<Vec<_>>().join(", ")
            ));
        }
    }
    wrong
}

fn opened((host, token): &(String, String)) -> WebSocket<TcpStream> {
    let stream = TcpStream::connect(host).expect("it listens");
    stream.set_read_timeout(Some(Duration::from_secs(1))).expect("a time");
    let request = format!("ws://{host}/live?token={token}").into_client_request().expect("an address");
    tungstenite::client(request, stream).expect("it opens").0
}

/// A page that only reads; one of them restarts the lesson periodically.
fn page(at: &(String, String), plays: bool, stop: &AtomicBool, shown: &AtomicU64) {
    let mut socket = opened(at);
    let (mut played_at, mut id) = (clock::now(), 0);
    while !stop.load(Ordering::Relaxed) {
        if plays && clock::now().since(played_at) >= PLAY_EVERY {
            played_at = clock::now();
            id += 1;
            socket.send(Message::text(format!("{{\"id\":{id},\"do\":\"play\"}}"))).expect("sent");
        }
        match socket.read() {
            Ok(message) => {
                shown.fetch_add(u64::try_from(message.len()).unwrap_or(0), Ordering::Relaxed);
            }
            Err(tungstenite::Error::Io(_)) => {}
            Err(error) => panic!("the connection of a page was closed: {error}"),
        }
    }
}

fn scrape((host, token): &(String, String), stop: &AtomicBool, scraped: &AtomicU64) {
    while !stop.load(Ordering::Relaxed) {
        pause(Duration::from_secs(1));
        let mut stream = TcpStream::connect(host).expect("it listens");
        write!(stream, "GET /metrics?token={token} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")
            .expect("sent");
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("an answer");
        assert!(text.contains("leo_process_running"), "{text}");
        scraped.fetch_add(1, Ordering::Relaxed);
    }
}

/// Requests black box dumps periodically; returns their number.
fn ask(domain: &Path, first: Instant, stop: &AtomicBool) -> usize {
    let (mut next, mut written) = (first, 0);
    while !stop.load(Ordering::Relaxed) {
        pause(Duration::from_millis(200));
        if clock::now() < next {
            continue;
        }
        next += ASK_EVERY;
        let asked = leo(&["record", "--black-box", "--domain"]).arg(domain).output().expect("starts");
        let said = String::from_utf8_lossy(&asked.stderr);
        assert!(asked.status.success(), "the black box was not written: {said}");
        written += 1;
    }
    written
}

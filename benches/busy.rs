//! Benchmark of the servo buses on a busy machine: durations of the bus exchanges, missing replies, and buses
//! that were given up.
//!
//! Compares an idle machine with one full of threads that wake each other, as those of a browser or a
//! compiler do. The busy machine is measured with and without `supervisor.boost_serial_kworkers`, in turn.
//!
//! `cargo bench --bench busy [-- SECONDS [ROUNDS]]`: seconds per turn and rounds of three turns (default 10
//! and 3).
#![expect(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench that cannot measure has failed, and prints"
)]

#[expect(dead_code, reason = "other benches use the rest")]
mod robot;

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use clock::Duration;
use console_process::top::{About, Top};
use message::{BusHealth, Histogram};
use robot::{Robot, pause, wait_until};
use rustix::process::Signal;
use transport::Domain;

/// Groups of threads; in each, every writer sends messages to every reader.
const GROUPS: usize = 8;
const MEMBERS: usize = 20;
const MESSAGE: [u8; 100] = [0; 100];

/// The turns: name, whether the machine is busy, and whether serial lines are kept prompt.
const TURNS: [(&str, bool, bool); 3] = [
    ("idle machine", false, true),
    ("load, boosted lines", true, true),
    ("load, ordinary lines", true, false),
];

fn main() {
    let arguments: Vec<u64> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let seconds = arguments.first().copied().unwrap_or(10);
    // A process can join one domain only, so each turn has its own process.
    if let Some(turn) = arguments.get(2) {
        return measure(usize::try_from(*turn).expect("a turn"), seconds);
    }
    println!(
        "\nduration of requests on five buses, us; incomplete: requests with missing replies; {seconds} s per run\n"
    );
    println!(
        "{:<22} {:>8} {:>8} {:>8} {:>8} {:>11} {:>14}",
        "", "p50", "p99", "p99.9", "max", "incomplete", "buses lost"
    );
    let program = std::env::current_exe().expect("this program");
    for _round in 0..arguments.get(1).copied().unwrap_or(3) {
        for turn in 0..TURNS.len() {
            let numbers = [seconds.to_string(), "1".to_owned(), turn.to_string()];
            let ended = Command::new(&program).args(numbers).status().expect("starts");
            assert!(ended.success(), "the run failed");
        }
    }
}

fn measure(turn: usize, seconds: u64) {
    let (what, is_busy, are_prompt) = *TURNS.get(turn).expect("a turn");
    let folder = tempfile::tempdir().expect("a folder");
    let wanted = config::Robot::leo_text_with(&[]).replace("\"127.0.0.1:7780\"", "\"none\"");
    let key = "boost_serial_kworkers = ";
    let text = wanted.replace(&format!("{key}true"), &format!("{key}{are_prompt}"));
    assert!(are_prompt == (text == wanted), "the key is there");
    fs::write(folder.path().join("leo.toml"), text).expect("writes");
    let domain = format!("/dev/shm/leo-busy-{}", std::process::id());
    let domain = Path::new(&domain);
    let mut robot = Robot::start(domain, folder.path(), &[]);
    let came = wait_until(Duration::from_secs(60), || robot.is_back(&[]));
    assert!(came.is_some(), "the robot does not start: {}", robot.said());
    let mut top = Top::open(Domain::at(domain).expect("a domain"), About::default()).expect("a robot");
    let mut look = || top.look().0.buses;
    // By then the servos are armed and the initial requests are done.
    pause(Duration::from_secs(5));
    let load = is_busy.then(Load::new);
    let before = look();
    pause(Duration::from_secs(seconds));
    let after = look();
    drop(load);
    let mut took = Histogram::default();
    let pairs = || after.iter().zip(&before);
    pairs().for_each(|(after, before)| took.add(&after.exchange.since(&before.exchange)));
    let count =
        |of: fn(&BusHealth) -> u64| pairs().map(|(after, before)| of(after) - of(before)).sum::<u64>();
    let said = robot.said();
    let lost = said.lines().filter(|line| line.contains("none of its servos answers")).count();
    let us = |quantile| took.quantile_ns(quantile) / 1000;
    println!(
        "{what:<22} {:>8} {:>8} {:>8} {:>8} {:>11} {lost:>14}",
        us(0.5),
        us(0.99),
        us(0.999),
        took.max_ns() / 1000,
        count(|bus| bus.missed),
    );
    assert!(robot.end(Signal::INT), "the robot does not end in order: {}", robot.said());
}

/// Threads that write to each other until dropped.
struct Load {
    ends: Vec<Arc<UnixStream>>,
    threads: Vec<JoinHandle<()>>,
}

impl Load {
    fn new() -> Self {
        let mut load = Self { ends: Vec::new(), threads: Vec::new() };
        for _group in 0..GROUPS {
            let mut ends = Vec::new();
            for _reader in 0..MEMBERS {
                let (to, mut from) = UnixStream::pair().expect("a pair");
                ends.push(Arc::new(to));
                load.threads.push(thread::spawn(move || {
                    let mut message = MESSAGE;
                    while from.read_exact(&mut message).is_ok() {}
                }));
            }
            load.ends.extend(ends.iter().cloned());
            for _writer in 0..MEMBERS {
                let ends = ends.clone();
                load.threads.push(thread::spawn(move || {
                    while ends.iter().all(|end| end.as_ref().write_all(&MESSAGE).is_ok()) {}
                }));
            }
        }
        load
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.ends.iter().for_each(|end| end.shutdown(Shutdown::Both).expect("a stream"));
        self.threads.drain(..).for_each(|thread| thread.join().expect("ends"));
    }
}

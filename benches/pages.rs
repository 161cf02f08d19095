//! Benchmark of ten open pages: tail latency of the hot path with and without them, in turn, and the data
//! rate of a page. Measured with Task 1 and with a table of a hundred blocks. Each round has two turns
//! without pages; their difference is the noise of the machine.
//!
//! `cargo bench --bench pages [-- SECONDS [ROUNDS]]`: seconds per turn and rounds of three turns (default 10
//! and 9).
#![expect(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench that cannot measure has failed, and prints"
)]

#[expect(dead_code, reason = "other benches use the rest")]
mod robot;

use std::fs;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use clock::Duration;
use config::lesson::{Act, Lesson, Step};
use console_process::top::{About, Top};
use message::Histogram;
use quantity::number::{float, float_of_count};
use robot::{Robot, wait_until};
use transport::Domain;
use tungstenite::Error;
use tungstenite::client::IntoClientRequest as _;

/// Number of pages.
const PAGES: usize = 10;
/// The processes of the hot path.
const HOT: [&str; 3] = ["sensor", "belief", "motor"];
/// Number of blocks on the large table.
const BLOCKS: usize = 100;
/// Frame capacity, for the blocks and all else.
const CAPACITY: f64 = 128.0;

fn main() {
    // A process can join one domain only, so each table has its own process.
    let mut arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with('-'));
    let first = arguments.next();
    if first.as_deref() == Some("blocks") {
        return measure(true, arguments.filter_map(|argument| argument.parse().ok()));
    }
    let numbers: Vec<u64> =
        first.into_iter().chain(arguments).filter_map(|argument| argument.parse().ok()).collect();
    measure(false, numbers.iter().copied());
    let program = std::env::current_exe().expect("this program");
    let numbers = numbers.iter().map(ToString::to_string);
    let ended = std::process::Command::new(program).arg("blocks").args(numbers).status().expect("starts");
    assert!(ended.success());
}

fn measure(has_blocks: bool, mut numbers: impl Iterator<Item = u64>) {
    let (seconds, rounds) = (numbers.next().unwrap_or(10), numbers.next().unwrap_or(9));
    let rounds = usize::try_from(rounds).expect("a number of rounds");
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let capacity = if has_blocks { CAPACITY } else { 64.0 };
    let text = config::Robot::leo_text_with(&[("buffers.max_objects", capacity)]);
    fs::write(folder.join("leo.toml"), text.replace("\"127.0.0.1:7780\"", "\"127.0.0.1:0\""))
        .expect("writes");
    let lesson = folder.join("blocks.toml");
    let mut more = Vec::new();
    if has_blocks {
        let mut blocks = Lesson::synthetic(BLOCKS);
        for table in &mut blocks.demonstrations {
            // A teacher in a file has one hand and names the task.
            table.script.dedup_by_key(|step| step.at);
            let said = Act::Say("Leo, I can teach you to do nothing".to_owned());
            table.script.insert(1, Step { at: Duration::from_secs(1), who: 1, act: said });
        }
        fs::write(&lesson, blocks.to_toml()).expect("writes");
        more = vec!["--lesson", lesson.to_str().expect("text")];
    }
    let domain = format!("/dev/shm/leo-pages-{}", std::process::id());
    let domain = Path::new(&domain);
    let robot = Robot::start(domain, folder, &more);
    let came = wait_until(Duration::from_secs(60), || robot.is_back(&[]) && robot.page().is_some());
    assert!(came.is_some(), "the robot does not start: {}", robot.said());
    let (host, token) = robot.page().expect("it has a page");
    let mut top = Top::open(Domain::at(domain).expect("a domain"), About::default()).expect("a robot");
    let wait = |seconds| clock::sleep_until(clock::now() + Duration::from_secs(seconds));
    wait(5);
    let table = if has_blocks { "a hundred blocks" } else { "Task 1" };
    println!(
        "\n{table}: p99 of the wake-up latency, or of the input's age in event-driven processes, us; {seconds} s per run\n"
    );
    println!("{:<6} {:>9} {:>9} {:>9} {:>22}", "pages", "sensor", "belief", "motor", "kB/s to a page");
    let mut all = Vec::new();
    for round in 0..rounds {
        let mut turns = Vec::new();
        // The order of the turns rotates, so that drift of the machine affects all alike.
        for turn in 0..TURNS {
            let turn = (round + turn) % TURNS;
            let mut opened = (turn == WITH).then(|| Opened::new(&host, &token));
            wait(1);
            // The full state is sent once; then only changes.
            opened.iter_mut().for_each(Opened::begin);
            let before = late(&mut top);
            wait(seconds);
            let late: Vec<_> =
                late(&mut top).iter().zip(&before).map(|(after, before)| after.since(before)).collect();
            let sent = opened.map(|opened| format!("{:.0}", opened.shut() / 1e3 / float_of_count(PAGES)));
            let tails: String = late.iter().map(|late| format!(" {:>9.0}", p99_us([late]))).collect();
            let (pages, sent) = (if turn == WITH { PAGES } else { 0 }, sent.unwrap_or_default());
            println!("{pages:<6}{tails} {sent:>22}");
            turns.push((turn, late));
        }
        turns.sort_by_key(|(turn, _)| *turn);
        all.push(turns);
    }
    println!(
        "\np99 of {rounds} rounds together, and where it lies in 90 of 100 draws of as many rounds of them"
    );
    println!("{:<8} {:>28} {:>28}", "", "with / without", "without / without");
    for (hot, name) in HOT.iter().enumerate() {
        let of_this = |turns: &Vec<(usize, Vec<Histogram>)>| {
            let late: Vec<Histogram> = turns.iter().filter_map(|(_, late)| late.get(hot).copied()).collect();
            <[Histogram; TURNS]>::try_from(late).expect("every turn of every process")
        };
        let rounds: Vec<_> = all.iter().map(of_this).collect();
        let pages = ratio(&rounds, |[one, another, with]| (vec![with], vec![one, another]));
        let machine = ratio(&rounds, |[one, another, _]| (vec![another], vec![one]));
        println!("{name:<8} {pages:>28} {machine:>28}");
    }
}

/// Turns of a round: two without pages and one with.
const TURNS: usize = 3;
const WITH: usize = 2;

/// Lateness of each hot process since its start: frame age for a process woken by frames, wake-up latency for
/// a periodic one.
fn late(top: &mut Top) -> [Histogram; 3] {
    let (readings, _) = top.look();
    HOT.map(|name| {
        let health = readings.processes.iter().find(|(process, _)| process.name() == name);
        let (_, health) = health.expect("all run");
        if health.period_ns > 0 { health.wakeup } else { health.latency }
    })
}

/// The 99th percentile of several histograms together, in microseconds, interpolated within a bucket (1/16
/// wide).
fn p99_us<'a>(histograms: impl IntoIterator<Item = &'a Histogram>) -> f64 {
    let mut sum = Histogram::default();
    histograms.into_iter().for_each(|histogram| sum.add(histogram));
    let rank = 0.99 * float(sum.count());
    let mut before = 0.0;
    for (bound, count) in sum.buckets() {
        let count = f64::from(count);
        if before + count >= rank {
            let lowest = float(bound + 1) - float(1 << bound.ilog2().saturating_sub(4));
            return (lowest + (float(bound + 1) - lowest) * (rank - before) / count) / 1e3;
        }
        before += count;
    }
    f64::NAN
}

/// The ratio of two p99 values over all rounds, whose histograms `sides` selects, with a 90 % bootstrap
/// interval (rounds drawn with replacement).
fn ratio<'a, R>(
    rounds: &'a [R],
    sides: impl Fn(&'a R) -> (Vec<&'a Histogram>, Vec<&'a Histogram>),
) -> String {
    let of = |rounds: &[&'a R]| {
        let (one, other): (Vec<_>, Vec<_>) = rounds.iter().map(|round| sides(round)).unzip();
        p99_us(one.into_iter().flatten()) / p99_us(other.into_iter().flatten())
    };
    let mut seed = 2006_u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let index = usize::try_from(seed >> 33).expect("31 bits") % rounds.len();
        rounds.get(index).expect("within")
    };
    let mut drawn: Vec<f64> =
        (0..1000).map(|_| of(&rounds.iter().map(|_| draw()).collect::<Vec<_>>())).collect();
    drawn.sort_by(f64::total_cmp);
    let at = |index: usize| drawn.get(index).copied().unwrap_or(f64::NAN);
    format!("{:.3} ({:.3} to {:.3})", of(&rounds.iter().collect::<Vec<_>>()), at(50), at(949))
}

/// Read period of the pages. They stand for remote machines, whose cost is not the robot's.
const TAKEN_EVERY: Duration = Duration::from_millis(100);

/// Pages that only read.
struct Opened {
    shut: Arc<AtomicBool>,
    bytes: Arc<AtomicU64>,
    began: clock::Instant,
    reader: thread::JoinHandle<()>,
}

impl Opened {
    fn new(host: &str, token: &str) -> Self {
        let open = |_| {
            let stream = TcpStream::connect(host).expect("it listens");
            let request =
                format!("ws://{host}/live?token={token}").into_client_request().expect("an address");
            let (socket, _) = tungstenite::client(request, stream).expect("it opens");
            socket.get_ref().set_nonblocking(true).expect("a socket");
            socket
        };
        let mut sockets: Vec<_> = (0..PAGES).map(open).collect();
        let (shut, bytes) = (Arc::new(AtomicBool::default()), Arc::new(AtomicU64::default()));
        let (is_shut, counted) = (Arc::clone(&shut), Arc::clone(&bytes));
        let reader = thread::spawn(move || {
            while !is_shut.load(Ordering::Relaxed) {
                clock::sleep_until(clock::now() + TAKEN_EVERY);
                for socket in &mut sockets {
                    loop {
                        let message = match socket.read() {
                            Ok(message) => message,
                            Err(Error::Io(none)) if none.kind() == ErrorKind::WouldBlock => break,
                            Err(gone) => unreachable!("a page was closed: {gone}"),
                        };
                        counted.fetch_add(u64::try_from(message.len()).unwrap_or(0), Ordering::Relaxed);
                    }
                }
            }
        });
        Self { shut, bytes, began: clock::now(), reader }
    }

    /// Restarts the byte count.
    fn begin(&mut self) {
        self.bytes.store(0, Ordering::Relaxed);
        self.began = clock::now();
    }

    /// Closes the pages; returns the bytes per second of all together.
    fn shut(self) -> f64 {
        self.shut.store(true, Ordering::Relaxed);
        self.reader.join().expect("every page was read to the end");
        let took = clock::now().since(self.began).as_secs_f64();
        float(self.bytes.load(Ordering::Relaxed)) / took
    }
}

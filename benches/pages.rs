//! What ten open pages cost the robot: tails of the hot path with and without them, in turns in one run, and what
//! a page is sent: of Task 1, and of a table with a hundred blocks.
//!
//! `cargo bench --bench pages [-- SECONDS [ROUNDS]]`: so long per turn, and so many turns with and without;
//! ten and nine without.
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
use console_process::top::{About, Row, Top};
use quantity::number::{float, float_of_count};
use robot::{Robot, wait_until};
use transport::Domain;
use tungstenite::Error;
use tungstenite::client::IntoClientRequest as _;

/// Pages at once.
const PAGES: usize = 10;
/// The processes of the hot path.
const HOT: [&str; 3] = ["sensor", "belief", "motor"];
/// Blocks of the large table.
const BLOCKS: usize = 100;
/// Frames of that many things, and of what is where else.
const CAPACITY: f64 = 128.0;

fn main() {
    // A process looks into one domain in its life: each table has one of its own.
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
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let capacity = if has_blocks { CAPACITY } else { 64.0 };
    let text = config::Robot::leo_text_with(&[("buffers.objects", capacity)]);
    fs::write(folder.join("leo.toml"), text.replace("\"127.0.0.1:7780\"", "\"127.0.0.1:0\""))
        .expect("writes");
    let lesson = folder.join("blocks.toml");
    let mut more = Vec::new();
    if has_blocks {
        let mut blocks = Lesson::synthetic(BLOCKS);
        for table in &mut blocks.demonstrations {
            // Who teaches by a file has one hand, and says what he teaches.
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
    assert!(came.is_some(), "it does not start: {}", robot.said());
    let host = robot.page().expect("it has a page");
    let mut top = Top::open(Some(Domain::at(domain).expect("a domain")), About::default()).expect("a robot");
    let wait = |seconds| clock::sleep_until(clock::now() + Duration::from_secs(seconds));
    wait(5);
    let table = if has_blocks { "a hundred blocks" } else { "Task 1" };
    println!("\n{table}: p99 in us of wake-up, or of age where a process is woken; {seconds} s per turn\n");
    println!("{:<6} {:>9} {:>9} {:>9} {:>22}", "pages", "sensor", "belief", "motor", "kB/s to a page");
    let mut ratios: [Vec<f64>; 3] = Default::default();
    for round in 0..rounds {
        let mut tails = ([0.0; 3], [0.0; 3]);
        // What the machine does besides is the same for both, on the whole, if neither is always first.
        for with in [round % 2 == 1, round % 2 == 0] {
            let mut opened = with.then(|| Opened::new(&host));
            wait(1);
            // Whatever there is goes out once; then what changes.
            opened.iter_mut().for_each(Opened::begin);
            let _before = top.look();
            wait(seconds);
            let (_, rows) = top.look();
            let sent = opened.map(|opened| opened.shut() / 1e3 / float_of_count(PAGES));
            let tail = HOT.map(|name| rows.iter().find(|row| row.process == name).map_or(f64::NAN, late));
            let [sensor, belief, motor] = tail;
            let pages = if with { PAGES } else { 0 };
            let sent = sent.map_or(String::new(), |sent| format!("{sent:.0}"));
            println!("{pages:<6} {sensor:>9.0} {belief:>9.0} {motor:>9.0} {sent:>22}");
            *(if with { &mut tails.1 } else { &mut tails.0 }) = tail;
        }
        let (without, with) = tails;
        for ((ratios, with), without) in ratios.iter_mut().zip(with).zip(without) {
            ratios.push(with / without);
        }
    }
    println!("\np99 with {PAGES} pages / without: median of {rounds} rounds, and the quartiles");
    for (name, mut ratios) in HOT.iter().zip(ratios) {
        ratios.sort_by(f64::total_cmp);
        let at = |quarter: usize| ratios.get((ratios.len() - 1) * quarter / 4).copied().unwrap_or(f64::NAN);
        println!("{name:<8} {:.2}  ({:.2} to {:.2})", at(2), at(1), at(3));
    }
}

/// A woken process has an age, one with a period a wake-up.
fn late(row: &Row) -> f64 {
    row.wakeup_us.p99.max(row.age_us.p99)
}

/// How often pages take what they were sent: pages are elsewhere, and what taking it costs is not the robot's.
const TAKEN_EVERY: Duration = Duration::from_millis(100);

/// Pages that read whatever they are sent.
struct Opened {
    shut: Arc<AtomicBool>,
    bytes: Arc<AtomicU64>,
    began: clock::Instant,
    reader: thread::JoinHandle<()>,
}

impl Opened {
    fn new(host: &str) -> Self {
        let open = |_| {
            let stream = TcpStream::connect(host).expect("it listens");
            let request = format!("ws://{host}/live").into_client_request().expect("an address");
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

    /// Counts from now on.
    fn begin(&mut self) {
        self.bytes.store(0, Ordering::Relaxed);
        self.began = clock::now();
    }

    /// Bytes a second of all together.
    fn shut(self) -> f64 {
        self.shut.store(true, Ordering::Relaxed);
        self.reader.join().expect("every page was read to the end");
        let took = clock::now().since(self.began).as_secs_f64();
        float(self.bytes.load(Ordering::Relaxed)) / took
    }
}

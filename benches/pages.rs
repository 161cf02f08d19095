//! What ten open pages cost the robot: rates and tails of the hot path with and without them, in turns in one
//! run, and what a page is sent.
//!
//! `cargo bench --bench pages [-- SECONDS]`: so long per turn, ten by default.
#![expect(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench that cannot measure has failed, and prints"
)]

use std::io::{BufRead as _, BufReader};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use clock::Duration;
use console_process::top::{About, Row, Top};
use transport::Domain;
use tungstenite::client::IntoClientRequest as _;

/// Pages at once.
const PAGES: usize = 10;
/// Turns with and without them.
const TURNS: usize = 5;
/// The processes of the hot path.
const HOT: [&str; 3] = ["sensor", "belief", "motor"];

fn main() {
    let seconds = std::env::args().filter_map(|argument| argument.parse().ok()).next().unwrap_or(10);
    let domain = format!("/dev/shm/leo-pages-{}", std::process::id());
    let mut robot = Command::new(env!("CARGO_BIN_EXE_leo"))
        .args(["run", "--for", "3600", "--domain", &domain])
        .env("XDG_STATE_HOME", std::env::temp_dir().join(format!("leo-pages-{}", std::process::id())))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("starts");
    let mut lines = BufReader::new(robot.stdout.take().expect("piped")).lines();
    let first = lines.next().expect("it says where its page is").expect("text");
    let host = first.trim_start_matches("the page is at http://").trim_end_matches('/').to_owned();
    thread::spawn(move || lines.map_while(Result::ok).count());
    let domain = Domain::at(domain.as_ref()).expect("a domain");
    let mut top = Top::open(Some(domain), About::default()).expect("a robot");
    let wait = |seconds| clock::sleep_until(clock::now() + Duration::from_secs(seconds));
    wait(5);
    println!("p99 in us of release to start, start to end, and age of the input; {seconds} s per turn\n");
    println!("{:<6} {:<8} {:>9} {:>9} {:>9}", "pages", "process", "wake-up", "execution", "age");
    let mut sums = [[0.0; 3]; 2];
    for _ in 0..TURNS {
        for (with, sums) in sums.iter_mut().enumerate() {
            let opened = (with == 1).then(|| Opened::new(&host));
            wait(1);
            let _before = top.look();
            wait(seconds);
            let (_, rows) = top.look();
            for (row, sum) in hot(&rows).zip(sums) {
                let pages = with * PAGES;
                let [wakeup, execution, age] = [row.wakeup_us.p99, row.execution_us.p99, row.age_us.p99];
                println!("{pages:<6} {:<8} {wakeup:>9.0} {execution:>9.0} {age:>9.0}", row.process);
                // A woken process has an age, one with a period a wake-up.
                *sum += wakeup.max(age);
            }
            if let Some(opened) = opened {
                println!(
                    "       a page was sent {:.0} kB/s",
                    opened.shut() / 1e3 / quantity::number::float_of_count(PAGES)
                );
            }
        }
    }
    let [without, with] = sums;
    println!("\nmean p99 with {PAGES} pages / without, of wake-up, or of age where a process is woken");
    for ((name, without), with) in HOT.iter().zip(without).zip(with) {
        println!("{name:<8} {:.2}", with / without);
    }
    robot.kill().expect("it lives");
    robot.wait().expect("it ends");
}

fn hot(rows: &[Row]) -> impl Iterator<Item = &Row> {
    HOT.iter().filter_map(|name| rows.iter().find(|row| row.process == *name))
}

/// Pages that read whatever they are sent.
struct Opened {
    shut: Arc<AtomicBool>,
    bytes: Arc<AtomicU64>,
    began: clock::Instant,
}

impl Opened {
    fn new(host: &str) -> Self {
        let opened = Self { shut: Arc::default(), bytes: Arc::default(), began: clock::now() };
        for _ in 0..PAGES {
            let stream = TcpStream::connect(host).expect("it listens");
            let request = format!("ws://{host}/live").into_client_request().expect("an address");
            let (mut socket, _) = tungstenite::client(request, stream).expect("it opens");
            let (shut, bytes) = (Arc::clone(&opened.shut), Arc::clone(&opened.bytes));
            thread::spawn(move || {
                while !shut.load(Ordering::Relaxed) {
                    let Ok(message) = socket.read() else { break };
                    bytes.fetch_add(u64::try_from(message.len()).unwrap_or(0), Ordering::Relaxed);
                }
            });
        }
        opened
    }

    /// Bytes a second of all together.
    fn shut(self) -> f64 {
        self.shut.store(true, Ordering::Relaxed);
        let took = clock::now().since(self.began).as_secs_f64();
        quantity::number::float(self.bytes.load(Ordering::Relaxed)) / took
    }
}

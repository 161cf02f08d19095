use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use clock::Duration;

use crate::robot::{Host, MAX_WAIT, Robot};

/// Number of half-open connections.
const FLOOD: usize = 250;
/// When the page closes a half-open connection.
const EXPIRES: Duration = Duration::from_secs(1);

/// A connection with an incomplete request.
fn half_open(host: &Host) -> Option<TcpStream> {
    let mut stream = TcpStream::connect(&**host).ok()?;
    stream.write_all(b"GET /metrics HTTP/1.1\r\nHo").ok()?;
    stream.set_nonblocking(true).ok()?;
    Some(stream)
}

/// Keeps the flood up: closed connections are opened again.
fn flood(host: &Host, opened: &AtomicU64, over: &AtomicBool) {
    let mut all: Vec<Option<TcpStream>> = (0..FLOOD).map(|_| None).collect();
    while !over.load(Ordering::Relaxed) {
        for one in &mut all {
            let waits = |stream: &mut TcpStream| matches!(stream.read(&mut [0; 64]), Err(error) if error.kind() == ErrorKind::WouldBlock);
            if !one.as_mut().is_some_and(waits) {
                *one = half_open(host);
                opened.fetch_add(1, Ordering::Relaxed);
            }
        }
        thread::yield_now();
    }
}

/// The answer to a request and its duration.
fn timed(host: &Host, request: &str) -> (String, Duration) {
    let began = clock::now();
    let mut stream = TcpStream::connect(&**host).expect("it listens");
    stream.set_read_timeout(Some(MAX_WAIT)).expect("a time");
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = String::new();
    let _shut = stream.read_to_string(&mut answer);
    (answer, clock::now().since(began))
}

#[test]
fn half_open_connections_block_neither_metrics_nor_the_stop() {
    let robot = Robot::start("flood");
    let host = &robot.host;
    let (opened, over) = (AtomicU64::new(0), AtomicBool::new(false));
    thread::scope(|scope| {
        scope.spawn(|| flood(host, &opened, &over));
        let end = clock::now() + MAX_WAIT;
        while opened.load(Ordering::Relaxed) < u64::try_from(2 * FLOOD).expect("small") && clock::now() < end
        {
            thread::yield_now();
        }
        let metrics = format!(
            "GET /metrics HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nAuthorization: Bearer {}\r\n\r\n",
            host.token
        );
        let answers: Vec<_> = (0..20).map(|_| timed(host, &metrics)).collect();
        let stop = format!("POST /stop HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        let stopped = timed(host, &stop);
        over.store(true, Ordering::Relaxed);
        for (answer, took) in &answers {
            assert!(answer.contains("leo_process_running"), "after {took:?}: {answer}");
        }
        // A blocked server answers none before the half-open connections have expired.
        let mut times: Vec<Duration> = answers.into_iter().map(|(_, took)| took).collect();
        times.sort_unstable();
        assert!(times.get(times.len() / 2).is_some_and(|median| *median < EXPIRES), "{times:?}");
        let (answer, took) = stopped;
        assert!(answer.starts_with("HTTP/1.1 200"), "after {took:?}: {answer}");
    });
    assert!(robot.domain().join("emergency-stop").exists());
}

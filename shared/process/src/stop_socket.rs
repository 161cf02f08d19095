//! The stop socket: any local user may raise a robot's emergency stop, and do nothing else to the robot.
//!
//! It is an abstract Unix socket, so that no file remains; its name contains the robot's folder. A connection raises
//! the stop, and the client sends nothing. The answer is one line with the exit status of `leo emergency-stop`, then
//! the output of that command.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, Read as _, Write as _};
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::MetadataExt as _;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use clock::Instant;
use rustix::io::Errno;
use rustix::net::sockopt::socket_peercred;
use rustix::net::{
    AddressFamily, Shutdown, SocketAddrUnix, SocketFlags, SocketType, connect as connect_to, shutdown,
    socket_with,
};

use crate::ProcessError;

/// Prefix of the names of all stop sockets, before the robot's folder.
const PREFIX: &str = "leo-emergency-stop:";
/// The kernel's list of sockets, which every user may read.
const LIST: &str = "/proc/net/unix";
/// Maximum number of concurrent answers. A further client stops the robot too, but gets no details.
const MAX_CONCURRENT_ANSWERS: usize = 8;
/// Timeout for writing the answer to a client that does not read.
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);
/// Maximum length of an answer in bytes: one line for each of the maximum number of servos.
const MAX_ANSWER_BYTES: usize = 64 << 10;

/// Answer to a stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StopAnswer {
    /// The exit status of `leo emergency-stop`: 0 if every servo has confirmed.
    pub status: u8,
    /// The output of that command, without control characters.
    pub text: String,
}

/// A robot whose emergency stop was raised over its stop socket.
#[derive(Debug)]
pub struct StoppedRobot {
    /// Its folder.
    pub domain: PathBuf,
    /// The user id of the robot's owner.
    pub owner: u32,
    stream: UnixStream,
}

impl StoppedRobot {
    /// The folders of the robots on this machine that have a stop socket, sorted.
    #[must_use]
    pub fn all() -> Vec<PathBuf> {
        let list = fs::read(LIST).unwrap_or_default();
        let mut all: Vec<PathBuf> = list.split(|byte| *byte == b'\n').filter_map(parse_domain).collect();
        all.sort();
        // An open connection is listed too, under its listener's name.
        all.dedup();
        all
    }

    /// Raises the emergency stop of the robot in a folder. Retries until an instant, but tries at least once. A robot
    /// accepts a connection at once; a foreign process that has taken the name may not.
    ///
    /// # Errors
    ///
    /// The robot has no stop socket, or the socket and the folder belong to different users.
    pub fn stop(domain: &Path, until: Instant) -> io::Result<Self> {
        let stream = connect(domain, until)?;
        let owner = socket_peercred(&stream)?.uid.as_raw();
        // Any user may take a free name.
        let real = fs::symlink_metadata(domain).map(|folder| folder.uid()).ok();
        if let Some(real) = real.filter(|real| *real != owner) {
            return Err(io::Error::other(format!(
                "the user with the number {owner} owns the name of its stop socket, and the robot belongs to the user \
                 with the number {real}"
            )));
        }
        Ok(Self { domain: domain.to_owned(), owner, stream })
    }

    /// Waits for the answer until an instant.
    ///
    /// # Errors
    ///
    /// The robot does not answer in time, or the answer is malformed.
    pub fn answer(mut self, until: Instant) -> io::Result<StopAnswer> {
        let mut text = Vec::new();
        let mut part = [0; 4096];
        // The deadline also holds for a peer that sends single bytes at intervals.
        while text.len() < MAX_ANSWER_BYTES {
            let left = until.since(clock::now());
            if left.is_zero() {
                return Err(io::ErrorKind::TimedOut.into());
            }
            self.stream.set_read_timeout(Some(left))?;
            let length = match self.stream.read(&mut part) {
                Ok(0) => break,
                Ok(length) => length,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            text.extend_from_slice(part.get(..length).unwrap_or_default());
        }
        let text = String::from_utf8_lossy(&text);
        let answer = text.split_once('\n').and_then(|(status, text)| Some((status.parse().ok()?, text)));
        let (status, text) =
            answer.ok_or_else(|| io::Error::other("it was reached, and did not report the result"))?;
        // Another user's text is printed to a terminal, so remove control characters.
        let is_plain = |letter: &char| !letter.is_control() || *letter == '\n';
        Ok(StopAnswer { status, text: text.chars().filter(is_plain).collect() })
    }
}

/// The folder in a line of the kernel's list, if it is that of a stop socket.
fn parse_domain(line: &[u8]) -> Option<PathBuf> {
    // In the list, an abstract socket's name follows this character.
    let name = line.splitn(2, |byte| *byte == b'@').nth(1)?.strip_prefix(PREFIX.as_bytes())?;
    Some(PathBuf::from(OsStr::from_bytes(name)))
}

fn name(domain: &Path) -> Vec<u8> {
    [PREFIX.as_bytes(), domain.as_os_str().as_bytes()].concat()
}

/// Connects without blocking: a listener that never accepts would block an ordinary call for ever.
fn connect(domain: &Path, until: Instant) -> io::Result<UnixStream> {
    let address = SocketAddrUnix::new_abstract_name(&name(domain))?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
    loop {
        match connect_to(&socket, &address) {
            Ok(()) => break,
            Err(Errno::AGAIN) if clock::now() < until => {
                clock::sleep_until(clock::now() + Duration::from_millis(5));
            }
            Err(error) => return Err(error.into()),
        }
    }
    let stream = UnixStream::from(socket);
    stream.set_nonblocking(false)?;
    Ok(stream)
}

/// The listening stop socket of a robot.
#[derive(Debug)]
pub struct StopSocket {
    listener: Arc<UnixListener>,
    thread: Option<JoinHandle<()>>,
}

impl StopSocket {
    /// Listens for the robot in a folder. For each connection it calls `stop` at once with the user id of the client,
    /// and then `answer` in a separate thread.
    ///
    /// # Errors
    ///
    /// Another process holds the name, the folder's name is too long for a socket, or the thread cannot be started.
    pub fn listen(
        domain: &Path,
        stop: impl Fn(u32) + Send + 'static,
        answer: impl Fn(u32) -> StopAnswer + Send + Sync + 'static,
    ) -> Result<Self, ProcessError> {
        let failed =
            |error: io::Error| ProcessError::own(format!("{}: no stop socket: {error}", domain.display()));
        let address = SocketAddr::from_abstract_name(name(domain));
        let bound = address.and_then(|address| UnixListener::bind_addr(&address));
        let listener = Arc::new(bound.map_err(failed)?);
        let accepting = Arc::clone(&listener);
        let answer = Arc::new(answer);
        let thread = thread::Builder::new()
            .name("stop socket".to_owned())
            .spawn(move || accept(&accepting, &stop, &answer))
            .map_err(failed)?;
        Ok(Self { listener, thread: Some(thread) })
    }
}

impl Drop for StopSocket {
    fn drop(&mut self) {
        let is_told = shutdown(&self.listener, Shutdown::Both).is_ok();
        if let Some(thread) = self.thread.take().filter(|_| is_told) {
            // A thread that panicked has already reported it.
            let _ended = thread.join();
        }
    }
}

fn accept(
    listener: &UnixListener,
    stop: &dyn Fn(u32),
    answer: &Arc<impl Fn(u32) -> StopAnswer + Send + Sync + 'static>,
) {
    let answered = Arc::new(AtomicUsize::new(0));
    loop {
        let stream = match listener.accept() {
            Ok((stream, _)) => stream,
            // The listener was shut down.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => return,
            // The client has disconnected, or no file descriptor is free. The next connection stops the robot all the
            // same.
            Err(_) => {
                clock::sleep_until(clock::now() + Duration::from_millis(10));
                continue;
            }
        };
        let Ok(user) = socket_peercred(&stream).map(|peer| peer.uid.as_raw()) else { continue };
        stop(user);
        if answered.load(Ordering::Relaxed) >= MAX_CONCURRENT_ANSWERS {
            say(
                stream,
                &StopAnswer { status: 1, text: "raised, but NOT CONFIRMED: too many requests\n".to_owned() },
            );
            continue;
        }
        answered.fetch_add(1, Ordering::Relaxed);
        let (answer, done) = (Arc::clone(answer), Arc::clone(&answered));
        let talk = move || {
            say(stream, &answer(user));
            done.fetch_sub(1, Ordering::Relaxed);
        };
        if thread::Builder::new().name("stop answer".to_owned()).spawn(talk).is_err() {
            answered.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

fn say(mut stream: UnixStream, answer: &StopAnswer) {
    let text = format!("{}\n{}", answer.status, answer.text);
    // A client need not wait for the answer, so ignore write errors.
    let _sent =
        stream.set_write_timeout(Some(WRITE_TIMEOUT)).and_then(|()| stream.write_all(text.as_bytes()));
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    fn soon() -> Instant {
        clock::now() + Duration::from_secs(60)
    }

    fn domain(name: &str) -> PathBuf {
        PathBuf::from(format!("/dev/shm/leo-{name}-{}", std::process::id()))
    }

    #[test]
    fn a_connection_raises_the_stop_and_gets_the_result() {
        let domain = domain("socket");
        assert!(StoppedRobot::stop(&domain, soon()).is_err());
        let (stopped, stops) = channel();
        let confirmed = |_| StopAnswer { status: 0, text: "all \u{1b}[2Jwell\n".to_owned() };
        let socket = StopSocket::listen(&domain, move |user| stopped.send(user).unwrap(), confirmed).unwrap();
        assert!(StoppedRobot::all().contains(&domain));
        let robot = StoppedRobot::stop(&domain, soon()).unwrap();
        let user = rustix::process::geteuid().as_raw();
        assert_eq!((robot.owner, stops.recv().unwrap()), (user, user));
        let answer = robot.answer(soon()).unwrap();
        assert_eq!(answer, StopAnswer { status: 0, text: "all [2Jwell\n".to_owned() });

        let second = StopSocket::listen(&domain, |_| {}, confirmed).unwrap_err();
        assert!(second.to_string().contains("no stop socket"), "{second}");
        drop(socket);
        assert!(!StoppedRobot::all().contains(&domain));
        assert!(StoppedRobot::stop(&domain, soon()).is_err());
    }

    #[test]
    fn silent_connections_do_not_block_a_stop() {
        let domain = domain("silent");
        let (stopped, stops) = channel();
        let (go, wait) = channel::<()>();
        let wait = std::sync::Mutex::new(wait);
        let answer = move |_| {
            let _over = wait.lock().unwrap().recv();
            StopAnswer { status: 0, text: String::new() }
        };
        let socket = StopSocket::listen(&domain, move |user| stopped.send(user).unwrap(), answer).unwrap();
        let robots: Vec<_> =
            (0..3 * MAX_CONCURRENT_ANSWERS).map(|_| StoppedRobot::stop(&domain, soon()).unwrap()).collect();
        for _ in &robots {
            stops.recv().unwrap();
        }
        // The last client is told at once that the result is not confirmed.
        let last = robots.into_iter().next_back().unwrap().answer(soon()).unwrap();
        assert!(last.status == 1 && last.text.contains("too many requests"), "{last:?}");
        drop(go);
        drop(socket);
    }

    #[test]
    fn a_foreign_or_slow_stop_socket_does_not_block_the_caller() {
        let domain = domain("held");
        let held = UnixListener::bind_addr(&SocketAddr::from_abstract_name(name(&domain)).unwrap()).unwrap();
        rustix::net::listen(&held, 0).unwrap();
        let queued = StoppedRobot::stop(&domain, soon()).unwrap();
        let refused = StoppedRobot::stop(&domain, clock::now()).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::WouldBlock, "{refused}");
        let mut rogue = held.accept().unwrap().0;
        let sends = thread::spawn(move || while rogue.write_all(b"1").is_ok() {});
        let until = clock::now() + Duration::from_millis(50);
        let told = queued.answer(until).unwrap_err();
        assert!(clock::now() >= until || told.to_string().contains("does not say"), "{told}");
        sends.join().unwrap();
    }

    #[test]
    fn the_kernels_list_is_read_for_stop_sockets_alone() {
        let line = b"ffff9c: 00000002 00000000 00010000 0001 01 31337 @leo-emergency-stop:/dev/shm/leo-7";
        assert_eq!(parse_domain(line).as_deref(), Some(Path::new("/dev/shm/leo-7")));
        let others = [
            "Num RefCount Protocol Flags Type St Inode Path",
            "f: 2 0 0 1 1 3 /run/x",
            "f: 2 0 0 1 1 3 @/tmp/x",
            "",
        ];
        for other in others {
            assert_eq!(parse_domain(other.as_bytes()), None, "{other}");
        }
    }
}

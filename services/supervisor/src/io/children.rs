use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};

use clock::Duration;
use message::Process;
use process::Launch;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitId, WaitIdOptions, pidfd_open, pidfd_send_signal, waitid,
};

use crate::RosterPublisher;

/// The running program, even if its file has been replaced since: an upgrade of the package does not affect a running
/// robot.
pub(crate) const PROGRAM: &str = "/proc/self/exe";

/// Logging options of this program that its child processes inherit.
const LOG_OPTIONS: [&str; 3] = ["-v", "--verbose", "--log-json"];

/// Polling interval while the motor process stops.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// The running child processes, all started from this program's own executable. Dropping it kills them. In wall time,
/// the motor process is first asked to stop and is killed last, after its timeout.
#[derive(Debug)]
pub struct Children {
    /// `argv[0]` of the processes.
    name: PathBuf,
    /// The options of [`LOG_OPTIONS`] that this program was given.
    log_options: Vec<OsString>,
    living: BTreeMap<Process, ChildProcess>,
    /// Publishes the processes' identities in shared memory.
    roster: Option<RosterPublisher>,
    helpers: Vec<Child>,
    /// Stop timeout of a motor process in wall time.
    motor_stop_timeout: Option<Duration>,
}

#[derive(Debug)]
struct ChildProcess {
    child: Child,
    pidfd: OwnedFd,
}

impl ChildProcess {
    /// Whether it has ended. It is not reaped, so its process id stays reserved.
    fn has_ended(&self) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        // If the query fails, reaping determines the state.
        !matches!(waitid(WaitId::PidFd(self.pidfd.as_fd()), options), Ok(None))
    }
}

impl Children {
    /// A set without processes.
    ///
    /// # Errors
    ///
    /// The path of this program's file cannot be determined.
    pub fn new() -> io::Result<Self> {
        Ok(Self {
            name: std::env::current_exe()?,
            log_options: std::env::args_os()
                .filter(|argument| LOG_OPTIONS.iter().any(|word| argument == word))
                .collect(),
            living: BTreeMap::new(),
            roster: None,
            helpers: Vec::new(),
            motor_stop_timeout: None,
        })
    }

    /// Sets the stop timeout of a motor process in wall time, which applies when this is dropped.
    #[must_use]
    pub fn with_motor(mut self, stops_within: Duration) -> Self {
        self.motor_stop_timeout = Some(stops_within);
        self
    }

    /// Publishes the processes on a roster, which every process that joins a domain waits for.
    #[must_use]
    pub fn with_roster(mut self, roster: RosterPublisher) -> Self {
        self.roster = Some(roster);
        self
    }

    /// Starts a process.
    ///
    /// The process gets its own process group: Ctrl-C reaches only the supervisor, which stops the processes in
    /// order. It receives the supervisor's process id, so that it can end when the supervisor dies.
    ///
    /// # Errors
    ///
    /// The system cannot create another process.
    pub fn start(&mut self, process: Process, launch: &Launch) -> io::Result<()> {
        self.start_with(process, launch, Stdio::null())
    }

    /// Like [`Self::start`], with the given standard input instead of `/dev/null`.
    ///
    /// # Errors
    ///
    /// As [`Self::start`].
    pub(crate) fn start_with(&mut self, process: Process, launch: &Launch, stdin: Stdio) -> io::Result<()> {
        let began_at_ns = clock::now().as_nanos();
        if let Some(roster) = &mut self.roster {
            roster.begin(process, launch.incarnation);
        }
        let mut child = Command::new(PROGRAM)
            .arg0(&self.name)
            .arg(process.name())
            .args(arguments(launch))
            .args(&self.log_options)
            // Only the supervisor communicates with the service manager.
            .env_remove("NOTIFY_SOCKET")
            .env_remove("WATCHDOG_USEC")
            .stdin(stdin)
            .process_group(0)
            .spawn()?;
        let watched = i32::try_from(child.id())
            .ok()
            .and_then(Pid::from_raw)
            .ok_or(Errno::SRCH)
            .and_then(|pid| pidfd_open(pid, PidfdFlags::empty()));
        match watched {
            Ok(pidfd) => {
                if let Some(roster) = &mut self.roster {
                    roster.name(process, child.id(), began_at_ns);
                }
                self.living.insert(process, ChildProcess { child, pidfd });
                Ok(())
            }
            Err(error) => {
                child.kill()?;
                child.wait()?;
                Err(error.into())
            }
        }
    }

    /// Starts this program with other arguments. The process is killed when this is dropped.
    ///
    /// # Errors
    ///
    /// The system cannot create another process.
    pub fn start_command(&mut self, arguments: &[&str]) -> io::Result<()> {
        let mut command = Command::new(PROGRAM);
        command.arg0(&self.name).args(arguments).stdin(Stdio::null()).process_group(0);
        let child = command.spawn()?;
        self.helpers.push(child);
        Ok(())
    }

    /// Sends SIGTERM to a process. No effect if it does not run.
    pub fn terminate(&self, process: Process) {
        self.signal(process, Signal::TERM);
    }

    /// Sends SIGKILL to a process. No effect if it does not run.
    pub fn kill(&self, process: Process) {
        self.signal(process, Signal::KILL);
    }

    /// Sends SIGSTOP (`still`) or SIGCONT to a process. No effect if it does not run.
    pub fn set_stopped(&self, process: Process, still: bool) {
        self.signal(process, if still { Signal::STOP } else { Signal::CONT });
    }

    /// The process id of a running process.
    pub(crate) fn pid(&self, process: Process) -> Option<u32> {
        self.living.get(&process).map(|living| living.child.id())
    }

    /// Whether no process runs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.living.is_empty()
    }

    /// Reaps the processes that have ended since the last call; returns their exit statuses.
    pub fn reap(&mut self) -> Vec<(Process, ExitStatus)> {
        let mut dead = Vec::new();
        let Self { living, roster, .. } = self;
        living.retain(|process, living| {
            if !living.has_ended() {
                return true;
            }
            if let Some(roster) = roster {
                roster.end(*process, clock::now().as_nanos());
            }
            match living.child.try_wait() {
                Ok(Some(status)) => {
                    report_full_memory(*process, status);
                    dead.push((*process, status));
                    false
                }
                Ok(None) | Err(_) => true,
            }
        });
        dead
    }

    /// Waits until a process ends, `other` is readable, or the timeout expires.
    pub fn wait(&self, other: BorrowedFd<'_>, within: Duration) {
        let pidfds = self.living.values().map(|living| living.pidfd.as_fd());
        let mut fds: Vec<PollFd<'_>> =
            pidfds.chain([other]).map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN)).collect();
        // An interrupted wait only ends early; the caller polls again anyway.
        let _woken = poll(&mut fds, Timespec::try_from(within).ok().as_ref());
    }

    fn signal(&self, process: Process, signal: Signal) {
        if let Some(living) = self.living.get(&process)
            && let Err(error) = pidfd_send_signal(&living.pidfd, signal)
            && error != Errno::SRCH
        {
            tracing::error!(%process, %error, "cannot be signalled");
        }
    }
}

/// Names the usual cause of SIGBUS. It ends a process that writes to shared memory for the first time and finds no
/// space.
fn report_full_memory(process: Process, status: ExitStatus) {
    if status.signal() == Some(Signal::BUS.as_raw()) {
        tracing::error!(
            %process,
            "was ended by SIGBUS: /dev/shm is full, or one of its files was truncated; free some (`du -a /dev/shm`)"
        );
    }
}

impl Drop for Children {
    fn drop(&mut self) {
        let until = self.motor_stop_timeout.map(|within| clock::now() + within);
        // On a mock bus, the motor process still needs the servos to switch torque off.
        let goes_last = |process: Process| until.is_some() && process == Process::MockBus;
        self.terminate(Process::Motor);
        for (process, living) in &mut self.living {
            if !goes_last(*process) && (*process != Process::Motor || until.is_none()) {
                let _dead = living.child.kill().and_then(|()| living.child.wait());
            }
        }
        if let Some((motor, until)) = self.living.get_mut(&Process::Motor).zip(until) {
            while matches!(motor.child.try_wait(), Ok(None)) && clock::now() < until {
                clock::sleep_until(clock::now() + LOOK_EVERY);
            }
        }
        for living in self.living.values_mut() {
            let _dead = living.child.kill().and_then(|()| living.child.wait());
        }
        for child in &mut self.helpers {
            let _dead = child.kill().and_then(|()| child.wait());
        }
    }
}

/// The command line arguments that encode `launch`.
pub(crate) fn arguments(launch: &Launch) -> Vec<OsString> {
    let path = |path: &Option<PathBuf>| path.clone().map(OsString::from);
    let values = [
        ("--domain", Some(launch.domain.clone().into())),
        ("--incarnation", Some(launch.incarnation.to_string().into())),
        ("--config", path(&launch.config)),
        ("--kept", path(&launch.kept)),
        ("--lesson", path(&launch.lesson)),
        ("--state", path(&launch.state)),
        ("--campaign", path(&launch.campaign)),
        ("--parent", launch.parent.map(|pid| pid.to_string().into())),
        ("--synthetic", launch.synthetic.map(|objects| objects.to_string().into())),
        ("--partners", launch.partners.map(|partners| partners.to_string().into())),
    ];
    let values = values.into_iter().filter_map(|(key, value)| Some([key.into(), value?])).flatten();
    let flags = [("--stay", launch.stay), ("--lockstep", launch.lockstep)];
    let flags = flags.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key.into());
    values.chain(flags).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_gets_all_arguments() {
        let launch = Launch {
            domain: "/dev/shm/leo-7".into(),
            incarnation: 3,
            parent: Some(42),
            config: Some("a b.toml".into()),
            kept: Some("/dev/shm/leo-7/configuration".into()),
            partners: Some(0),
            lockstep: true,
            ..Launch::default()
        };
        let told = arguments(&launch).join(" ".as_ref());
        assert_eq!(
            told,
            "--domain /dev/shm/leo-7 --incarnation 3 --config a b.toml --kept /dev/shm/leo-7/configuration \
             --parent 42 --partners 0 --lockstep"
        );
    }
}

//! The torque guard process: it switches torque off if both the supervisor and the motor process die.
//!
//! The guard reads from a pipe whose write ends only the supervisor and the motor process hold. Both report the
//! robot's state on that pipe. When both are gone, the kernel closes the pipe. If the last report was not that torque
//! is off, the guard opens the buses itself. It never takes a serial line from a running motor process.

use std::fs::File;
use std::io::{self, PipeReader, PipeWriter, Write as _};
use std::os::fd::{AsFd as _, OwnedFd};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, Command, Stdio};

use clock::{Duration, Instant};
use config::Robot;
use config::motor::Device;
use process::{Launch, ProcessError};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::read;
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};

use crate::io::children::{PROGRAM, arguments};

/// The subcommand.
const COMMAND: &str = "torque-guard";

/// A motor process is starting, or is about to be restarted.
const STARTING: &str = "starting";
/// A motor process with the following process id runs.
const MOTOR: &str = "motor ";
/// Torque is off, or the servos for which this is not confirmed were logged.
const ENDED: &str = process::TORQUE_OFF_MESSAGE;

/// Shortest interval between two restarts of a dead guard.
const RESTART_INTERVAL: Duration = Duration::from_secs(1);
/// How long the end of a run waits for the guard to exit.
const EXIT_TIMEOUT: Duration = Duration::from_secs(1);
/// Interval at which the guard checks that its supervisor runs.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// How long a motor process may take to exit after its supervisor has died; normally one second. After that it is
/// killed.
const MOTOR_EXIT_TIMEOUT: Duration = Duration::from_millis(2500);
/// How long to wait for the exclusive lock of a serial line.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);

/// The supervisor's handle of the guard process.
#[derive(Debug)]
pub(crate) struct Guard {
    launch: Launch,
    /// The guard reads from a duplicate. Kept so that a restarted guard reads from the same pipe.
    reader: PipeReader,
    writer: PipeWriter,
    child: Option<Child>,
    /// The last message.
    last_word: String,
    replace_at: Instant,
}

impl Guard {
    /// Starts the guard of a robot. `None` if all buses are mocks, whose servos end with their process.
    pub(crate) fn start(robot: &Robot, launch: &Launch) -> Option<Self> {
        let is_hardware = robot.motor.buses.iter().any(|bus| bus.device != Device::Mock);
        if !is_hardware {
            return None;
        }
        let started = io::pipe().and_then(|(reader, writer)| {
            let child = Some(spawn(&reader, launch)?);
            let (launch, last_word) = (launch.clone(), ENDED.to_owned());
            Ok(Self { launch, reader, writer, child, last_word, replace_at: clock::now() + RESTART_INTERVAL })
        });
        started.inspect_err(log_guard_error).ok()
    }

    /// The write end for the motor process; the kernel closes it when that process dies.
    pub(crate) fn line(&self) -> io::Result<OwnedFd> {
        self.writer.try_clone().map(OwnedFd::from)
    }

    pub(crate) fn report_motor_starting(&mut self) {
        self.tell(STARTING.to_owned());
    }

    pub(crate) fn report_motor_pid(&mut self, pid: u32) {
        self.tell(format!("{MOTOR}{pid}"));
    }

    fn tell(&mut self, word: String) {
        self.last_word = word;
        self.repeat();
    }

    fn repeat(&mut self) {
        if let Err(error) = writeln!(self.writer, "{}", self.last_word) {
            log_guard_error(&error);
        }
    }

    /// Restarts the guard if it has died.
    pub(crate) fn maintain(&mut self, now: Instant) {
        let has_died = self.child.as_mut().is_none_or(|child| !matches!(child.try_wait(), Ok(None)));
        if !has_died || now < self.replace_at {
            return;
        }
        self.replace_at = now + RESTART_INTERVAL;
        tracing::warn!("the torque guard died and is restarted");
        match spawn(&self.reader, &self.launch) {
            Ok(child) => {
                self.child = Some(child);
                self.repeat();
            }
            Err(error) => {
                self.child = None;
                log_guard_error(&error);
            }
        }
    }

    /// Tells the guard that torque is off, and waits for its exit.
    pub(crate) fn end(mut self) {
        self.tell(ENDED.to_owned());
        let Self { writer, child, .. } = self;
        drop(writer);
        let until = clock::now() + EXIT_TIMEOUT;
        let mut child = child;
        while let Some(Ok(None)) = child.as_mut().map(Child::try_wait)
            && clock::now() < until
        {
            clock::sleep_until(clock::now() + Duration::from_millis(5));
        }
    }
}

fn log_guard_error(error: &io::Error) {
    tracing::error!(
        "the torque guard cannot be reached: {error}; if the supervisor and the motor process die together, torque \
         stays on"
    );
}

/// Starts a guard that reads from `reader`. It has its own process group, and survives its parent.
fn spawn(reader: &PipeReader, launch: &Launch) -> io::Result<Child> {
    Command::new(PROGRAM)
        .arg0(std::env::current_exe()?)
        .arg(COMMAND)
        .args(arguments(launch))
        .env_remove("NOTIFY_SOCKET")
        .env_remove("WATCHDOG_USEC")
        .stdin(Stdio::from(reader.try_clone()?))
        .stdout(Stdio::null())
        .process_group(0)
        .spawn()
}

/// The robot's state, as last reported to the guard.
#[derive(Debug)]
enum TorqueState {
    /// No motor process has started, or torque is off.
    Ended,
    /// A motor process may have switched torque on.
    Begun { motor: Option<OwnedFd> },
}

/// Main function of the guard process. Waits until the supervisor and the motor process are gone, then ensures that
/// torque is off. Signals do not end it.
///
/// # Errors
///
/// The pipe at standard input cannot be read, or a servo has not confirmed that its torque is off.
pub fn guard(launch: &Launch, robot: &Robot) -> Result<(), ProcessError> {
    // The flag is not read. Installing it makes the process handle signals instead of ending.
    let _ignored = process::stop_flag()?;
    realtime::set_process_name();
    // The domain may be removed by then; the configuration has been read before.
    let buses = torque::buses(&robot.motor, None);
    let torque_state =
        watch(launch).map_err(|error| ProcessError::own(format!("the guard has no pipe: {error}")))?;
    if matches!(torque_state, TorqueState::Ended) {
        return Ok(());
    }
    tracing::error!(
        "the supervisor and the motor process have died: the torque of every servo is switched off"
    );
    let report = torque::switch_off(&buses, BUSY_TIMEOUT);
    report.log(launch.config.as_deref());
    if report.is_confirmed() { Ok(()) } else { Err(ProcessError::own(report)) }
}

/// Reads the pipe until no process holds a write end any more.
fn watch(launch: &Launch) -> io::Result<TorqueState> {
    let pipe = File::from(io::stdin().as_fd().try_clone_to_owned()?);
    let mut torque_state = TorqueState::Ended;
    let mut heard = Vec::new();
    let mut orphaned_at = None;
    loop {
        if is_readable(&pipe)? {
            let mut bytes = [0; 256];
            match read(&pipe, &mut bytes) {
                Ok(0) => return Ok(torque_state),
                Ok(count) => heard.extend_from_slice(bytes.get(..count).unwrap_or_default()),
                Err(rustix::io::Errno::INTR | rustix::io::Errno::AGAIN) => {}
                Err(error) => return Err(error.into()),
            }
            while let Some(end) = heard.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = heard.drain(..=end).collect();
                torque_state = torque_state.after(String::from_utf8_lossy(&line).trim_end());
            }
        }
        if launch.parent.is_some_and(|parent| !realtime::is_parent(parent)) {
            let now = clock::now();
            let since = *orphaned_at.get_or_insert(now);
            if now.since(since) >= MOTOR_EXIT_TIMEOUT {
                torque_state = torque_state.kill_hanging_motor();
            }
        }
    }
}

fn is_readable(pipe: &File) -> io::Result<bool> {
    let mut fds = [PollFd::new(pipe, PollFlags::IN)];
    match poll(&mut fds, Timespec::try_from(LOOK_EVERY).ok().as_ref()) {
        Ok(count) => Ok(count > 0),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

impl TorqueState {
    fn after(self, word: &str) -> Self {
        if word == ENDED {
            return Self::Ended;
        }
        let number = word.strip_prefix(MOTOR).and_then(|pid| pid.parse().ok()).and_then(Pid::from_raw);
        Self::Begun { motor: number.and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok()) }
    }

    /// Kills a motor process that exceeds its timeout, because the guard needs its serial line.
    fn kill_hanging_motor(self) -> Self {
        if let Self::Begun { motor: Some(motor) } = &self
            && pidfd_send_signal(motor, Signal::KILL).is_ok()
        {
            tracing::error!("the motor process has not ended after its supervisor died: killed");
            return Self::Begun { motor: None };
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_message_counts_and_an_ended_motor_process_is_not_killed() {
        let begun = |torque_state: &TorqueState| matches!(torque_state, TorqueState::Begun { .. });
        let torque_state = TorqueState::Ended.after(STARTING);
        assert!(begun(&torque_state));
        let torque_state = torque_state.after(&format!("{MOTOR}{}", i32::MAX));
        assert!(begun(&torque_state));
        let torque_state = torque_state.kill_hanging_motor();
        assert!(matches!(torque_state, TorqueState::Begun { motor: None }));
        let torque_state = torque_state.after(ENDED);
        assert!(matches!(torque_state, TorqueState::Ended));
        assert!(begun(&torque_state.after("")), "what is not understood is no end");
    }

    #[test]
    fn no_guard_is_started_where_every_bus_is_a_mock() {
        let robot = Robot::load(None).unwrap();
        let launch = Launch { domain: "/dev/shm/leo-7".into(), incarnation: 1, ..Launch::default() };
        assert!(Guard::start(&robot, &launch).is_none());
    }
}

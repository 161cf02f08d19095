//! `leo check`: validates the configuration, inspects the machine, and applies or reverts tuning on request.

mod apply;
mod measure;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use anstyle::{AnsiColor, Style};
use config::leo::{Leo, Rights};
use config::{FileSource, Files, Robot, SettingsError};
use process::queues;
use quantity::number::{counted, saturating_u32};
use realtime::{IdleStateGuard, SerialWorkers};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use crate::readiness::cores;
use crate::readiness::{
    Finding, HotProcess, IdleStatePolicy, Machine, SerialWorkerPriority, System, Verdict, judge,
    judge_wakeup, shared_memory, shared_memory_needed,
};
pub use apply::ApplyError;

/// Options of a check.
#[derive(Clone, Debug)]
pub struct CheckOptions {
    /// The robot's configuration files.
    pub files: Files,
    /// Findings about versions, reported after the configuration.
    pub versions: Vec<Finding>,
    /// Whether to print one JSON document instead of lines.
    pub json: bool,
    /// Whether to colour the verdicts of the lines.
    pub colours: bool,
    /// Duration of the wake-up latency measurement; zero skips it.
    pub measure: Duration,
    /// Change to make before the inspection.
    pub deed: MachineChange,
    /// The folder used as the root of the machine: `/`.
    pub root: PathBuf,
}

/// Change to the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineChange {
    /// No change.
    Inspect,
    /// Apply everything that can be fixed by writing to `/proc` and `/sys`.
    Apply,
    /// Revert what was applied before.
    Revert,
}

/// Error of a check.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// A configuration file is invalid.
    #[error(transparent)]
    Config(#[from] SettingsError),
    /// The machine cannot be changed.
    #[error(transparent)]
    Apply(#[from] ApplyError),
    /// The findings cannot be written.
    #[error("cannot write the findings: {0}")]
    Write(#[from] std::io::Error),
}

/// Checks the whole configuration, and whether this machine meets its requirements. Writes the findings to `out`:
/// each as soon as it is known, or one JSON document. `report` gets the time that a measurement has taken so far. Returns
/// whether the robot can run here.
///
/// # Errors
///
/// A configuration file is invalid, a requested change fails, or `out` cannot be written.
pub fn check(
    inquiry: &CheckOptions,
    out: &mut impl Write,
    report: impl Fn(Duration),
) -> Result<bool, CheckError> {
    let robot = Robot::of(&inquiry.files)?;
    let system = System::below(&inquiry.root);
    let look = || inspect(&robot, inquiry, &system);
    match inquiry.deed {
        MachineChange::Inspect => {}
        MachineChange::Apply => {
            let changes: Vec<_> = look().into_iter().flat_map(|finding| finding.changes).collect();
            apply::apply(&system, &changes, out)?;
        }
        MachineChange::Revert => apply::revert(&system, out)?,
    }
    let mut findings = look();
    if !inquiry.json {
        findings.iter().try_for_each(|finding| tell(finding, inquiry.colours, out))?;
        out.flush()?;
    }
    // Same condition as in the running robot.
    let _awake = robot.leo.supervisor.keep_cores_awake.then(IdleStateGuard::ask);
    let measured = measure::wakeups(&HotProcess::all(&robot), inquiry.measure, report)?;
    let measured: Vec<Finding> = measured.iter().map(judge_wakeup).collect();
    if inquiry.json {
        findings.extend(measured);
        serde_json::to_writer_pretty(&mut *out, &findings).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        measured.iter().try_for_each(|finding| tell(finding, inquiry.colours, out))?;
    }
    Ok(findings.iter().all(|finding| finding.verdict != Verdict::Broken))
}

/// Writes one line for a finding, and one for its remedy.
fn tell(finding: &Finding, colours: bool, out: &mut impl Write) -> std::io::Result<()> {
    let Finding { verdict, about, text, mend, changes } = finding;
    let style = if colours { style(*verdict) } else { Style::new() };
    writeln!(out, "{style}{:<8}{style:#} {about:<20} {text}", verdict.name())?;
    if let Some(mend) = mend {
        let mark = if changes.is_empty() { "mend:" } else { "mend, or --apply:" };
        writeln!(out, "{:<8} {:<20} {mark} {mend}", "", "")?;
    }
    Ok(())
}

/// Inspects the configuration and the machine. Has no lasting effect: rights are requested in short-lived threads.
fn inspect(robot: &Robot, inquiry: &CheckOptions, system: &System) -> Vec<Finding> {
    let what =
        inquiry.files.leo().map_or_else(|| "the built-in one".to_owned(), |file| file.display().to_string());
    let joints = counted(saturating_u32(robot.motor.joints.len()), "joint");
    let version = env!("CARGO_PKG_VERSION");
    let configuration =
        format!("{what} and the files beside it are valid for this version, Leo {version}: {joints}");
    let mut findings = vec![Finding::new(Verdict::Good, "configuration", configuration)];
    findings.extend(files_read(&inquiry.files));
    findings.extend(inquiry.versions.iter().cloned());
    findings.extend(judge(system, &machine(robot)));
    findings
}

/// A finding for each file of the configuration, and one for each file beside them that nothing reads.
fn files_read(files: &Files) -> impl Iterator<Item = Finding> {
    let has_folder = files.leo().is_some();
    let source = move |FileSource { name, path }: FileSource| {
        let text = match path {
            Some(path) => format!("{} was read", path.display()),
            None if has_folder => format!("{name} is the built-in one: there is none beside leo.toml"),
            None => format!("{name} is the built-in one"),
        };
        Finding::new(Verdict::Good, "file", text)
    };
    let unread = files.unread().into_iter().map(|file| {
        let mend = match file.meant {
            Some(meant) if !file.is_meant_there => {
                format!("mv {} {}", file.path.display(), file.path.with_file_name(meant).display())
            }
            _ => "move it elsewhere, if it is not meant to be read".to_owned(),
        };
        Finding { mend: Some(mend), ..Finding::new(Verdict::Warning, "file", file.to_string()) }
    });
    files.sources().into_iter().map(source).chain(unread)
}

/// The colour of a verdict on a terminal.
const fn style(verdict: Verdict) -> Style {
    let colour = match verdict {
        Verdict::Good => AnsiColor::Green,
        Verdict::Warning | Verdict::Slower => AnsiColor::Yellow,
        Verdict::Broken => AnsiColor::Red,
    };
    colour.on_default()
}

fn machine(robot: &Robot) -> Machine {
    let leo = &robot.leo;
    Machine {
        cores: cores_on_request().unwrap_or_else(own_cores),
        given_cores: own_cores(),
        shared_memory_free: shared_memory_free(),
        shared_memory_needed: needed(leo, leo.belief.partners, false),
        descriptors: getrlimit(Resource::Nofile).current,
        memory_limit: getrlimit(Resource::Memlock).current,
        missing_rights: missing_rights(leo),
        is_wall_clock_synchronised: realtime::is_wall_clock_synchronised(),
        hot: HotProcess::all(robot),
        carriers: if leo.supervisor.boost_serial_kworkers {
            carriers()
        } else {
            SerialWorkerPriority::Ordinary
        },
        sleep: if leo.supervisor.keep_cores_awake {
            sleep(IdleStateGuard::ask().err())
        } else {
            IdleStatePolicy::Allowed
        },
    }
}

/// The cores that a process gets if it requests all cores. By default the kernel excludes isolated cores
/// (`isolcpus`), but a process may request them. `None` if the system refuses a thread.
fn cores_on_request() -> Option<Vec<u16>> {
    // The kernel ignores cores that do not exist or that this process's cgroup excludes.
    on_own_thread(|| {
        let mut every = CpuSet::new();
        (0..CpuSet::MAX_CPU).for_each(|core| every.set(core));
        // If the request fails, the affinity stays as it was.
        let _granted = sched_setaffinity(None, &every);
        own_cores()
    })
}

/// Runs work in a short-lived thread, because an affinity or a priority applies to one thread. `None` if the system
/// refuses a thread.
fn on_own_thread<T: Send>(work: impl FnOnce() -> T + Send) -> Option<T> {
    thread::scope(|scope| {
        let started = thread::Builder::new().name("check".to_owned()).spawn_scoped(scope, work).ok()?;
        Some(started.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

/// A process is configured for a core that this machine does not have.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`cores` of [{process}.realtime] names core {core}, and this machine has the cores {existing}: choose among them, or leave the list empty"
)]
pub struct CoreError {
    process: &'static str,
    core: u16,
    existing: String,
}

/// Refuses a robot with a process that is pinned to a core that this machine does not have.
///
/// # Errors
///
/// The first process, in the order of `leo.toml`, with such a core.
pub fn check_cores(leo: &Leo) -> Result<(), CoreError> {
    // If they are unknown, each process reports a core that it does not get as a missing right.
    let Some(granted) = cores_on_request() else { return Ok(()) };
    let existing = cores::existing(&System::below(Path::new("/")), &granted);
    for (process, rights) in rights(leo) {
        if let Some(core) = rights.cores.iter().find(|core| !existing.contains(core)) {
            return Err(CoreError { process, core: *core, existing: cores::span(&existing) });
        }
    }
    Ok(())
}

/// The rights that the processes request, with the names of their tables.
fn rights(leo: &Leo) -> [(&'static str, &Rights); 8] {
    [
        ("sensor", &leo.sensor.realtime),
        ("belief", &leo.belief.realtime),
        ("learner", &leo.learner.realtime),
        ("motor", &leo.motor.realtime),
        ("simulator", &leo.simulator.realtime),
        ("mock_bus", &leo.mock_bus.realtime),
        ("console", &leo.console.realtime),
        ("link", &leo.link.realtime),
    ]
}

/// The affinity of the calling thread.
fn own_cores() -> Vec<u16> {
    let mask = sched_getaffinity(None).ok();
    let is_set = |core: &u16| mask.is_some_and(|mask| mask.is_set(usize::from(*core)));
    (0..=u16::MAX).take(CpuSet::MAX_CPU).filter(is_set).collect()
}

/// Whether the priority of the kernel's serial workers may be raised.
fn carriers() -> SerialWorkerPriority {
    SerialWorkers::default()
        .permission()
        .map_or_else(SerialWorkerPriority::Refused, |()| SerialWorkerPriority::Prompt)
}

/// Interprets the kernel's answer to the request.
fn sleep(refused: Option<std::io::Error>) -> IdleStatePolicy {
    match refused {
        None => IdleStatePolicy::Prevented,
        Some(error) if error.kind() == std::io::ErrorKind::NotFound => IdleStatePolicy::Allowed,
        Some(error) => IdleStatePolicy::Refused(format!("/dev/cpu_dma_latency: {error}")),
    }
}

/// Requests the rights that the processes will request; returns the bits of those not granted. Each process requests
/// its rights again, and reports what is missing: so a refused thread counts as nothing missing here.
fn missing_rights(leo: &Leo) -> u64 {
    let wanted = [
        &leo.sensor.realtime,
        &leo.belief.realtime,
        &leo.learner.realtime,
        &leo.motor.realtime,
        &leo.simulator.realtime,
        &leo.mock_bus.realtime,
        &leo.console.realtime,
    ];
    wanted.into_iter().fold(0, |bits, rights| bits | missing_bits(rights))
}

fn missing_bits(rights: &Rights) -> u64 {
    on_own_thread(|| realtime::apply(rights).missing_bits()).unwrap_or(0)
}

/// Bytes free in shared memory; `None` if this user may not write there.
fn shared_memory_free() -> Option<u64> {
    let system = rustix::fs::statvfs("/dev/shm").ok().filter(|_| is_writable("/dev/shm"))?;
    Some(system.f_bavail.saturating_mul(system.f_frsize))
}

/// Checks that shared memory is large enough for a robot with this many partners; on failure returns the remedy. Call
/// it before the first write to shared memory: a process that touches a page that does not fit gets SIGBUS.
pub(crate) fn check_shared_memory(leo: &Leo, partners: u32, lockstep: bool) -> Result<(), String> {
    let finding = shared_memory(shared_memory_free(), needed(leo, partners, lockstep));
    if finding.verdict == Verdict::Broken {
        let mend = finding.mend.map_or_else(String::new, |mend| format!(": `{mend}`"));
        Err(finding.text + &mend)
    } else {
        Ok(())
    }
}

/// Bytes of shared memory that a robot with this many partners needs.
fn needed(leo: &Leo, partners: u32, lockstep: bool) -> u64 {
    let frames = queues(&leo.buffers, lockstep).max_frames();
    shared_memory_needed(leo.buffers.max_objects.get(), frames, leo.belief.perspectives(partners))
}

fn is_writable(folder: &str) -> bool {
    rustix::fs::access(folder, rustix::fs::Access::WRITE_OK).is_ok()
}

#[cfg(test)]
mod tests;

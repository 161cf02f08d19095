use std::fs;
use std::io::Write;
use std::path::Path;
use std::str::FromStr;
use std::thread;

use config::leo::{Leo, Rights};
use config::{ConfigError, Robot};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CpuSet, sched_getaffinity};

use crate::readiness::{Finding, Machine, Verdict, judge, shared_memory, shared_memory_needed};

/// Why nothing could be checked.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// A file of the configuration is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The findings cannot be written.
    #[error("cannot write what was found: {0}")]
    Write(#[from] std::io::Error),
}

/// Checks a whole configuration (the built-in one without `config`) and whether this machine can
/// keep what it promises; writes what was found to `out`, one line each or one JSON document.
/// Whether the robot can run here.
///
/// # Errors
///
/// A file of the configuration is wrong, or `out` cannot be written.
pub fn check(config: Option<&Path>, json: bool, out: &mut impl Write) -> Result<bool, CheckError> {
    let findings = inspect(config)?;
    if json {
        serde_json::to_writer_pretty(&mut *out, &findings).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        for finding in &findings {
            writeln!(out, "{:<8} {:<20} {}", finding.verdict.name(), finding.about, finding.text)?;
        }
    }
    Ok(findings.iter().all(|finding| finding.verdict != Verdict::Broken))
}

/// Looks at the configuration and the machine. Nothing stays changed: rights are asked for in
/// threads of their own, which end.
fn inspect(config: Option<&Path>) -> Result<Vec<Finding>, ConfigError> {
    let robot = Robot::load(config)?;
    let what = config.map_or_else(|| "the built-in one".to_owned(), |file| file.display().to_string());
    let joints = robot.motor.joints.len();
    let configuration = format!("{what} and its neighbours are right: {joints} joints");
    let mut findings = vec![Finding::new(Verdict::Good, "configuration", configuration)];
    let missing_rights = missing_rights(&robot.leo);
    let belief = &robot.leo.belief;
    let shared_memory_needed = shared_memory_needed(&robot.leo.buffers, belief.perspectives(belief.partners));
    findings.extend(judge(&Machine { missing_rights, shared_memory_needed, ..machine() }));
    Ok(findings)
}

/// Asks for what the processes will ask for; what to change when it is not granted.
fn missing_rights(leo: &Leo) -> Option<String> {
    let wanted = [
        &leo.sensor.realtime,
        &leo.belief.realtime,
        &leo.learner.realtime,
        &leo.motor.realtime,
        &leo.simulator.realtime,
        &leo.mock_bus.realtime,
        &leo.console.realtime,
    ];
    let missing = wanted.into_iter().fold(0, |bits, rights| bits | missing_bits(rights.clone()));
    (missing != 0).then(|| realtime::advice(missing))
}

fn missing_bits(rights: Rights) -> u64 {
    thread::spawn(move || realtime::apply(&rights).missing_bits()).join().unwrap_or(0)
}

fn machine() -> Machine {
    let mask = sched_getaffinity(None).ok();
    let cores = mask.map_or(1, |mask| (0..CpuSet::MAX_CPU).filter(|&core| mask.is_set(core)).count());
    let share = read::<i64>("/proc/sys/kernel/sched_rt_runtime_us")
        .zip(read::<i64>("/proc/sys/kernel/sched_rt_period_us"));
    let governor = |core: usize| {
        let file = format!("/sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor");
        read::<String>(&file).filter(|governor| governor != "performance").map(|governor| (core, governor))
    };
    Machine {
        cores,
        shared_memory_free: shared_memory_free(),
        shared_memory_needed: 0,
        descriptors: getrlimit(Resource::Nofile).current,
        kernel_is_realtime: read("/sys/kernel/realtime") == Some(1),
        governors: (0..CpuSet::MAX_CPU).filter_map(governor).collect(),
        realtime_share: share,
        swap_total: swap_total(),
        missing_rights: None,
    }
}

/// Bytes free in shared memory; nothing where this user may not write there.
fn shared_memory_free() -> Option<u64> {
    let system = rustix::fs::statvfs("/dev/shm").ok().filter(|_| is_writable("/dev/shm"))?;
    Some(system.f_bavail.saturating_mul(system.f_frsize))
}

/// Whether shared memory has room for a robot with so many partners; where it has not, what to do. Asked before the
/// first byte is written there: a page that does not fit kills who touches it.
pub(crate) fn room(leo: &Leo, partners: u32) -> Result<(), String> {
    let needed = shared_memory_needed(&leo.buffers, leo.belief.perspectives(partners));
    let finding = shared_memory(shared_memory_free(), needed);
    if finding.verdict == Verdict::Broken { Err(finding.text) } else { Ok(()) }
}

fn is_writable(folder: &str) -> bool {
    rustix::fs::access(folder, rustix::fs::Access::WRITE_OK).is_ok()
}

fn read<T: FromStr>(file: &str) -> Option<T> {
    fs::read_to_string(file).ok()?.trim().parse().ok()
}

fn swap_total() -> Option<u64> {
    let memory = fs::read_to_string("/proc/meminfo").ok()?;
    let line = memory.lines().find_map(|line| line.strip_prefix("SwapTotal:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_machine_has_cores_and_shared_memory() {
        let machine = machine();
        assert!(machine.cores > 0 && machine.shared_memory_free > Some(0), "{machine:?}");
    }

    #[test]
    fn a_wrong_file_is_named() {
        let refused = check(Some(Path::new("/nowhere/leo.toml")), false, &mut Vec::new()).unwrap_err();
        assert!(refused.to_string().contains("/nowhere/leo.toml"), "{refused}");
    }

    #[test]
    fn what_is_found_is_one_json_document() {
        let mut out = Vec::new();
        check(None, true, &mut out).unwrap();
        let findings: serde_json::Value = serde_json::from_slice(&out).unwrap();
        assert_eq!(findings.as_array().unwrap().len(), 9);
        assert_eq!(findings[0]["verdict"], "good");
    }
}

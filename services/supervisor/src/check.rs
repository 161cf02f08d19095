use std::fs;
use std::path::Path;
use std::str::FromStr;
use std::thread;

use config::leo::{Leo, Rights};
use config::lesson::Lesson;
use config::{ConfigError, Robot};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CpuSet, sched_getaffinity};

use crate::readiness::{Finding, Machine, Verdict, judge};

/// Checks a whole configuration, and whether this machine can keep what it promises.
///
/// Without `config`, the built-in configuration is checked. Nothing stays changed: rights are
/// asked for in threads of their own, which end.
#[must_use]
pub fn check(config: Option<&Path>, lesson: Option<&Path>) -> Vec<Finding> {
    let (robot, lesson) = (Robot::load(config), lesson.map(Lesson::load));
    let mut findings = vec![file("configuration", &robot)];
    findings.extend(lesson.map(|lesson| file("lesson", &lesson)));
    let missing_rights = robot.ok().and_then(|robot| missing_rights(&robot.leo));
    findings.extend(judge(&Machine { missing_rights, ..machine() }));
    findings
}

fn file<T>(about: &'static str, loaded: &Result<T, ConfigError>) -> Finding {
    match loaded {
        Ok(_) => Finding::new(Verdict::Good, about, "right in every file"),
        Err(error) => Finding::new(Verdict::Broken, about, error.to_string()),
    }
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
    let shared_memory = rustix::fs::statvfs("/dev/shm").ok().filter(|_| is_writable("/dev/shm"));
    let share = read::<i64>("/proc/sys/kernel/sched_rt_runtime_us")
        .zip(read::<i64>("/proc/sys/kernel/sched_rt_period_us"));
    let governor = |core: usize| {
        let file = format!("/sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor");
        read::<String>(&file).filter(|governor| governor != "performance").map(|governor| (core, governor))
    };
    Machine {
        cores,
        shared_memory_free: shared_memory.map(|system| system.f_bavail.saturating_mul(system.f_frsize)),
        descriptors: getrlimit(Resource::Nofile).current,
        kernel_is_realtime: read("/sys/kernel/realtime") == Some(1),
        governors: (0..CpuSet::MAX_CPU).filter_map(governor).collect(),
        realtime_share: share,
        swap_total: swap_total(),
        missing_rights: None,
    }
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
    fn a_wrong_file_is_found_and_named() {
        let findings = check(Some(Path::new("/nowhere/leo.toml")), Some(Path::new("/nowhere/lesson.toml")));
        let said: Vec<_> = findings.iter().map(|finding| (finding.verdict, finding.text.as_str())).collect();
        assert!(said[0].1.contains("/nowhere/leo.toml") && said[0].0 == Verdict::Broken, "{said:?}");
        assert!(said[1].1.contains("/nowhere/lesson.toml") && said[1].0 == Verdict::Broken, "{said:?}");
    }
}

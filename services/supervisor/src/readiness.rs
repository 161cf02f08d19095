//! Whether a machine can keep the robot's promises, judged from facts about it.

use config::leo::Buffers;
use serde::Serialize;

/// Shared memory that the processes need whatever the sizes of their buffers are.
const SHARED_MEMORY_BASE: u64 = 8 << 20;
/// Shared memory for one object in one frame of one perspective, the observations and percepts
/// about it included. Measured: 86 KiB per object with four frames and one partner.
const SHARED_MEMORY_OF_OBJECT: u64 = 12 << 10;
/// Descriptors that one process may need.
const DESCRIPTORS_LEAST: u64 = 1024;

/// How grave a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Good,
    /// The robot runs, and its timing is not guaranteed.
    Slower,
    /// The robot does not run.
    Broken,
}

impl Verdict {
    /// Its word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Slower => "slower",
            Self::Broken => "broken",
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// How grave it is.
    pub verdict: Verdict,
    /// What was looked at.
    pub about: &'static str,
    /// What was found, and where that is not good, what to change.
    pub text: String,
}

impl Finding {
    pub(crate) fn new(verdict: Verdict, about: &'static str, text: impl Into<String>) -> Self {
        Self { verdict, about, text: text.into() }
    }
}

/// What was read of a machine; `None` where it could not be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Machine {
    /// Cores that this process may use.
    pub cores: usize,
    /// Free bytes of the file system under shared memory.
    pub shared_memory_free: Option<u64>,
    /// Bytes of it that the robot as configured needs.
    pub shared_memory_needed: u64,
    /// Descriptors that a process may have; none when unlimited.
    pub descriptors: Option<u64>,
    /// The kernel's answer to whether it is fully preemptible.
    pub kernel_is_realtime: bool,
    /// Cores whose frequency governor is another than `performance`, with its name.
    pub governors: Vec<(usize, String)>,
    /// Microseconds of each second that real-time threads may use; negative for all of them.
    pub realtime_share: Option<(i64, i64)>,
    /// Swap in use or not, in bytes.
    pub swap_total: Option<u64>,
    /// Real-time rights that were asked for as configured and not granted, and how to grant them.
    pub missing_rights: Option<String>,
}

/// Judges everything about a machine.
#[must_use]
pub fn judge(machine: &Machine) -> Vec<Finding> {
    vec![
        shared_memory(machine.shared_memory_free, machine.shared_memory_needed),
        descriptors(machine.descriptors),
        rights(machine.missing_rights.as_deref()),
        cores(machine.cores),
        kernel(machine.kernel_is_realtime),
        governors(&machine.governors),
        realtime_share(machine.realtime_share),
        swap(machine.swap_total),
    ]
}

/// Bytes of shared memory that a robot with so many perspectives needs, rather more than fewer.
#[must_use]
pub fn shared_memory_needed(buffers: &Buffers, perspectives: u32) -> u64 {
    let number = |count: usize| u64::try_from(count).unwrap_or(u64::MAX);
    number(buffers.objects.get())
        .saturating_mul(number(buffers.frames.get()))
        .saturating_mul(u64::from(perspectives))
        .saturating_mul(SHARED_MEMORY_OF_OBJECT)
        .saturating_add(SHARED_MEMORY_BASE)
}

pub(crate) fn shared_memory(free: Option<u64>, needed: u64) -> Finding {
    let about = "shared memory";
    let mib = |bytes: u64| bytes >> 20;
    match free {
        Some(free) if free >= needed => Finding::new(
            Verdict::Good,
            about,
            format!("{} MiB are free in /dev/shm, {} are needed", mib(free), mib(needed)),
        ),
        Some(free) => Finding::new(
            Verdict::Broken,
            about,
            format!(
                "only {} MiB are free in /dev/shm and {} are needed: free some (`du -a /dev/shm`), or enlarge it \
                 (`mount -o remount,size=256M /dev/shm`; in a container `--shm-size=256m`)",
                mib(free),
                mib(needed)
            ),
        ),
        None => Finding::new(
            Verdict::Broken,
            about,
            "/dev/shm is not there or cannot be written: mount a tmpfs on it that this user may write",
        ),
    }
}

fn descriptors(limit: Option<u64>) -> Finding {
    let about = "open files";
    match limit {
        Some(limit) if limit < DESCRIPTORS_LEAST => Finding::new(
            Verdict::Broken,
            about,
            format!(
                "a process may have {limit} open files: raise it to {DESCRIPTORS_LEAST} or more with \
                 `<user> - nofile 4096` in /etc/security/limits.conf or `LimitNOFILE=4096` in the systemd unit"
            ),
        ),
        Some(limit) => Finding::new(Verdict::Good, about, format!("a process may have {limit}")),
        None => Finding::new(Verdict::Good, about, "a process may have any number"),
    }
}

fn rights(missing: Option<&str>) -> Finding {
    match missing {
        None => Finding::new(Verdict::Good, "real-time rights", "all that are configured are granted"),
        Some(advice) => Finding::new(Verdict::Slower, "real-time rights", advice),
    }
}

fn cores(cores: usize) -> Finding {
    if cores >= 2 {
        Finding::new(Verdict::Good, "cores", format!("{cores} may be used"))
    } else {
        Finding::new(Verdict::Slower, "cores", "one core may be used: the hot path needs two or more")
    }
}

fn kernel(is_realtime: bool) -> Finding {
    if is_realtime {
        Finding::new(Verdict::Good, "kernel", "fully preemptible (PREEMPT_RT)")
    } else {
        let text = "not fully preemptible: boot a PREEMPT_RT kernel for a bound on the latency";
        Finding::new(Verdict::Slower, "kernel", text)
    }
}

fn governors(others: &[(usize, String)]) -> Finding {
    match others.first() {
        None => Finding::new(Verdict::Good, "frequency governor", "no core is slowed down to save power"),
        Some((core, governor)) => Finding::new(
            Verdict::Slower,
            "frequency governor",
            format!(
                "`{governor}` on core {core}{}: waking takes longer; `cpupower frequency-set -g performance`",
                if others.len() > 1 { format!(" and {} more", others.len() - 1) } else { String::new() }
            ),
        ),
    }
}

fn realtime_share(share: Option<(i64, i64)>) -> Finding {
    let about = "real-time share";
    match share {
        Some((runtime, period)) if 0 <= runtime && runtime < period / 2 => Finding::new(
            Verdict::Slower,
            about,
            format!(
                "real-time threads get {runtime} of every {period} µs: `sysctl kernel.sched_rt_runtime_us=950000`"
            ),
        ),
        Some(_) | None => Finding::new(Verdict::Good, about, "real-time threads get most of a core"),
    }
}

fn swap(total: Option<u64>) -> Finding {
    match total {
        Some(bytes) if bytes > 0 => Finding::new(
            Verdict::Slower,
            "swap",
            format!(
                "{} MiB of swap are on: a page of memory that is not locked may be away; `swapoff -a`",
                bytes >> 20
            ),
        ),
        Some(_) | None => Finding::new(Verdict::Good, "swap", "off"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Machine {
        Machine {
            cores: 4,
            shared_memory_free: Some(1 << 30),
            shared_memory_needed: 12 << 20,
            descriptors: Some(4096),
            kernel_is_realtime: true,
            governors: vec![],
            realtime_share: Some((950_000, 1_000_000)),
            swap_total: Some(0),
            missing_rights: None,
        }
    }

    #[test]
    fn a_machine_as_it_should_be_has_nothing_to_change() {
        let findings = judge(&good());
        assert_eq!(findings.len(), 8);
        assert!(findings.iter().all(|finding| finding.verdict == Verdict::Good), "{findings:?}");
    }

    #[test]
    fn larger_buffers_need_more_shared_memory() {
        let buffers = |objects: i64, frames: i64| {
            let text = format!("objects = {objects}\nframes = {frames}\n");
            config::parse::<Buffers>(&text, std::path::Path::new("leo.toml")).unwrap()
        };
        // Measured of running robots with one partner, in KiB.
        for (objects, measured) in [(64, 6232), (1024, 88_772), (4096, 352_892)] {
            let needed = shared_memory_needed(&buffers(objects, 4), 2) >> 10;
            assert!(measured < needed && needed < 2 * measured + 8192, "{objects}: {needed} KiB");
        }
        assert!(shared_memory_needed(&buffers(64, 8), 2) > shared_memory_needed(&buffers(64, 4), 2));
        assert!(shared_memory_needed(&buffers(64, 4), 3) > shared_memory_needed(&buffers(64, 4), 2));
    }

    #[test]
    fn every_shortcoming_is_found_and_says_what_to_change() {
        let cases = [
            (Machine { shared_memory_free: Some(1 << 20), ..good() }, Verdict::Broken, "remount"),
            (Machine { shared_memory_free: None, ..good() }, Verdict::Broken, "mount a tmpfs"),
            (Machine { descriptors: Some(256), ..good() }, Verdict::Broken, "LimitNOFILE"),
            (Machine { cores: 1, ..good() }, Verdict::Slower, "two"),
            (Machine { kernel_is_realtime: false, ..good() }, Verdict::Slower, "PREEMPT_RT"),
            (Machine { governors: vec![(3, "powersave".into())], ..good() }, Verdict::Slower, "cpupower"),
            (Machine { realtime_share: Some((0, 1_000_000)), ..good() }, Verdict::Slower, "sysctl"),
            (Machine { swap_total: Some(1 << 30), ..good() }, Verdict::Slower, "swapoff"),
            (Machine { missing_rights: Some("rtprio".into()), ..good() }, Verdict::Slower, "rtprio"),
        ];
        for (machine, verdict, word) in cases {
            let findings = judge(&machine);
            let bad: Vec<_> = findings.iter().filter(|finding| finding.verdict != Verdict::Good).collect();
            assert_eq!(bad.len(), 1, "{machine:?}");
            assert_eq!(bad[0].verdict, verdict);
            assert!(bad[0].text.contains(word), "{}", bad[0].text);
        }
    }
}

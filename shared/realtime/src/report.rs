use std::fmt;

use rustix::io::Errno;

/// The bit of real-time priority in the missing rights.
pub const SCHEDULING: u64 = 1;
const AFFINITY: u64 = 2;
/// The bit of locked memory in the missing rights.
pub const MEMORY: u64 = 4;

/// A right that was requested and not granted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The scheduling policy `SCHED_FIFO`.
    Scheduling {
        /// The requested priority.
        priority: u8,
        /// The highest priority that the limit `RLIMIT_RTPRIO` allows.
        limit: u64,
        /// The kernel's error.
        source: Errno,
    },
    /// CPU affinity.
    Affinity {
        /// The requested cores.
        cores: Vec<u16>,
        /// The kernel's error.
        source: Errno,
    },
    /// Locking all memory, present and future.
    Memory {
        /// The limit `RLIMIT_MEMLOCK` in bytes; `None` if unlimited.
        limit: Option<u64>,
        /// The kernel's error, now or at the first allocation beyond the limit.
        source: Errno,
    },
}

impl Refusal {
    /// Its bit in the missing rights of a process's health.
    #[must_use]
    pub const fn bit(&self) -> u64 {
        match self {
            Self::Scheduling { .. } => SCHEDULING,
            Self::Affinity { .. } => AFFINITY,
            Self::Memory { .. } => MEMORY,
        }
    }
}

/// Bit, name and remedy of each right.
const GRANTS: [(u64, &str, &str); 3] = [
    (
        SCHEDULING,
        "real-time priority",
        "`<user> - rtprio 99` in /etc/security/limits.conf or `LimitRTPRIO=99` in the systemd unit",
    ),
    (AFFINITY, "the cores asked for", "name cores that this machine has and this process may use"),
    (
        MEMORY,
        "locked memory",
        "`<user> - memlock unlimited` in /etc/security/limits.conf or `LimitMEMLOCK=infinity` in the systemd unit",
    ),
];

/// Name and remedy of each right whose bit is set.
#[must_use]
pub fn grants(missing_bits: u64) -> Vec<(&'static str, &'static str)> {
    let missing = GRANTS.iter().filter(|(bit, ..)| missing_bits & bit != 0);
    missing.map(|(_, right, how)| (*right, *how)).collect()
}

/// One warning about the missing rights of several processes, with their remedies.
#[must_use]
pub fn advice(missing_bits: u64) -> String {
    let how: Vec<String> =
        grants(missing_bits).iter().map(|(right, how)| format!("{right}: {how}")).collect();
    if how.is_empty() {
        "all real-time rights are granted".to_owned()
    } else {
        format!("timing is not guaranteed; not granted: {}", how.join("; "))
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scheduling { priority, limit, source } => {
                write!(out, "real-time priority {priority} (limit {limit}, {source})")
            }
            Self::Affinity { cores, source } => write!(out, "running on the cores {cores:?} ({source})"),
            Self::Memory { limit: Some(bytes), source } => {
                write!(out, "locked memory (limit {} KiB, {source})", bytes / 1024)
            }
            Self::Memory { limit: None, source } => write!(out, "locked memory ({source})"),
        }
    }
}

/// The rights that were not granted. Its `Display` is one warning with the remedies.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[must_use = "a right that is missing must be said"]
pub struct Report {
    refusals: Vec<Refusal>,
}

impl Report {
    pub(crate) const fn new(refusals: Vec<Refusal>) -> Self {
        Self { refusals }
    }

    /// The missing rights in the order of the requests.
    #[must_use]
    pub fn refusals(&self) -> &[Refusal] {
        &self.refusals
    }

    /// Whether all rights were granted.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.refusals.is_empty()
    }

    /// One bit for each missing right: 1 scheduling, 2 affinity, 4 memory.
    #[must_use]
    pub fn missing_bits(&self) -> u64 {
        self.refusals.iter().fold(0, |bits, refusal| bits | refusal.bit())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&advice(self.missing_bits()))?;
        for refusal in &self.refusals {
            write!(out, "; refused: {refusal}")?;
        }
        Ok(())
    }
}

//! Checks of process limits and rights.

use super::{Finding, Verdict};

/// File descriptors that one process may need.
const MIN_DESCRIPTORS: u64 = 1024;

pub(super) fn descriptors(limit: Option<u64>) -> Finding {
    let about = "open files";
    match limit {
        Some(limit) if limit < MIN_DESCRIPTORS => Finding::broken(
            about,
            format!("a process may have {limit}, and {MIN_DESCRIPTORS} are needed"),
            "`<user> - nofile 4096` in /etc/security/limits.conf, or `LimitNOFILE=4096` in the systemd unit",
        ),
        Some(limit) => Finding::good(about, format!("a process may have {limit}")),
        None => Finding::good(about, "a process may have any number"),
    }
}

/// Checks the requested priorities and affinities.
pub(super) fn rights(missing: u64) -> Finding {
    granted("real-time rights", missing & !realtime::MEMORY, "all that are configured are granted")
}

/// Checks locked memory and its limit.
pub(super) fn locked_memory(missing: u64, limit: Option<u64>) -> Finding {
    let text = match limit {
        None => "any amount may be locked".to_owned(),
        Some(bytes) => format!("granted; the limit is {} KiB", bytes >> 10),
    };
    granted("locked memory", missing & realtime::MEMORY, &text)
}

fn granted(about: &str, missing: u64, good: &str) -> Finding {
    if missing == 0 {
        return Finding::good(about, good);
    }
    let rights = realtime::grants(missing);
    let names: Vec<&str> = rights.iter().map(|(right, _)| *right).collect();
    let how: Vec<&str> = rights.iter().map(|(_, how)| *how).collect();
    let text = format!("configured and not granted: {}; timing is not guaranteed", names.join(", "));
    Finding { mend: Some(how.join("; ")), ..Finding::new(Verdict::Slower, about, text) }
}

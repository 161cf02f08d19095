//! Checks of the kernel's preemption model, real-time throttling and clocks.

use super::{Change, Finding, System};

const PREEMPTION: &str = "/sys/kernel/debug/sched/preempt";
const SHARE: &str = "/proc/sys/kernel/sched_rt_runtime_us";
const SHARE_PERIOD: &str = "/proc/sys/kernel/sched_rt_period_us";
const SOURCES: &str = "/sys/devices/system/clocksource/clocksource0";
/// Clock sources that access a device instead of an instruction: each reading takes a microsecond.
const SLOW_SOURCES: [&str; 4] = ["hpet", "acpi_pm", "jiffies", "refined-jiffies"];

/// Checks the active preemption model. Depending on version and permissions, the kernel shows it in one of three
/// places.
pub(super) fn preemption(system: &System) -> Finding {
    let about = "kernel preemption";
    let version = system.read("/proc/version").unwrap_or_default();
    if system.number("/sys/kernel/realtime") == Some(1) || version.contains("PREEMPT_RT") {
        return Finding::good(about, "fully preemptible (PREEMPT_RT)");
    }
    let mend = "install a PREEMPT_RT kernel (Debian: `apt install linux-image-rt-amd64`) and start it";
    // In "none voluntary (full) lazy", the active model is in parentheses.
    let dynamic = system.read(PREEMPTION);
    let on = dynamic.as_deref().and_then(|models| models.split(['(', ')']).nth(1));
    let asked = system.read("/proc/cmdline").and_then(|line| {
        line.split_whitespace().find_map(|word| word.strip_prefix("preempt=")).map(str::to_owned)
    });
    match on.or(asked.as_deref()) {
        Some("full") => Finding::slower(
            about,
            "`full`, without a bound: some parts of the kernel cannot be preempted",
            mend,
        ),
        Some(model) => {
            let change = on.map(|from| Change::new(PREEMPTION, from, "full"));
            Finding::slower(
                about,
                format!("`{model}`: the kernel finishes what it does before it lets a real-time thread run"),
                format!("`preempt=full` on the kernel's command line, or {mend}"),
            )
            .with_changes(change.into_iter().collect())
        }
        None if version.contains("PREEMPT") => {
            Finding::slower(about, "preemptible, but not fully: there is no bound on the latency", mend)
        }
        None => Finding::slower(about, "not preemptible: the latency has no bound", mend),
    }
}

pub(super) fn realtime_share(system: &System) -> Finding {
    let about = "real-time share";
    let share = system.number::<i64>(SHARE).zip(system.number::<i64>(SHARE_PERIOD));
    match share {
        Some((runtime, period)) if 0 <= runtime && runtime < period / 2 => {
            let change = Change::new(SHARE, runtime.to_string(), (period / 20 * 19).to_string());
            Finding::slower(
                about,
                format!("real-time threads get {runtime} of every {period} µs"),
                format!("sysctl kernel.sched_rt_runtime_us={}", change.to),
            )
            .with_changes(vec![change])
        }
        Some(_) | None => Finding::good(about, "real-time threads get most of a core"),
    }
}

pub(super) fn clock_source(system: &System) -> Finding {
    let about = "clock source";
    let Some(current) = system.read(&format!("{SOURCES}/current_clocksource")) else {
        return Finding::good(about, "the kernel names none");
    };
    if !SLOW_SOURCES.contains(&current.as_str()) {
        return Finding::good(about, format!("`{current}` is read without a system call"));
    }
    let available = system.read(&format!("{SOURCES}/available_clocksource")).unwrap_or_default();
    let better = available.split_whitespace().find(|source| !SLOW_SOURCES.contains(source));
    let mend = better.map_or_else(
        || "see what the kernel says of its clocks: `dmesg | grep -i clocksource`".to_owned(),
        // Not for `--apply`: the kernel may have rejected that source as unstable.
        |better| {
            format!("echo {better} > {SOURCES}/current_clocksource, if `dmesg` does not call it unstable")
        },
    );
    Finding::slower(about, format!("`{current}`: each clock read is a system call, and slow"), mend)
}

pub(super) fn wall_clock(is_kept: Option<bool>) -> Finding {
    let about = "wall clock";
    match is_kept {
        Some(false) => Finding::slower(
            about,
            "it is not synchronised: Leo's own time does not depend on it, but the logs of several machines cannot be \
             compared",
            "timedatectl set-ntp true",
        ),
        Some(true) => Finding::good(about, "kept in time"),
        None => Finding::good(about, "not known"),
    }
}

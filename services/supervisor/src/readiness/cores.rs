//! Checks of the cores: count, affinity of the hot path, isolation, frequency governors, idle states.

use std::collections::{BTreeMap, BTreeSet};
use std::iter::repeat_n;

use super::{Change, Finding, HotProcess, IdleStatePolicy, Machine, System};

const CPU: &str = "/sys/devices/system/cpu";
/// Exit latency in microseconds from which an idle state is considered harmful.
const IDLE_LATENCY: u64 = 50;
/// Remedy for missing access to `/dev/cpu_dma_latency`, by default root only. The package installs the rule for the
/// group `leo`.
const AWAKE_RULE: &str =
    r#"`KERNEL=="cpu_dma_latency", GROUP="<group>", MODE="0660"` in /etc/udev/rules.d/60-leo.rules"#;

/// Parses a kernel CPU list such as `0-3,7`.
pub(super) fn parse_list(list: &str) -> Vec<u16> {
    let ranges = list.split(',').filter_map(|range| {
        let (first, last) = range.trim().split_once('-').unwrap_or((range.trim(), range.trim()));
        Some(first.parse::<u16>().ok()?..=last.parse::<u16>().ok()?)
    });
    ranges.flatten().collect()
}

/// Formats a kernel CPU list.
pub(super) fn to_list(cores: &[u16]) -> String {
    cores.iter().map(u16::to_string).collect::<Vec<_>>().join(",")
}

/// All cores in the affinity of a hot process, sorted, without duplicates.
pub(super) fn chosen(hot: &[HotProcess]) -> Vec<u16> {
    let mut cores: Vec<u16> = hot.iter().flat_map(|process| process.cores.iter().copied()).collect();
    cores.sort_unstable();
    cores.dedup();
    cores
}

/// Checks the number of cores, and that the hot path uses more than one.
pub(super) fn count(machine: &Machine) -> Finding {
    let about = "cores";
    let cores = &machine.cores;
    if cores.len() < 2 {
        return Finding::slower(
            about,
            "one core may be used: the hot path needs two or more",
            "`AllowedCPUs=` of the systemd unit or `--cpuset-cpus` of the container, or a machine with more",
        );
    }
    let of =
        |hot: &HotProcess| if hot.cores.is_empty() { machine.given_cores.clone() } else { hot.cores.clone() };
    let mut reached: Vec<u16> = machine.hot.iter().flat_map(of).collect();
    reached.sort_unstable();
    reached.dedup();
    if reached.len() == 1 {
        return Finding::slower(
            about,
            format!("the whole hot path runs on {reached:?}, of {} that may be used", cores.len()),
            format!(
                "`cores` among {cores:?} in [sensor.realtime], [belief.realtime] and [motor.realtime] of leo.toml"
            ),
        );
    }
    Finding::good(about, format!("{} may be used", cores.len()))
}

/// Checks that each thread of the pinned hot processes can have a core of its own, as far as there are enough cores.
pub(super) fn plan(system: &System, hot: &[HotProcess], machine: &[u16]) -> Finding {
    let about = "core plan";
    let pinned: Vec<&HotProcess> = hot.iter().filter(|process| !process.cores.is_empty()).collect();
    if pinned.is_empty() {
        return Finding::good(about, "no hot process is pinned to a core");
    }
    let existing = existing(system, machine);
    if let Some((process, core)) =
        pinned.iter().find_map(|hot| Some((hot, hot.cores.iter().find(|core| !existing.contains(core))?)))
    {
        return Finding::broken(
            about,
            format!(
                "{} is configured for core {core}, and this machine has the cores {}",
                process.name,
                span(&existing)
            ),
            format!("cores among {} in [{}.realtime] of leo.toml", span(machine), process.name),
        );
    }
    if let Some((process, core)) =
        pinned.iter().find_map(|hot| Some((hot, hot.cores.iter().find(|core| !machine.contains(core))?)))
    {
        return Finding::slower(
            about,
            format!("{} is configured for core {core}, which this process may not use", process.name),
            format!("cores among {machine:?} in [{}.realtime] of leo.toml", process.name),
        );
    }
    let overloaded_core_sets = overloaded_core_sets(&pinned);
    let Some(first) = overloaded_core_sets.first() else {
        return Finding::good(about, format!("a core for each thread of {}", names(&pinned)));
    };
    let used = chosen(hot);
    // One core stays free for everything else: the adapters' interrupts, the other processes.
    let free: Vec<u16> = machine.iter().copied().filter(|core| !used.contains(core)).skip(1).collect();
    let text = |crowd: &BTreeSet<u16>| {
        let cores: Vec<u16> = crowd.iter().copied().collect();
        format!("{} on {cores:?}", names(&within(crowd, &pinned)))
    };
    let shared: Vec<String> = overloaded_core_sets.iter().map(text).collect();
    let shared = shared.join("; ");
    match within(first, &pinned).split_last() {
        Some((last, others)) if !free.is_empty() => Finding::slower(
            about,
            format!("threads share cores while {free:?} are free: {shared}"),
            free_cores_line(last, others, &free),
        ),
        Some(_) | None => Finding::good(about, format!("threads share cores, no more are free: {shared}")),
    }
}

/// The configuration line that gives `process` cores that no other process uses, as far as enough are free.
fn free_cores_line(process: &HotProcess, others: &[&HotProcess], free: &[u16]) -> String {
    let is_theirs = |core: &u16| others.iter().any(|other| other.cores.contains(core));
    let own = process.cores.iter().filter(|core| !is_theirs(core));
    let cores: Vec<u16> = own.chain(free).copied().take(process.threads).collect();
    format!("cores = {cores:?} in [{}.realtime] of leo.toml", process.name)
}

/// Sets of cores with more threads than cores. Cores between which threads could be exchanged belong to the same set.
fn overloaded_core_sets(pinned: &[&HotProcess]) -> Vec<BTreeSet<u16>> {
    let each = |hot: &&HotProcess| repeat_n(hot.cores.clone(), hot.threads);
    let threads: Vec<Vec<u16>> = pinned.iter().flat_map(each).collect();
    let mut taken = BTreeMap::new();
    let mut left_over = Vec::new();
    for thread in 0..threads.len() {
        if !assign_core(thread, &threads, &mut taken, &mut BTreeSet::new()) {
            left_over.push(thread);
        }
    }
    let mut overloaded_core_sets: Vec<BTreeSet<u16>> = Vec::new();
    for thread in left_over {
        // After the others have been placed: the cores that only moving another thread would free.
        let mut cores = BTreeSet::new();
        assign_core(thread, &threads, &mut taken, &mut cores);
        let (met, mut apart): (Vec<_>, Vec<_>) =
            overloaded_core_sets.into_iter().partition(|crowd| !crowd.is_disjoint(&cores));
        apart.push(met.into_iter().flatten().chain(cores).collect());
        overloaded_core_sets = apart;
    }
    overloaded_core_sets
}

/// Assigns a core to a thread, moving other threads among their own cores (augmenting path in bipartite matching).
/// Returns whether it succeeded. `taken` maps a core to its thread; `tried` collects the visited cores.
fn assign_core(
    thread: usize,
    threads: &[Vec<u16>],
    taken: &mut BTreeMap<u16, usize>,
    tried: &mut BTreeSet<u16>,
) -> bool {
    threads.get(thread).into_iter().flatten().any(|&core| {
        if !tried.insert(core) {
            return false;
        }
        let holder = taken.get(&core).copied();
        let is_free = holder.is_none_or(|holder| assign_core(holder, threads, taken, tried));
        if is_free {
            taken.insert(core, thread);
        }
        is_free
    })
}

/// The processes whose affinity lies within a crowd, sorted by number of threads.
fn within<'hot>(crowd: &BTreeSet<u16>, pinned: &[&'hot HotProcess]) -> Vec<&'hot HotProcess> {
    let is_within = |hot: &&&HotProcess| hot.cores.iter().all(|core| crowd.contains(core));
    let mut within: Vec<&HotProcess> = pinned.iter().filter(is_within).copied().collect();
    within.sort_by_key(|hot| hot.threads);
    within
}

fn names(hot: &[&HotProcess]) -> String {
    let name = |hot: &&HotProcess| match hot.threads {
        1 => hot.name.to_owned(),
        threads => format!("{} ({threads} threads)", hot.name),
    };
    hot.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// The cores that the machine has; those that a process may use where the kernel does not say.
pub(crate) fn existing(system: &System, usable: &[u16]) -> Vec<u16> {
    let present = parse_list(&system.read(&format!("{CPU}/present")).unwrap_or_default());
    if present.is_empty() { usable.to_vec() } else { present }
}

/// Cores in words: `0 to 3`, or the list of cores that are not in one row.
pub(crate) fn span(cores: &[u16]) -> String {
    match (cores.first(), cores.last()) {
        (Some(first), Some(last)) if first < last && usize::from(last - first) + 1 == cores.len() => {
            format!("{first} to {last}")
        }
        _ => cores.iter().map(u16::to_string).collect::<Vec<_>>().join(", "),
    }
}

/// Checks that no other program runs on the cores of the hot path. Cores that the machine does not have are no matter of
/// isolation.
pub(super) fn isolation(system: &System, hot: &[HotProcess], machine: &[u16]) -> Finding {
    let about = "isolated cores";
    let isolated = parse_list(&system.read(&format!("{CPU}/isolated")).unwrap_or_default());
    let existing = existing(system, machine);
    let chosen: Vec<u16> = chosen(hot).into_iter().filter(|core| existing.contains(core)).collect();
    let open: Vec<u16> = chosen.iter().copied().filter(|core| !isolated.contains(core)).collect();
    match (chosen.is_empty(), open.is_empty(), isolated.is_empty()) {
        (true, _, true) => Finding::good(about, "none, and no hot process is pinned to a core"),
        (true, _, false) => Finding::slower(
            about,
            format!("{isolated:?} are kept free of other work, and no hot process runs there"),
            "name them as `cores` in [sensor.realtime], [belief.realtime] and [motor.realtime] of leo.toml",
        ),
        (false, true, _) => Finding::good(about, format!("the hot path has {chosen:?} for itself")),
        (false, false, _) => {
            let list = to_list(&chosen);
            Finding::slower(
                about,
                format!("the hot path shares {open:?} with other programs"),
                format!("`isolcpus={list} nohz_full={list} rcu_nocbs={list}` on the kernel's command line"),
            )
        }
    }
}

pub(super) fn governors(system: &System, cores: &[u16]) -> Finding {
    let about = "frequency governor";
    let changes: Vec<Change> = cores
        .iter()
        .filter_map(|core| {
            let file = format!("{CPU}/cpu{core}/cpufreq/scaling_governor");
            let governor = system.read(&file).filter(|governor| governor != "performance")?;
            Some(Change::new(file, governor, "performance"))
        })
        .collect();
    match changes.first() {
        None => Finding::good(about, "no core is slowed down to save power"),
        Some(first) => {
            let text = format!(
                "`{}` on {} of {} cores: waking takes longer",
                first.from,
                changes.len(),
                cores.len()
            );
            Finding::slower(about, text, "cpupower frequency-set -g performance").with_changes(changes)
        }
    }
}

const HALTS: &str = "this kernel has no driver for them: an idle core always halts, and the host decides when it runs \
                     again";
const NO_HALT: &str =
    "add `idle=poll` to the kernel's command line (a guest of KVM: `cpuidle_haltpoll.force=1`)";

/// Whether an idle core of a virtual machine is returned to the host, whatever wake-up latency was requested.
///
/// Without a cpuidle driver, the kernel does not choose among idle states and cannot bound their latency
/// (`cpuidle_idle_call` in `kernel/sched/idle.c`). On a real machine this is the state with the shortest exit
/// latency.
fn idle_returns_core_to_host(system: &System) -> bool {
    let has = |file: &str, word: &str| {
        system.read(file).is_some_and(|text| text.split_whitespace().any(|part| part == word))
    };
    has(&format!("{CPU}/cpuidle/current_driver"), "none")
        && has("/proc/cpuinfo", "hypervisor")
        && !has("/proc/cmdline", "idle=poll")
}

/// Checks for idle states with a long exit latency that cores may enter.
pub(super) fn idle_states(system: &System, cores: &[u16], sleep: &IdleStatePolicy) -> Finding {
    let about = "idle states";
    if idle_returns_core_to_host(system) {
        return Finding::slower(about, HALTS, NO_HALT);
    }
    if *sleep == IdleStatePolicy::Prevented {
        return Finding::good(about, "none is entered while the robot runs");
    }
    let mut worst = 0;
    let mut changes = Vec::new();
    for core in cores {
        let folder = format!("{CPU}/cpu{core}/cpuidle");
        for state in system.names(&folder) {
            let disable = format!("{folder}/{state}/disable");
            let latency = system.number(&format!("{folder}/{state}/latency")).unwrap_or(0);
            if latency >= IDLE_LATENCY && system.number(&disable) == Some(0) {
                worst = latency.max(worst);
                changes.push(Change::new(disable, "0", "1"));
            }
        }
    }
    if let IdleStatePolicy::Refused(why) = sleep {
        let text = format!("cores sleep between cycles, and wake late: {why}");
        Finding::slower(about, text, AWAKE_RULE).with_changes(changes)
    } else if changes.is_empty() {
        Finding::good(about, format!("none takes {IDLE_LATENCY} µs or more to leave"))
    } else {
        let text = format!("an idle core takes up to {worst} µs to wake");
        Finding::slower(about, text, format!("cpupower idle-set -D {IDLE_LATENCY}")).with_changes(changes)
    }
}

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use clock::Duration;
use config::leo::Buffers;
use message::Histogram;
use realtime::SerialWorkersError;
use tempfile::TempDir;

use super::*;

/// A well configured machine: four cores, three of them isolated for the hot path, one adapter. The kernel gives the
/// isolated cores only to processes that request them.
const FILES: [(&str, &str); 15] = [
    ("proc/version", "Linux version 6.12.9-rt #1 SMP PREEMPT_RT"),
    ("proc/cmdline", "quiet isolcpus=1-3"),
    ("proc/meminfo", "MemTotal: 1 kB\nSwapTotal:       0 kB\n"),
    ("proc/sys/kernel/sched_rt_runtime_us", "950000"),
    ("proc/sys/kernel/sched_rt_period_us", "1000000"),
    ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc"),
    ("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm"),
    ("sys/devices/system/cpu/isolated", "1-3"),
    ("sys/devices/system/cpu/cpu2/cpufreq/scaling_governor", "performance"),
    ("sys/devices/system/cpu/cpu2/cpuidle/state1/latency", "2"),
    ("sys/devices/system/cpu/cpu2/cpuidle/state1/disable", "0"),
    ("sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "1"),
    ("sys/devices/pci0/0000:14/msi_irqs/33", "msi"),
    ("sys/devices/pci0/0000:14/usb1/tty/ttyUSB0/dev", "188:0"),
    ("proc/irq/33/smp_affinity_list", "0"),
];

fn good() -> (TempDir, Machine) {
    let root = tempfile::tempdir().unwrap();
    for (file, text) in FILES {
        put(&root, file, text);
    }
    fs::create_dir_all(root.path().join("sys/class/tty/ttyUSB0")).unwrap();
    symlink("../../../devices/pci0/0000:14/usb1", root.path().join("sys/class/tty/ttyUSB0/device")).unwrap();
    let hot = |name, cores: &[u16]| HotProcess {
        name,
        period: None,
        priority: 70,
        cores: cores.to_vec(),
        threads: 1,
    };
    let machine = Machine {
        cores: vec![0, 1, 2, 3],
        given_cores: vec![0],
        shared_memory_free: Some(1 << 30),
        shared_memory_needed: 12 << 20,
        descriptors: Some(4096),
        memory_limit: None,
        missing_rights: 0,
        is_wall_clock_synchronised: Some(true),
        hot: vec![hot("sensor", &[1]), hot("belief", &[2]), hot("motor", &[2, 3])],
        sleep: IdleStatePolicy::Allowed,
        carriers: SerialWorkerPriority::Prompt,
    };
    (root, machine)
}

fn put(root: &TempDir, file: &str, text: &str) {
    let file = root.path().join(file);
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(file, text).unwrap();
}

fn findings(root: &TempDir, machine: &Machine) -> Vec<Finding> {
    let findings = judge(&System::below(root.path()), machine);
    assert_eq!(findings.len(), 17);
    findings.into_iter().filter(|finding| finding.verdict != Verdict::Good).collect()
}

#[test]
fn a_correctly_configured_machine_has_no_finding() {
    let (root, machine) = good();
    assert_eq!(findings(&root, &machine), []);
}

#[test]
fn a_machine_without_readable_settings_is_checked_without_a_panic() {
    let root = tempfile::tempdir().unwrap();
    let findings = judge(&System::below(root.path()), &Machine::default());
    assert_eq!(findings.len(), 17);
    assert!(findings.iter().all(|finding| finding.changes.is_empty()), "{findings:?}");
    assert_eq!(judge(&System::below(Path::new("/nowhere")), &Machine::default()), findings);
}

#[test]
fn larger_buffers_need_more_shared_memory() {
    let buffers = |objects: i64, frames: i64| {
        let text = format!("max_objects = {objects}\nqueue_depth = {frames}\n");
        config::parse::<Buffers>(&text, Path::new("leo.toml")).unwrap()
    };
    let needed = |objects, frames, lockstep, perspectives| {
        let buffers = buffers(objects, frames);
        let frames = process::queues(&buffers, lockstep).max_frames();
        shared_memory_needed(buffers.max_objects.get(), frames, perspectives) >> 10
    };
    // Measured on robots with one partner, in KiB.
    for (objects, frames, lockstep, measured) in [
        (64, 4, false, 15_163),
        (1024, 1, false, 84_069),
        (1024, 4, false, 164_368),
        (4096, 4, false, 641_824),
        (64, 4, true, 38_875),
        (1024, 4, true, 480_400),
    ] {
        let needed = needed(objects, frames, lockstep, 2);
        assert!(measured < needed && needed < 2 * measured + 8192, "{objects}, {frames}: {needed} KiB");
    }
    assert!(needed(64, 8, false, 2) > needed(64, 4, false, 2));
    assert!(needed(64, 4, false, 3) > needed(64, 4, false, 2));
}

#[test]
fn every_missing_right_is_found_alone_with_its_remedy() {
    let (root, good) = good();
    let cases = [
        (Machine { shared_memory_free: Some(1 << 20), ..good.clone() }, Verdict::Broken, "remount"),
        (Machine { shared_memory_free: None, ..good.clone() }, Verdict::Broken, "mount -t tmpfs"),
        (Machine { descriptors: Some(256), ..good.clone() }, Verdict::Broken, "LimitNOFILE"),
        (Machine { missing_rights: 1, ..good.clone() }, Verdict::Slower, "LimitRTPRIO"),
        (
            Machine { missing_rights: 4, memory_limit: Some(8 << 20), ..good.clone() },
            Verdict::Slower,
            "LimitMEMLOCK",
        ),
        (Machine { is_wall_clock_synchronised: Some(false), ..good.clone() }, Verdict::Slower, "set-ntp"),
        (
            Machine { sleep: IdleStatePolicy::Refused("not you".to_owned()), ..good.clone() },
            Verdict::Slower,
            "cpu_dma_latency",
        ),
        (
            Machine {
                carriers: SerialWorkerPriority::Refused(SerialWorkersError::Forbidden),
                ..good.clone()
            },
            Verdict::Slower,
            "CAP_SYS_NICE",
        ),
        (
            Machine { carriers: SerialWorkerPriority::Refused(SerialWorkersError::Hidden), ..good.clone() },
            Verdict::Slower,
            "chrt --fifo",
        ),
        (
            Machine { cores: vec![1, 2, 3, 4, 5], hot: pinned([&[2], &[2], &[3]]), ..good.clone() },
            Verdict::Slower,
            "cores = [4]",
        ),
        (Machine { hot: pinned([&[1], &[2], &[7]]), ..good.clone() }, Verdict::Broken, "[motor.realtime]"),
        (
            Machine {
                cores: (0..6).collect(),
                given_cores: vec![0, 4, 5],
                hot: pinned([&[], &[], &[]]),
                ..good.clone()
            },
            Verdict::Slower,
            "name them as `cores`",
        ),
        (Machine { cores: vec![0], hot: Vec::new(), ..good.clone() }, Verdict::Slower, "AllowedCPUs"),
    ];
    let mut wording = String::new();
    for (machine, verdict, word) in cases {
        let findings: Vec<Finding> = findings(&root, &machine)
            .into_iter()
            .filter(|finding| finding.about != "isolated cores" || word.contains("name them"))
            .collect();
        assert_eq!(findings.len(), 1, "{word}: {findings:?}");
        assert_eq!(findings[0].verdict, verdict);
        let mend = findings[0].mend.as_ref().unwrap();
        assert!(mend.contains(word), "{findings:?}");
        wording += &format!("{}\n    {}\n    mend: {mend}\n", findings[0].about, findings[0].text);
    }
    insta::assert_snapshot!(wording);
}

#[test]
fn an_unpinned_hot_path_has_only_the_cores_that_are_not_isolated() {
    let (root, good) = good();
    let findings = findings(&root, &Machine { hot: pinned([&[], &[], &[]]), ..good });
    let cores = findings.iter().find(|finding| finding.about == "cores").unwrap();
    assert!(cores.text.contains("[0]") && cores.text.contains(" 4"), "{cores:?}");
    assert!(cores.mend.as_ref().unwrap().contains("among [0, 1, 2, 3]"), "{cores:?}");
}

fn pinned(cores: [&[u16]; 3]) -> Vec<HotProcess> {
    let hot = |(name, cores): (_, &[u16])| HotProcess {
        name,
        period: None,
        priority: 70,
        cores: cores.to_vec(),
        threads: 1,
    };
    ["sensor", "belief", "motor"].into_iter().zip(cores).map(hot).collect()
}

#[test]
fn threads_that_share_a_core_while_others_are_free_are_named() {
    let plan = |cores: u16, motor: &[u16], buses: usize, mock: &[u16]| {
        let mut hot = pinned([&[1], &[2], motor]);
        hot[2].threads = 1 + buses;
        let name = "mock_bus";
        hot.push(HotProcess { name, period: None, priority: 72, cores: mock.to_vec(), threads: buses });
        let elsewhere = System::below(Path::new("/nowhere"));
        let found = cores::plan(&elsewhere, &hot, &(0..cores).collect::<Vec<_>>());
        (found.verdict, found.text, found.mend)
    };
    let mut wording = String::new();
    let mut found = |plan: (Verdict, String, Option<String>)| {
        let (verdict, text, mend) = plan;
        let mend = mend.unwrap_or_else(|| "nothing".to_owned());
        wording += &format!("{text}\n    mend: {mend}\n");
        (verdict, mend)
    };
    let good = || (Verdict::Good, "nothing".to_owned());
    let slower = |cores: &str| (Verdict::Slower, format!("cores = {cores} in [motor.realtime] of leo.toml"));
    // The recommended plan for four cores: one core for everything else.
    assert_eq!(found(plan(4, &[3], 5, &[])), good());
    assert_eq!(found(plan(8, &[3], 5, &[])), slower("[3, 4, 5, 6, 7]"));
    assert_eq!(found(plan(8, &[3, 4, 5, 6, 7], 5, &[])), good());
    assert_eq!(found(plan(16, &[3, 4, 5, 6, 7, 8], 5, &[])), good());
    assert_eq!(found(plan(16, &[3, 4, 5], 2, &[5, 6])), slower("[3, 4, 7]"));
    // Two independent crowds.
    assert_eq!(found(plan(5, &[2], 1, &[1])), slower("[3, 4]"));
    insta::assert_snapshot!(wording);
    // The search stays fast for many threads.
    let many: Vec<u16> = (3..60).collect();
    let (verdict, text, _) = plan(64, &many, 90, &many);
    assert_eq!(verdict, Verdict::Slower);
    assert!(text.contains("mock_bus (90 threads), motor (91 threads) on [3, 4, "), "{text}");
}

#[test]
fn every_wrong_kernel_setting_is_found_alone_with_its_remedy() {
    let cpu = "sys/devices/system/cpu";
    let clock = "sys/devices/system/clocksource/clocksource0/current_clocksource";
    for (file, text, word, change) in [
        ("proc/meminfo", "SwapTotal: 2048 kB", "swapoff", None),
        ("proc/sys/kernel/sched_rt_runtime_us", "1000", "sysctl", Some(("1000", "950000"))),
        (clock, "hpet", "echo tsc", None),
        (&format!("{cpu}/isolated"), "", "isolcpus=1,2,3", None),
        (
            &format!("{cpu}/cpu3/cpufreq/scaling_governor"),
            "powersave",
            "cpupower",
            Some(("powersave", "performance")),
        ),
        (&format!("{cpu}/cpu2/cpuidle/state1/latency"), "400", "idle-set", Some(("0", "1"))),
        ("sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16", "udev", Some(("16", "1"))),
        ("proc/irq/33/smp_affinity_list", "0-3", "irqbalance", Some(("0-3", "0"))),
        ("proc/version", "Linux version 6.1 SMP PREEMPT_DYNAMIC", "PREEMPT_RT", None),
        ("proc/version", "Linux version 6.1 SMP", "PREEMPT_RT", None),
    ] {
        let (root, machine) = good();
        put(&root, file, text);
        let findings = findings(&root, &machine);
        assert_eq!(findings.len(), 1, "{file}: {findings:?}");
        assert_eq!(findings[0].verdict, Verdict::Slower);
        assert!(findings[0].mend.as_ref().unwrap().contains(word), "{findings:?}");
        let would: Vec<_> =
            findings[0].changes.iter().map(|change| (change.from.as_str(), change.to.as_str())).collect();
        assert_eq!(would, Vec::from_iter(change), "{file}");
    }
}

#[test]
fn idle_states_that_no_core_enters_may_be_deep() {
    let (root, machine) = good();
    put(&root, "sys/devices/system/cpu/cpu2/cpuidle/state1/latency", "400");
    assert_eq!(findings(&root, &Machine { sleep: IdleStatePolicy::Prevented, ..machine }), []);
}

#[test]
fn virtual_cores_that_always_halt_are_reported() {
    let with = |sleep, files: &[(&str, &str)]| {
        let (root, machine) = good();
        files.iter().for_each(|(file, text)| put(&root, file, text));
        findings(&root, &Machine { sleep, ..machine })
    };
    let awake = |files: &[(&str, &str)]| with(IdleStatePolicy::Prevented, files);
    let driver = ("sys/devices/system/cpu/cpuidle/current_driver", "none\n");
    let guest = ("proc/cpuinfo", "flags\t: fpu hypervisor lahf_lm\n");
    let findings = awake(&[driver, guest]);
    assert_eq!(findings.len(), 1, "{findings:?}");
    assert_eq!((findings[0].verdict, findings[0].about.as_str()), (Verdict::Slower, "idle states"));
    assert!(findings[0].mend.as_ref().unwrap().contains("idle=poll"), "{findings:?}");
    assert_eq!(with(IdleStatePolicy::Allowed, &[driver, guest]), findings, "nor where nobody asks");
    assert_eq!(awake(&[driver]), [], "a real core wakes soon");
    assert_eq!(awake(&[(driver.0, "haltpoll\n"), guest]), [], "the driver polls");
    assert_eq!(awake(&[driver, guest, ("proc/cmdline", "quiet idle=poll\n")]), [], "nothing halts");
}

#[test]
fn a_more_preemptible_kernel_mode_is_recommended() {
    let (root, machine) = good();
    put(&root, "proc/version", "Linux version 6.12 SMP PREEMPT_DYNAMIC");
    put(&root, "sys/kernel/debug/sched/preempt", "none (voluntary) full lazy");
    let findings = findings(&root, &machine);
    assert_eq!(findings[0].changes, [Change::new("/sys/kernel/debug/sched/preempt", "voluntary", "full")]);
}

#[test]
fn a_process_that_wakes_too_late_for_its_rate_is_reported() {
    let mut late = Histogram::default();
    for _ in 0..10_000 {
        late.record(40_000);
    }
    let wakeup = |late, hz: u32| Wakeup { process: "motor", period: Duration::from_secs(1) / hz, late };
    assert_eq!(judge_wakeup(&wakeup(late, 250)).verdict, Verdict::Good);
    assert_eq!(judge_wakeup(&wakeup(late, 5000)).verdict, Verdict::Slower, "p99.9 of a fifth of the period");
    late.record(3_000_000);
    let told = judge_wakeup(&wakeup(late, 250));
    assert_eq!(told.verdict, Verdict::Slower, "one of more than half a period");
    assert!(told.text.contains("250 Hz") && told.text.contains("max 3000 µs"), "{}", told.text);
    assert_eq!(judge_wakeup(&wakeup(Histogram::default(), 250)).verdict, Verdict::Slower);
}

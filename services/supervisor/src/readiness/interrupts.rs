//! Checks on which cores the interrupts of serial adapters are served.

use super::cores::{chosen, parse_list, to_list};
use super::{Change, Finding, HotProcess, System};

const TTYS: &str = "/sys/class/tty";

pub(super) fn of_adapters(system: &System, hot: &[HotProcess], cores: &[u16]) -> Finding {
    let about = "adapter interrupts";
    let is_adapter = |name: &String| name.starts_with("ttyUSB") || name.starts_with("ttyACM");
    let adapters: Vec<String> = system.names(TTYS).into_iter().filter(is_adapter).collect();
    if adapters.is_empty() {
        return Finding::good(about, "no serial adapter is plugged in");
    }
    let chosen = chosen(hot);
    let others: Vec<u16> = cores.iter().copied().filter(|core| !chosen.contains(core)).collect();
    if chosen.is_empty() || others.is_empty() {
        return Finding::good(about, "no cores are reserved for the hot path");
    }
    let mut interrupts: Vec<u32> = adapters.iter().flat_map(|adapter| of(system, adapter)).collect();
    interrupts.sort_unstable();
    interrupts.dedup();
    let changes: Vec<Change> = interrupts
        .iter()
        .filter_map(|interrupt| {
            let file = format!("/proc/irq/{interrupt}/smp_affinity_list");
            let list = system.read(&file)?;
            let disturbs = parse_list(&list).iter().any(|core| chosen.contains(core));
            disturbs.then(|| Change::new(file, list, to_list(&others)))
        })
        .collect();
    match changes.first() {
        None => Finding::good(about, format!("served away from the cores {chosen:?} of the hot path")),
        Some(first) => {
            let text = format!(
                "{} of {} may be served on the cores {chosen:?} of the hot path",
                changes.len(),
                interrupts.len()
            );
            let mend = format!("{first}, and exclude them from irqbalance, where it runs");
            Finding::slower(about, text, mend).with_changes(changes)
        }
    }
}

/// The interrupts of the nearest ancestor device of a tty that has any: the USB controller's.
fn of(system: &System, tty: &str) -> Vec<u32> {
    for device in system.ancestors(&format!("{TTYS}/{tty}/device")) {
        let several = system.names(&format!("{device}/msi_irqs"));
        let one = system.read(&format!("{device}/irq")).filter(|irq| irq != "0");
        let found: Vec<u32> = several.into_iter().chain(one).filter_map(|irq| irq.parse().ok()).collect();
        if !found.is_empty() {
            return found;
        }
    }
    Vec::new()
}

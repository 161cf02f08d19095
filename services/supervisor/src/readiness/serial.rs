//! Checks of serial lines: latency timers of adapters, priority of the kernel workers.

use realtime::SerialWorkersError;

use super::{Change, Finding, SerialWorkerPriority, System};

const ADAPTERS: &str = "/sys/bus/usb-serial/devices";
/// Latency timer of an adapter in milliseconds. A status packet never fills the adapter's buffer, so each waits for
/// this timer.
const TIMER: u64 = 1;

pub(super) fn latency_timers(system: &System) -> Finding {
    let about = "adapter latency";
    let mut known = 0;
    let mut worst = 0;
    let mut changes = Vec::new();
    for adapter in system.names(ADAPTERS) {
        let file = format!("{ADAPTERS}/{adapter}/latency_timer");
        let Some(millis) = system.number::<u64>(&file) else { continue };
        known += 1;
        if millis > TIMER {
            worst = millis.max(worst);
            changes.push(Change::new(file, millis.to_string(), TIMER.to_string()));
        }
    }
    match changes.first() {
        None if known == 0 => Finding::good(about, "no serial adapter with a timer is plugged in"),
        None => Finding::good(about, format!("{known} serial adapters deliver received bytes at once")),
        Some(first) => {
            let text = format!(
                "{} of {known} serial adapters deliver received bytes up to {worst} ms late",
                changes.len()
            );
            let mend = format!("{first}; for good with the udev rule of the package");
            Finding::slower(about, text, mend).with_changes(changes)
        }
    }
}

pub(super) fn carriers(carriers: SerialWorkerPriority) -> Finding {
    let about = "serial lines";
    let refused = match carriers {
        SerialWorkerPriority::Ordinary => {
            return Finding::good(about, "their bytes may wait for other work, as `leo.toml` says");
        }
        SerialWorkerPriority::Prompt => {
            return Finding::good(about, "their bytes have priority over other work while the robot runs");
        }
        SerialWorkerPriority::Refused(refused) => refused,
    };
    let mend = match refused {
        SerialWorkersError::Forbidden => {
            "`AmbientCapabilities=CAP_SYS_NICE` in the systemd unit, as in the package's, or start the robot as root"
        }
        SerialWorkersError::Hidden => {
            "start the robot outside of the container; or there, as root, now and then: `for worker in $(pgrep \
             kworker/u); do chrt --fifo --pid 1 $worker; done`"
        }
    };
    let text = format!("other programs may delay their bytes by tens of milliseconds: {refused}");
    Finding::slower(about, text, mend)
}

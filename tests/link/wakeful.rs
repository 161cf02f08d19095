//! Keeps cores from becoming idle.

use std::process::{Child, Command};

/// A busy loop of idle priority on each of some cores; ended on drop.
///
/// An idle virtual core is returned to the host, and a wake-up on it waits for the host. Then the host is
/// measured, and the less a core has to do, the slower it appears. A robot keeps its cores awake instead
/// (`supervisor.keep_cores_awake`), which needs a kernel driver.
pub(crate) struct Wakeful(Vec<Child>);

impl Wakeful {
    pub(crate) fn on(cores: impl IntoIterator<Item = usize>) -> Self {
        // Scheduling class SCHED_IDLE.
        let spins = "import os, sys; os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0)); \
                     os.sched_setaffinity(0, {int(sys.argv[1])})\nwhile True: pass";
        let spin = |core: usize| {
            Command::new("python3")
                .args(["-c", spins, &core.to_string()])
                .spawn()
                .expect("as the network was")
        };
        Self(cores.into_iter().map(spin).collect())
    }
}

impl Drop for Wakeful {
    fn drop(&mut self) {
        for spinner in &mut self.0 {
            let _dead = spinner.kill().and_then(|()| spinner.wait());
        }
    }
}

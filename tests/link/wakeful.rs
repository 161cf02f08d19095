//! Cores that are never idle.

use std::process::{Child, Command};

/// Whoever has nothing better to do, one on each of some cores; gone when dropped.
///
/// A virtual core that is idle is given back to the host, and whoever is to be woken on it waits for the host: then it
/// is the host that is measured, and what is done less often on one core is dearer on the other. An onboard computer's
/// cores are kept from such states (`supervisor.keep_cores_awake`), which takes a kernel that has a driver for them.
pub(crate) struct Wakeful(Vec<Child>);

impl Wakeful {
    pub(crate) fn on(cores: impl IntoIterator<Item = usize>) -> Self {
        // Of the class that runs when no other does.
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

//! A core that is never idle.

use std::process::{Child, Command};

/// Whoever has nothing better to do, on the cores of whoever made it; gone when dropped.
///
/// A virtual core that is idle is given back to the host, and whoever wakes it waits for the host: what is done less
/// often on one core is then dearer on the other. An onboard computer's cores are kept from such states
/// (`supervisor.keep_cores_awake`).
pub(crate) struct Wakeful(Child);

impl Wakeful {
    pub(crate) fn begin() -> Self {
        // Of the class that runs when no other does.
        let spins = "import os; os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))\nwhile True: pass";
        Self(Command::new("python3").args(["-c", spins]).spawn().expect("as the network was"))
    }
}

impl Drop for Wakeful {
    fn drop(&mut self) {
        let _dead = self.0.kill().and_then(|()| self.0.wait());
    }
}

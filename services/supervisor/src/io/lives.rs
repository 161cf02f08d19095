use std::fs;

use message::{Process, Roster};
use transport::{Node, PortError, RosterWriter};

/// The supervisor's roster on its board: which life of each process is the newest, and which process may publish.
#[derive(Debug)]
pub struct Lives {
    board: RosterWriter,
    roster: Roster,
}

impl Lives {
    /// Puts up the roster of a robot that these processes are.
    ///
    /// # Errors
    ///
    /// Another supervisor runs in the domain, or shared memory is full.
    pub fn put_up(node: &Node, members: &[Process]) -> Result<Self, PortError> {
        let mut lives =
            Self { board: RosterWriter::create(node, Process::Supervisor, 1)?, roster: Roster::default() };
        for member in members {
            lives.roster.add_member(*member);
        }
        lives.stand_in(node, Process::Supervisor);
        Ok(lives)
    }

    /// Lets this process publish in the place of a process of the robot.
    pub fn stand_in(&mut self, node: &Node, process: Process) {
        self.roster.add_member(process);
        self.roster.set_pid(process, node.pid(), 0);
        self.board.write(&self.roster);
    }

    /// Notes that a life begins, of which the process is not known yet.
    pub(crate) fn begin(&mut self, process: Process, incarnation: u64) {
        self.roster.set_incarnation(process, incarnation);
        self.board.write(&self.roster);
    }

    /// Notes which process it is that was started at an instant. It waits for that before it publishes.
    pub(crate) fn name(&mut self, process: Process, pid: u32, began_at_ns: u64) {
        self.roster.set_pid(process, outermost(pid), began_at_ns);
        self.board.write(&self.roster);
    }

    /// Notes that a life has ended. To be called before its process is reaped: until then its number is no other's.
    pub(crate) fn end(&mut self, process: Process, ended_at_ns: u64) {
        self.roster.end(process, ended_at_ns);
        self.board.write(&self.roster);
    }
}

/// The number of a process in the outermost namespace that can be seen, as the middleware uses it.
fn outermost(pid: u32) -> u32 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let numbers = status.lines().find_map(|line| line.strip_prefix("NSpid:"));
    let mut numbers = numbers.unwrap_or_default().split_whitespace().map(str::parse);
    match (numbers.next(), numbers.next_back()) {
        (Some(Ok(outermost)), Some(Ok(own))) if own == pid => outermost,
        _ => pid,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_numbered_as_its_namespace_says() {
        assert_eq!(outermost(std::process::id()), std::process::id());
        assert_eq!(outermost(u32::MAX), u32::MAX, "there is none");
    }
}

use std::fs;

use message::{Process, Roster};
use transport::{Node, PortError, RosterWriter};

/// Writer of the supervisor's roster: the newest incarnation of each process, and which process may publish.
#[derive(Debug)]
pub struct RosterPublisher {
    board: RosterWriter,
    roster: Roster,
}

impl RosterPublisher {
    /// Publishes the roster of a robot that consists of these processes.
    ///
    /// # Errors
    ///
    /// Another supervisor runs in the domain, or shared memory is exhausted.
    pub fn publish_members(node: &Node, members: &[Process]) -> Result<Self, PortError> {
        let mut publisher =
            Self { board: RosterWriter::create(node, Process::Supervisor, 1)?, roster: Roster::default() };
        for member in members {
            publisher.roster.add_member(*member);
        }
        publisher.register_self(node, Process::Supervisor);
        Ok(publisher)
    }

    /// Allows this process to publish in place of a process of the robot.
    pub fn register_self(&mut self, node: &Node, process: Process) {
        self.roster.add_member(process);
        self.roster.set_pid(process, node.pid(), 0);
        self.board.write(&self.roster);
    }

    /// Records that an incarnation starts, whose process id is not known yet.
    pub(crate) fn begin(&mut self, process: Process, incarnation: u64) {
        self.roster.set_incarnation(process, incarnation);
        self.board.write(&self.roster);
    }

    /// Records the process id and start time of the newest incarnation. The process waits for this before it
    /// publishes.
    pub(crate) fn name(&mut self, process: Process, pid: u32, began_at_ns: u64) {
        self.roster.set_pid(process, outermost(pid), began_at_ns);
        self.board.write(&self.roster);
    }

    /// Records that an incarnation has ended. Call it before the process is reaped, because reaping frees its process
    /// id.
    pub(crate) fn end(&mut self, process: Process, ended_at_ns: u64) {
        self.roster.end(process, ended_at_ns);
        self.board.write(&self.roster);
    }
}

/// The process id in the outermost visible namespace, as the middleware uses it.
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
    fn a_process_number_is_that_of_its_namespace() {
        assert_eq!(outermost(std::process::id()), std::process::id());
        assert_eq!(outermost(u32::MAX), u32::MAX, "there is none");
    }
}

use crate::{Process, ZeroCopySend};

/// One incarnation of a process, as recorded by the supervisor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Life/1")]
pub struct Life {
    /// Number of the incarnation, from one; zero if the process was never started.
    pub incarnation: u64,
    /// When the supervisor began to start it, in nanoseconds of the monotonic clock.
    pub began_at_ns: u64,
    /// When the supervisor detected its end; zero while it runs. Until then its process id is not reused.
    pub ended_at_ns: u64,
    /// The operating system's process id in the outermost visible namespace; zero while unknown.
    pub pid: u32,
    /// 1 if the process belongs to this robot on this machine, else 0.
    is_member: u32,
}

impl Life {
    /// Whether an object with this process id and creation time was created by this incarnation.
    #[must_use]
    pub const fn made(&self, pid: u32, at_ns: u64) -> bool {
        let is_before_end = self.ended_at_ns == 0 || at_ns <= self.ended_at_ns;
        self.pid != 0 && self.pid == pid && self.began_at_ns <= at_ns && is_before_end
    }
}

/// The newest incarnation of each process, as recorded by the supervisor. It determines the board of that
/// incarnation's [`Health`](crate::Health), and the process that may publish.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Roster/3")]
pub struct Roster {
    lives: [Life; 16],
}

impl Roster {
    /// The newest incarnation of a process; `None` if it was never started.
    #[must_use]
    pub fn incarnation(&self, process: Process) -> Option<u64> {
        self.life(process).map(|life| life.incarnation).filter(|&incarnation| incarnation > 0)
    }

    /// The newest incarnation of a process; `None` if the process does not belong to this robot on this machine.
    #[must_use]
    pub fn life(&self, process: Process) -> Option<&Life> {
        self.lives.get(usize::from(process.raw())).filter(|life| life.is_member != 0)
    }

    /// Records that a process belongs to this robot on this machine.
    pub fn add_member(&mut self, process: Process) {
        self.change(process, |_| ());
    }

    /// Records that an incarnation starts. It may not publish until its process id is set.
    pub fn set_incarnation(&mut self, process: Process, incarnation: u64) {
        self.change(process, |life| *life = Life { incarnation, is_member: 1, ..Life::default() });
    }

    /// Records the process id of the newest incarnation, which may publish from now on.
    pub fn set_pid(&mut self, process: Process, pid: u32, began_at_ns: u64) {
        self.change(process, |life| (life.pid, life.began_at_ns) = (pid, began_at_ns));
    }

    /// Records that the newest incarnation has ended. Frames that it published before remain valid.
    pub fn end(&mut self, process: Process, ended_at_ns: u64) {
        self.change(process, |life| life.ended_at_ns = ended_at_ns);
    }

    /// Whether a publisher may write a topic of `owner`. It must belong to the owner's newest incarnation, or to the
    /// link's if the owner runs on another machine. A publisher is identified by process id and creation time.
    ///
    /// This is the only place that decides who may publish. Other commanders would have to be added here as
    /// incarnations.
    #[must_use]
    pub fn may_publish(&self, owner: Process, pid: u32, made_at_ns: u64) -> bool {
        let life = self.life(owner).or_else(|| self.life(Process::Link));
        life.is_some_and(|life| life.made(pid, made_at_ns))
    }

    fn change(&mut self, process: Process, change: impl FnOnce(&mut Life)) {
        if let Some(life) = self.lives.get_mut(usize::from(process.raw())) {
            life.is_member = 1;
            change(life);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_instance_may_publish() {
        let mut roster = Roster::default();
        let may = |roster: &Roster, pid, at| roster.may_publish(Process::Learner, pid, at);
        assert!(!may(&roster, 0, 0) && roster.incarnation(Process::Learner).is_none());
        roster.add_member(Process::Learner);
        assert!(!may(&roster, 0, 0) && roster.incarnation(Process::Learner).is_none());
        roster.set_incarnation(Process::Learner, 1);
        assert_eq!((may(&roster, 0, 5), roster.incarnation(Process::Learner)), (false, Some(1)));
        roster.set_pid(Process::Learner, 70, 100);
        assert_eq!([99, 100, 5_000].map(|at| may(&roster, 70, at)), [false, true, true]);
        assert!(!may(&roster, 71, 5_000));
        roster.end(Process::Learner, 200);
        assert_eq!([200, 201].map(|at| may(&roster, 70, at)), [true, false], "the number is another's now");
        roster.set_incarnation(Process::Learner, 2);
        assert_eq!([0, 70].map(|pid| may(&roster, pid, 150)), [false, false], "a life without a number");
        roster.set_pid(Process::Learner, 70, 300);
        assert_eq!([150, 300].map(|at| may(&roster, 70, at)), [false, true]);
    }

    #[test]
    fn the_link_publishes_for_a_process_on_another_machine_alone() {
        let mut roster = Roster::default();
        roster.add_member(Process::Motor);
        roster.set_incarnation(Process::Link, 1);
        roster.set_pid(Process::Link, 80, 10);
        let may = |roster: &Roster, owner| roster.may_publish(owner, 80, 20);
        let allowed = [Process::Learner, Process::Motor, Process::Link].map(|owner| may(&roster, owner));
        assert_eq!(allowed, [true, false, true]);
    }
}

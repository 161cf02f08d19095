//! Arming from the page: shows the joints' summary and forwards the arming order.

use std::path::{Path, PathBuf};

use clock::{Duration, Instant};
use message::{Joints, Process, Roster};
use process::arming::{self, ArmOrder};
use process::{ProcessNode, emergency};
use transport::{CurrentBoard, Domain};

use crate::cells;
use crate::io::requester::Requester;
use crate::state_store::StateStore;

/// Interval between two reads of the joints' health board.
const READ_INTERVAL: Duration = Duration::from_millis(200);
/// Time-out of an arming order. The motor process normally takes one within a few cycles.
const ORDER_TIMEOUT: Duration = Duration::from_secs(3);

/// Publishes the summary of the joints and tracks the pages waiting for the result of an arming order.
pub(crate) struct Arming {
    domain: PathBuf,
    joint_names: Vec<String>,
    roster: CurrentBoard<Roster>,
    board: CurrentBoard<Joints>,
    read_at: Option<Instant>,
    waiting: Vec<(Instant, Requester)>,
}

impl Arming {
    pub(crate) fn new(domain: &Path, joint_names: &[String]) -> Self {
        Self {
            domain: domain.to_owned(),
            joint_names: joint_names.to_vec(),
            roster: CurrentBoard::default(),
            board: CurrentBoard::default(),
            read_at: None,
            waiting: Vec::new(),
        }
    }

    /// Publishes the summary every [`READ_INTERVAL`]. The lock count comes from the same reading as the summary,
    /// so a page cannot acknowledge a lock that it has not shown.
    pub(crate) fn show(&mut self, now: Instant, member: &ProcessNode, state_store: &mut StateStore) {
        if self.read_at.is_some_and(|then| now.since(then) < READ_INTERVAL) {
            return;
        }
        self.read_at = Some(now);
        let is_stopped = emergency::is_raised(&self.domain);
        match self.read(member) {
            Some(joints) => cells::arming(state_store, &self.joint_names, &joints, is_stopped),
            None => state_store.remove("arming"),
        }
    }

    /// The joints reported by the current incarnation of the motor process.
    fn read(&mut self, member: &ProcessNode) -> Option<Joints> {
        let roster = self.roster.read(member.node(), Process::Supervisor, 1)?;
        let incarnation = roster.incarnation(Process::Motor)?;
        self.board.read(member.node(), Process::Motor, incarnation).filter(|joints| joints.count > 0)
    }

    /// Orders arming on behalf of a page. The page gets its answer once the motor process has taken the order.
    pub(crate) fn ask(&mut self, now: Instant, acknowledged_locks: Option<u64>, requester: Requester) {
        if emergency::is_raised(&self.domain) {
            let why = "the emergency stop is raised, and no joint was armed: release it with \
                       `leo emergency-stop --release`";
            return requester.answer(Err(why));
        }
        match arming::order(&self.domain, ArmOrder { acknowledged_locks }) {
            Ok(()) => self.waiting.push((now, requester)),
            Err(error) => requester.answer(Err(&format!("no joint was armed: {error}"))),
        }
    }

    /// Answers the pages whose order was taken. Withdraws an order that timed out: otherwise a motor process that
    /// starts later would obey it.
    pub(crate) fn step(&mut self, now: Instant) {
        let Some((oldest, _)) = self.waiting.first() else { return };
        let is_taken = !Domain::arm_order(&self.domain).exists();
        if !is_taken && now.since(*oldest) < ORDER_TIMEOUT {
            return;
        }
        let withdrawn = if is_taken { Ok(None) } else { arming::take(&self.domain) };
        for (_, requester) in self.waiting.drain(..) {
            match &withdrawn {
                Ok(None) => requester.answer(Ok(None)),
                Ok(Some(_)) => {
                    let why = "the motor process has not taken the order, and no joint was armed: is it being restarted?";
                    requester.answer(Err(why));
                }
                Err(error) => {
                    requester.answer(Err(&format!("the order cannot be withdrawn: {error}")));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::mpsc::{Receiver, channel};

    use super::*;

    fn answered(answers: &mut Receiver<String>) -> Option<serde_json::Value> {
        answers.try_recv().ok().map(|text| serde_json::from_str(&text).unwrap())
    }

    #[test]
    fn a_page_is_answered_once_the_motor_process_has_taken_its_order() {
        let folder = tempfile::tempdir().unwrap();
        let mut desk = Arming::new(folder.path(), &[]);
        let (answer, mut answers) = channel(4);
        let start = Instant::from_nanos(1_000_000_000);
        desk.ask(start, Some(7), Requester { page: answer, id: Some(3) });
        desk.step(start + Duration::from_millis(10));
        assert_eq!(answered(&mut answers), None, "the order still stands");
        let order = arming::take(folder.path()).unwrap();
        assert_eq!(order, Some(ArmOrder { acknowledged_locks: Some(7) }));
        desk.step(start + Duration::from_millis(20));
        assert_eq!(answered(&mut answers).unwrap(), serde_json::json!({"answer": 3, "ok": true}));
    }

    #[test]
    fn an_order_that_no_motor_process_takes_is_withdrawn_and_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut desk = Arming::new(folder.path(), &[]);
        let (answer, mut answers) = channel(4);
        let start = Instant::from_nanos(1_000_000_000);
        desk.ask(start, None, Requester { page: answer, id: Some(3) });
        desk.step(start + ORDER_TIMEOUT);
        let told = answered(&mut answers).unwrap();
        insta::assert_snapshot!(told["error"].as_str().unwrap());
        assert_eq!(arming::take(folder.path()).unwrap(), None);
    }

    #[test]
    fn no_arm_order_is_given_while_the_emergency_stop_is_raised() {
        let folder = tempfile::tempdir().unwrap();
        emergency::raise(folder.path(), "a test").unwrap();
        let mut desk = Arming::new(folder.path(), &[]);
        let (answer, mut answers) = channel(4);
        desk.ask(Instant::from_nanos(1), Some(0), Requester { page: answer, id: Some(3) });
        let told = answered(&mut answers).unwrap();
        assert!(told["error"].as_str().unwrap().contains("leo emergency-stop --release"), "{told}");
        assert_eq!(arming::take(folder.path()).unwrap(), None);
    }
}

//! The two machines in network namespaces of their own, with a network between them that delays, drops and breaks.

use clock::Duration;
use message::{Health, Histogram, Process};
use rustix::thread::{CpuSet, sched_setaffinity};
use transport::{Delivery, Domain, HealthReader, Node, Queues};

use crate::machine::{Machine, pause, wait_until};
use crate::network::Network;
use crate::wakeful::Wakeful;
use crate::{PERFORMED, Side, alone, keys, link};

/// How long each state of the network is looked at.
const LOOKED_AT: Duration = Duration::from_secs(10);
/// Set on a machine that does nothing else: then the hot path has a core of its own, and quantiles of times are
/// compared too.
const QUIET: &str = "LEO_QUIET_MACHINE";
/// So often the network goes through its states then: medians of the quantiles are compared.
const ROUNDS: usize = 9;
const HOT_CORE: usize = 0;
const OTHER_CORE: usize = 1;
const HOT: [Process; 3] = [Process::Sensor, Process::Belief, Process::Motor];

/// The boards of the hot path's processes.
struct HotPath(Vec<(Process, HealthReader)>);

impl HotPath {
    fn look(&self, what: &str) -> Vec<Did> {
        let read = || self.0.iter().map(|(_, board)| board.read()).collect::<Vec<_>>();
        let before = read();
        pause(LOOKED_AT);
        let both = before.iter().zip(read());
        let did = |((process, _), (before, after)): (&(Process, _), (&Health, Health))| {
            Did::between(*process, before, &after)
        };
        let all: Vec<Did> = self.0.iter().zip(both).map(did).collect();
        all.iter().for_each(|did| did.tell(what));
        all
    }
}

/// What a process did in some time.
struct Did {
    process: Process,
    cycles: u64,
    drops: u64,
    undelivered: u64,
    /// The 99th percentiles of waking up and of working, in microseconds.
    p99_us: [f64; 2],
}

impl Did {
    fn between(process: Process, before: &Health, after: &Health) -> Self {
        // A bucket is up to a sixteenth wide, which is as much as is looked for.
        let p99_us = |after: &Histogram, before| after.since(before).quantile_between_ns(0.99) / 1e3;
        Self {
            process,
            cycles: after.cycles - before.cycles,
            drops: after.drops,
            undelivered: after.undelivered,
            p99_us: [p99_us(&after.wakeup, &before.wakeup), p99_us(&after.execution, &before.execution)],
        }
    }

    /// What is counted where a reader, or the network, held up the hot path. The sensor takes the newest of what
    /// the simulator makes, and the motor the newest of what the learner wants, which come in bursts over a network:
    /// only the belief process drops nothing.
    fn held_up(&self) -> [u64; 2] {
        [if self.process == Process::Belief { self.drops } else { 0 }, self.undelivered]
    }

    #[expect(clippy::print_stdout, reason = "it tells how the hot path fared")]
    fn tell(&self, what: &str) {
        let Self { process, cycles, drops, undelivered, p99_us: [wakeup, execution] } = self;
        println!(
            "{what:<24} {:<8} {cycles:>5} cycles, p99 of wake-up {wakeup:>7.1} us, of execution {execution:>7.1} us; \
             {drops} dropped, {undelivered} undelivered in all",
            process.name(),
        );
    }
}

fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = numbers.collect();
    all.sort_by(f64::total_cmp);
    *all.get(all.len() / 2).expect("one at least")
}

/// By how much each 99th percentile changes: medians of all rounds, in which good times and bad ones follow each
/// other, because the machine itself has better and worse minutes.
fn changes(rounds: &[[Vec<Did>; 4]]) -> Vec<(String, f64)> {
    let mut changes = Vec::new();
    for (index, process) in HOT.into_iter().enumerate() {
        for (quantity, name) in ["wake-up", "execution"].into_iter().enumerate() {
            let p99_us = |look: &Vec<Did>| look.get(index).and_then(|did| did.p99_us.get(quantity)).copied();
            let mut told = |what, pick: fn(&[Vec<Did>; 4]) -> &Vec<Did>| {
                let now = median(rounds.iter().map(pick).filter_map(p99_us));
                let then = median(rounds.iter().map(|[well, ..]| well).filter_map(p99_us));
                let told = format!("{}, {name}, {what}: {now:.1} us after {then:.1} us", process.name());
                changes.push((told, now / then));
            };
            told("200 ms and 5 % lost", |[_, far, ..]| far);
            told("cut", |[.., cut, _]| cut);
            told("well again", |[.., again]| again);
        }
    }
    changes
}

fn is_quiet() -> bool {
    std::env::var_os(QUIET).is_some()
}

/// Where the machine is quiet, and has two cores, the hot path has the first, as on a robot whose cores were
/// planned (`cores` of leo.toml), and all else of both machines and of the network the second: the changes of
/// the robot's configuration.
fn plan_cores() -> Vec<(&'static str, &'static str)> {
    let mut second = CpuSet::new();
    second.set(OTHER_CORE);
    if !is_quiet() || sched_setaffinity(None, &second).is_err() {
        return Vec::new();
    }
    ["sensor.realtime.cores", "belief.realtime.cores", "motor.realtime.cores"].map(|key| (key, "[0]")).into()
}

#[test]
fn the_hot_path_does_not_notice_what_the_network_does() {
    let _alone = alone();
    let plan = plan_cores();
    let Some(mut network) = Network::or_skip("hot") else { return };
    let _wakeful = is_quiet().then(|| Wakeful::on([HOT_CORE, OTHER_CORE]));
    let [a, b] = network.names.clone();
    let keys = keys("IP:10.77.0.1");
    let away = Side::away("tls/10.77.0.1:7447").keyed(keys.path(), "away");
    let mut away = Machine::ready(Some(&b), "ns-away", &away.changes());
    let robot = Side::robot("tls/10.77.0.1:7447").keyed(keys.path(), "robot");
    let mut robot = Machine::ready(Some(&a), "ns-robot", &[robot.changes(), plan].concat());
    assert!(wait_until(|| away.told().contains(PERFORMED)), "{}\n{}", away.told(), away.said());

    let queues = Queues { frames: 4, delivery: Delivery::Newest };
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "observer", 1, queues).expect("joins");
    let board = |process| (process, HealthReader::open(&node, process, 1).expect("it runs"));
    let hot = HotPath(HOT.into_iter().map(board).collect());
    let received = || away.metric("leo_link_received_frames_total");
    let waiting = || robot.metric("leo_joints_in_trouble{cause=\"command-timeout\"}");

    assert!(wait_until(|| waiting() == 0.0), "{:?}", robot.metrics());
    let mut looks = Vec::new();
    for _ in 0..if is_quiet() { ROUNDS } else { 1 } {
        let well = hot.look("as it should be");
        println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));

        network.set("200 0.05");
        let before = received();
        let far = hot.look("200 ms, 5 % lost");
        println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));
        assert!(wait_until(|| received() > before + 50.0), "{}", away.said());

        network.set("cut");
        let cut = hot.look("cut");
        assert!(wait_until(|| away.metric("leo_link_heard") == 0.0 && waiting() > 0.0), "{}", away.said());

        network.set("0 0");
        let before = received();
        assert!(wait_until(|| received() > before + 500.0), "{}\n{}", away.said(), robot.said());
        // The learner commands again, and the joints follow it.
        assert!(wait_until(|| waiting() == 0.0), "{:?}", robot.metrics());
        let again = hot.look("well again");
        println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));

        for later in [&far, &cut, &again] {
            for (now, then) in later.iter().zip(&well) {
                // Nobody on the hot path lost a frame, or could not give one away, because of the link.
                assert_eq!(now.held_up(), then.held_up(), "{}", now.process);
                let (now_cycles, then_cycles) = (now.cycles, then.cycles);
                assert!(
                    now_cycles * 10 >= then_cycles * 9,
                    "{}: {now_cycles} after {then_cycles} cycles",
                    now.process
                );
            }
        }
        looks.push([well, far, cut, again]);
    }
    if is_quiet() {
        let changes = changes(&looks);
        for (told, changed) in &changes {
            println!("p99 of {told}, {changed:.2}");
        }
        assert!(changes.iter().all(|(_, changed)| *changed < 1.1));
    }
    drop((hot, node));
    for machine in [&mut away, &mut robot] {
        let (status, said) = machine.stop();
        assert!(status.success(), "{status}\n{said}");
    }
    assert_eq!(away.learned(), [("task 1".to_owned(), 2)].into());
}

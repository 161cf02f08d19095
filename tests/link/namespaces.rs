//! Two machines in separate network namespaces, with a network that delays, drops and breaks.

use clock::Duration;
use message::{Health, Histogram, Process};
use rustix::thread::{CpuSet, sched_setaffinity};
use transport::{Domain, HealthReader, Node, OverflowPolicy, Queues};

use crate::machine::{Machine, pause, wait_until};
use crate::network::Network;
use crate::wakeful::Wakeful;
use crate::yardstick::Yardstick;
use crate::{PERFORMED, Side, alone, keys_or_skip, link};

/// Length and number of the measured intervals for each network state; more if quantiles are compared.
const STRETCH: Duration = Duration::from_millis(250);
const STRETCHES: usize = 10;
const STRETCHES_COMPARED: usize = 40;
/// Set on an otherwise idle machine, to the number of measurement rounds. The hot path then has its own core,
/// and quantiles are compared too.
const QUIET: &str = "LEO_QUIET_MACHINE";
/// An interval counts if the reference work takes at most this many times its fastest decile.
const CALM: f64 = 1.2;
/// The states of the network, in order.
const STATES: [&str; 4] = ["as it should be", "200 ms, 5 % lost", "cut", "well again"];
const HOT_CORE: usize = 0;
const OTHER_CORE: usize = 1;
const HOT: [Process; 3] = [Process::Sensor, Process::Belief, Process::Motor];

/// The health boards of the hot path's processes, and the meter of the core's speed.
struct HotPath {
    boards: Vec<(Process, HealthReader)>,
    yardstick: Option<Yardstick>,
}

/// Measurements of the hot path in one network state.
struct Look {
    all: Vec<Did>,
    stretches: Vec<Stretch>,
}

/// Measurements of one interval, with the duration of the reference work.
struct Stretch {
    yardstick_us: f64,
    all: Vec<Did>,
}

impl HotPath {
    fn read(&self) -> Vec<Health> {
        self.boards.iter().map(|(_, board)| board.read()).collect()
    }

    fn did(&self, before: &[Health], after: &[Health]) -> Vec<Did> {
        let both = before.iter().zip(after);
        self.boards.iter().zip(both).map(|((process, _), (a, b))| Did::between(*process, a, b)).collect()
    }

    fn look(&self, what: &str) -> Look {
        let first = self.read();
        let mut stretches = Vec::new();
        let mut before = first.clone();
        for _ in 0..if self.yardstick.is_some() { STRETCHES_COMPARED } else { STRETCHES } {
            pause(STRETCH);
            let after = self.read();
            let did = self.did(&before, &after);
            let stretch = |yardstick: &Yardstick| Stretch { yardstick_us: yardstick.max_us(), all: did };
            stretches.extend(self.yardstick.as_ref().map(stretch));
            before = after;
        }
        let all = self.did(&first, &before);
        all.iter().for_each(|did| did.tell(what));
        Look { all, stretches }
    }
}

/// Measurements of one process.
struct Did {
    process: Process,
    cycles: u64,
    drops: u64,
    undelivered: u64,
    /// Histograms of wake-up latency and execution time.
    took: [Histogram; 2],
}

impl Did {
    fn between(process: Process, before: &Health, after: &Health) -> Self {
        let took = [after.wakeup.since(&before.wakeup), after.execution.since(&before.execution)];
        Self {
            process,
            cycles: after.cycles - before.cycles,
            drops: after.drops,
            undelivered: after.undelivered,
            took,
        }
    }

    /// Counters that rise if the hot path is delayed by a reader or the network. Only the belief process must
    /// drop nothing: the sensor and the motor keep only the newest frames, which arrive in bursts over a
    /// network.
    fn held_up(&self) -> [u64; 2] {
        [if self.process == Process::Belief { self.drops } else { 0 }, self.undelivered]
    }

    #[expect(clippy::print_stdout, reason = "it tells how the hot path fared")]
    fn tell(&self, what: &str) {
        let Self { process, cycles, drops, undelivered, took } = self;
        let [wakeup, execution] = took.map(|took| quantile_us(&took, 0.99));
        println!(
            "{what:<24} {:<8} {cycles:>5} cycles, p99 of wake-up {wakeup:>7.1} us, of execution {execution:>7.1} us; \
             {drops} dropped, {undelivered} undelivered in all",
            process.name(),
        );
    }
}

/// A quantile in microseconds. A bucket is up to 1/16 wide, which is the required resolution.
fn quantile_us(took: &Histogram, share: f64) -> f64 {
    took.quantile_between_ns(share) / 1e3
}

/// Relative change of each 99th percentile, reported with the medians. Only intervals in which the core was
/// fast count, because the speed of a virtual core varies independently of the network.
#[expect(clippy::print_stdout, reason = "it tells how many stretches are compared")]
fn changes(rounds: &[[Look; 4]]) -> Vec<(String, f64)> {
    let stretches = |state: usize| {
        rounds.iter().filter_map(move |round| round.get(state)).flat_map(|look| &look.stretches)
    };
    let mut paces: Vec<f64> = (0..4).flat_map(stretches).map(|stretch| stretch.yardstick_us).collect();
    paces.sort_by(f64::total_cmp);
    let fast_us = *paces.get(paces.len() / 10).expect("some stretches");
    let calm = |state| stretches(state).filter(move |stretch| stretch.yardstick_us <= CALM * fast_us);
    for (state, name) in STATES.into_iter().enumerate() {
        println!(
            "{name}: {} of {} stretches of {} ms count, in which the same work took {fast_us:.1} to {:.1} us",
            calm(state).count(),
            stretches(state).count(),
            STRETCH.as_millis(),
            CALM * fast_us
        );
        assert!(
            calm(state).count() * 4 >= stretches(state).count(),
            "{name}: few of them tell nothing of all"
        );
    }
    let mut changes = Vec::new();
    for (index, process) in HOT.into_iter().enumerate() {
        for (quantity, name) in ["wake-up", "execution"].into_iter().enumerate() {
            let took_us = |state| {
                let mut all = Histogram::default();
                let took = |stretch: &Stretch| stretch.all.get(index)?.took.get(quantity).copied();
                calm(state).filter_map(took).for_each(|took| all.add(&took));
                [0.5, 0.99].map(|share| quantile_us(&all, share))
            };
            let [half_then, then] = took_us(0);
            for (state, what) in STATES.into_iter().enumerate().skip(1) {
                let [half, now] = took_us(state);
                let told = format!(
                    "{}, {name}, {what}: p50 {half:.1} us after {half_then:.1}, p99 {now:.1} us after {then:.1}",
                    process.name()
                );
                changes.push((told, now / then));
            }
        }
    }
    changes
}

/// Number of measurement rounds on a quiet machine.
fn quiet_rounds() -> Option<usize> {
    let rounds = std::env::var(QUIET).ok()?;
    Some(rounds.parse().expect("the number of rounds, 28 for one"))
}

/// On a quiet machine with two cores, the hot path gets the first core, as on a robot with planned cores
/// (`cores` of leo.toml). All else runs on the second one. Returns the changes of the robot's configuration.
fn plan_cores() -> Vec<(&'static str, &'static str)> {
    let mut second = CpuSet::new();
    second.set(OTHER_CORE);
    if quiet_rounds().is_none() || sched_setaffinity(None, &second).is_err() {
        return Vec::new();
    }
    ["sensor.realtime.cores", "belief.realtime.cores", "motor.realtime.cores"].map(|key| (key, "[0]")).into()
}

#[test]
fn a_flooded_network_does_not_delay_the_hot_path() {
    let _alone = alone();
    let plan = plan_cores();
    let Some(mut network) = Network::or_skip("hot") else { return };
    let _wakeful = quiet_rounds().map(|_| Wakeful::on([HOT_CORE, OTHER_CORE]));
    let [a, b] = network.names.clone();
    let Some(keys) = keys_or_skip("IP:10.77.0.1") else { return };
    let away = Side::remote("quic/10.77.0.1:7447").keyed(keys.path(), "remote");
    let mut away = Machine::ready(Some(&b), "ns-away", &away.changes());
    let robot = Side::robot("quic/10.77.0.1:7447").keyed(keys.path(), "robot");
    let mut robot = Machine::ready(Some(&a), "ns-robot", &[robot.changes(), plan].concat());
    assert!(wait_until(|| away.stdout().contains(PERFORMED)), "{}\n{}", away.stdout(), away.said());

    let queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "observer", 1, queues).expect("joins");
    let board = |process| (process, HealthReader::open(&node, process, 1).expect("it runs"));
    let hot = HotPath {
        boards: HOT.into_iter().map(board).collect(),
        yardstick: quiet_rounds().map(|_| Yardstick::on(HOT_CORE)),
    };
    let received = || away.metric("leo_link_received_frames_total");
    let waiting = || robot.metric("leo_joints_with_fault{cause=\"command-timeout\"}");

    assert!(wait_until(|| waiting() == 0.0), "{:?}", robot.metrics());
    let mut looks = Vec::new();
    for _ in 0..quiet_rounds().unwrap_or(1) {
        let well = hot.look("as it should be");
        println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));

        network.set("200 0.05");
        let before = received();
        let far = hot.look("200 ms, 5 % lost");
        println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));
        assert!(wait_until(|| received() > before + 50.0), "{}", away.said());

        network.set("cut");
        let cut = hot.look("cut");
        assert!(wait_until(|| away.metric("leo_link_up") == 0.0 && waiting() > 0.0), "{}", away.said());

        network.set("0 0");
        let before = received();
        assert!(wait_until(|| received() > before + 500.0), "{}\n{}", away.said(), robot.said());
        // The learner sends goals again, and the joints follow.
        assert!(wait_until(|| waiting() == 0.0), "{:?}", robot.metrics());
        let again = hot.look("well again");
        println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));

        for later in [&far, &cut, &again] {
            for (now, then) in later.all.iter().zip(&well.all) {
                // The link caused no lost or undelivered frame on the hot path.
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
    if quiet_rounds().is_some() {
        let changes = changes(&looks);
        for (told, changed) in &changes {
            println!("{told}, {changed:.2}");
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

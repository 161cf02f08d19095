//! The two machines in network namespaces of their own, with a network between them that delays, drops and breaks.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use clock::Duration;
use message::{Health, Histogram, Process};
use rustix::thread::{CpuSet, sched_setaffinity};
use transport::{Delivery, Domain, HealthReader, Node, Queues};

use crate::machine::{Machine, pause, wait_until};
use crate::{PERFORMED, Side, keys, link};

/// How long each state of the network is looked at.
const LOOKED_AT: Duration = Duration::from_secs(10);
/// Set on a machine that does nothing else: then each of the two has cores of its own, and quantiles of times are
/// compared too.
const QUIET: &str = "LEO_QUIET_MACHINE";
/// So often it is looked then: the median of the quantiles is compared.
const LOOKS: usize = 7;
const HOT: [Process; 3] = [Process::Sensor, Process::Belief, Process::Motor];

/// Two namespaces and what connects them; gone when dropped.
struct Network {
    between: Child,
    names: [String; 2],
}

impl Network {
    /// `Err` says why there can be none here.
    fn make() -> Result<Self, String> {
        let names = ["a", "b"].map(|end| format!("leo-{end}-{}", std::process::id()));
        if !Path::new("/dev/net/tun").exists() {
            return Err("there is no /dev/net/tun".to_owned());
        }
        for name in &names {
            let made = Command::new("ip").args(["netns", "add", name]).output();
            let made = made.map_err(|error| format!("cannot run `ip`: {error}"))?;
            if !made.status.success() {
                return Err(format!("`ip netns add` says {}", String::from_utf8_lossy(&made.stderr)));
            }
        }
        let [a, b] = &names;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/link/network.py");
        let between = Command::new("python3")
            .arg(script)
            .args([a, "10.77.0.1", b, "10.77.0.2"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("cannot run `python3`: {error}"))?;
        let mut network = Self { between, names };
        if network.answer() == "ready" { Ok(network) } else { Err("no TUN device can be made".to_owned()) }
    }

    fn answer(&mut self) -> String {
        // Byte by byte would do: it says a word now and then.
        let mut word = String::new();
        let out = self.between.stdout.as_mut().expect("piped");
        let _end = BufReader::with_capacity(1, out).read_line(&mut word);
        word.trim().to_owned()
    }

    /// From now on, packets fare so.
    fn set(&mut self, words: &str) {
        // In one piece, which is what the script takes for a line.
        let line = format!("{words}\n");
        self.between.stdin.as_mut().expect("piped").write_all(line.as_bytes()).expect("it lives");
        assert_eq!(self.answer(), "so");
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let _dead = self.between.kill().and_then(|()| self.between.wait());
        for name in &self.names {
            let _gone = Command::new("ip").args(["netns", "del", name]).status();
        }
    }
}

/// The boards of the hot path's processes.
struct HotPath(Vec<(Process, HealthReader)>);

impl HotPath {
    fn look(&self) -> Vec<Did> {
        let read = || self.0.iter().map(|(_, board)| board.read()).collect::<Vec<_>>();
        let mut looks = vec![read()];
        for _ in 0..if is_quiet() { LOOKS } else { 1 } {
            pause(LOOKED_AT);
            looks.push(read());
        }
        let did = |(index, (process, _)): (usize, &(Process, _))| {
            let looks: Vec<&Health> = looks.iter().filter_map(|boards| boards.get(index)).collect();
            Did::between(*process, &looks)
        };
        self.0.iter().enumerate().map(did).collect()
    }
}

/// What a process did in some time.
struct Did {
    process: Process,
    cycles: u64,
    drops: u64,
    undelivered: u64,
    /// The 99th percentiles of waking up and of working, in microseconds; of several looks their medians.
    p99_us: [f64; 2],
}

impl Did {
    fn between(process: Process, looks: &[&Health]) -> Self {
        let (first, last) = (looks.first().expect("one before"), looks.last().expect("one after"));
        let median = |of: fn(&Health) -> &Histogram| {
            let p99_us = |pair: &[&Health]| {
                let [before, after] = pair else { unreachable!("two") };
                Duration::from_nanos(of(after).since(of(before)).quantile_ns(0.99)).as_secs_f64() * 1e6
            };
            let mut all: Vec<f64> = looks.windows(2).map(p99_us).collect();
            all.sort_by(f64::total_cmp);
            *all.get(all.len() / 2).expect("one at least")
        };
        Self {
            process,
            cycles: last.cycles - first.cycles,
            drops: last.drops,
            undelivered: last.undelivered,
            p99_us: [median(|health| &health.wakeup), median(|health| &health.execution)],
        }
    }

    /// What is counted where a reader, or the network, held up the hot path. The sensor takes the newest of what
    /// the simulator makes, and the motor the newest of what the learner wants, which come in bursts over a network:
    /// only the belief process drops nothing.
    fn held_up(&self) -> [u64; 2] {
        [if self.process == Process::Belief { self.drops } else { 0 }, self.undelivered]
    }
}

fn tell(what: &str, all: &[Did]) {
    for Did { process, cycles, drops, undelivered, p99_us: [wakeup, execution] } in all {
        println!(
            "{what:<24} {:<8} {cycles:>5} cycles, p99 of wake-up {wakeup:>7.1} us, of execution {execution:>7.1} us; \
             {drops} dropped, {undelivered} undelivered in all",
            process.name(),
        );
    }
}

fn is_quiet() -> bool {
    std::env::var_os(QUIET).is_some()
}

/// What this thread starts from now on has a core of its own where the machine is quiet, and has so many.
fn on_core(core: usize) {
    if is_quiet() {
        let mut set = CpuSet::new();
        set.set(core);
        let _shared_on_a_machine_with_one = sched_setaffinity(None, &set);
    }
}

#[test]
fn the_hot_path_does_not_notice_what_the_network_does() {
    on_core(1);
    let mut network = match Network::make() {
        Ok(network) => network,
        Err(why) => {
            println!(
                "skipped: two network namespaces with a network between them cannot be made here: {why}"
            );
            return;
        }
    };
    let [a, b] = network.names.clone();
    let keys = keys("IP:10.77.0.1");
    let away = Side::away("tls/10.77.0.1:7447").keyed(keys.path(), "away");
    let mut away = Machine::ready(Some(&b), "ns-away", &away.changes());
    let robot = Side::robot("tls/10.77.0.1:7447").keyed(keys.path(), "robot");
    on_core(0);
    let mut robot = Machine::ready(Some(&a), "ns-robot", &robot.changes());
    on_core(1);
    assert!(wait_until(|| away.told().contains(PERFORMED)), "{}\n{}", away.told(), away.said());

    let queues = Queues { frames: 4, delivery: Delivery::Newest };
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "observer", 1, queues).expect("joins");
    let board = |process| (process, HealthReader::open(&node, process, 1).expect("it runs"));
    let hot = HotPath(HOT.into_iter().map(board).collect());
    let received = || away.metric("leo_link_received_frames_total");
    let waiting = || robot.metric("leo_joints_in_trouble{cause=\"command-timeout\"}");

    assert!(wait_until(|| waiting() == 0.0), "{:?}", robot.metrics());
    let well = hot.look();
    tell("as it should be", &well);
    println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));

    network.set("200 0.05");
    let before = received();
    let far = hot.look();
    tell("200 ms, 5 % lost", &far);
    println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));
    assert!(wait_until(|| received() > before + 50.0), "{}", away.said());

    network.set("cut");
    let cut = hot.look();
    tell("cut", &cut);
    assert!(wait_until(|| away.metric("leo_link_heard") == 0.0 && waiting() > 0.0), "{}", away.said());

    network.set("0 0");
    let before = received();
    assert!(wait_until(|| received() > before + 500.0), "{}\n{}", away.said(), robot.said());
    // The learner commands again, and the joints follow it.
    assert!(wait_until(|| waiting() == 0.0), "{:?}", robot.metrics());
    let again = hot.look();
    tell("well again", &again);
    println!("away: {}\nrobot: {}", link(&away.metrics()), link(&robot.metrics()));

    for all in [&far, &cut, &again] {
        for (now, then) in all.iter().zip(&well) {
            // Nobody on the hot path lost a frame, or could not give one away, because of the link.
            assert_eq!(now.held_up(), then.held_up(), "{}", now.process);
            let (now_cycles, then_cycles) = (now.cycles, then.cycles);
            assert!(now_cycles * 10 >= then_cycles * 9, "{}: {now_cycles} after {then_cycles}", now.process);
            if is_quiet() {
                for (now_us, then_us) in now.p99_us.into_iter().zip(then.p99_us) {
                    assert!(now_us < then_us * 1.1, "{}: {now_us} us after {then_us} us", now.process);
                }
            }
        }
    }
    drop((hot, node));
    for machine in [&mut away, &mut robot] {
        let (status, said) = machine.stop();
        assert!(status.success(), "{status}\n{said}");
    }
    assert!(away.learned().contains("task 1"), "{}", away.learned());
}

//! The two machines in network namespaces of their own, with a network between them that delays, drops and breaks.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use clock::Duration;
use message::{Health, Process};
use transport::{Delivery, Domain, HealthReader, Node, Queues};

use crate::machine::{Machine, pause, wait_until};
use crate::{PERFORMED, Side, keys, link};

/// How long each state of the network is looked at.
const LOOKED_AT: Duration = Duration::from_secs(10);
/// Set on a machine that does nothing else: then quantiles of times are compared too.
const QUIET: &str = "LEO_QUIET_MACHINE";
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

/// What each process counted in some time.
type Counted = Vec<(Process, Health, Health)>;

impl HotPath {
    fn read(&self) -> Vec<Health> {
        self.0.iter().map(|(_, board)| board.read()).collect()
    }

    fn look(&self) -> Counted {
        let before = self.read();
        pause(LOOKED_AT);
        let both = before.into_iter().zip(self.read());
        self.0.iter().zip(both).map(|((process, _), (before, after))| (*process, before, after)).collect()
    }
}

/// The 99th percentiles of what a process did in some time, in microseconds: waking up, working.
fn p99_us((_, before, after): &(Process, Health, Health)) -> [f64; 2] {
    let of = |after: &message::Histogram, before| {
        Duration::from_nanos(after.since(before).quantile_ns(0.99)).as_secs_f64() * 1e6
    };
    [of(&after.wakeup, &before.wakeup), of(&after.execution, &before.execution)]
}

fn cycles((_, before, after): &(Process, Health, Health)) -> u64 {
    after.cycles - before.cycles
}

/// What is counted where a reader, or the network, held up the hot path. The sensor takes the newest of what
/// the simulator makes, and the motor the newest of what the learner wants, which come in bursts over a network:
/// only the belief process drops nothing.
fn held_up((process, _, health): &(Process, Health, Health)) -> [u64; 2] {
    [if *process == Process::Belief { health.drops } else { 0 }, health.undelivered]
}

fn tell(what: &str, counted: &Counted) {
    for each in counted {
        let ([wakeup, execution], health) = (p99_us(each), &each.2);
        let (drops, undelivered) = (health.drops, health.undelivered);
        println!(
            "{what:<24} {:<8} {:>5} cycles, p99 of wake-up {wakeup:>7.1} us, of execution {execution:>7.1} us; \
             {drops} dropped, {undelivered} undelivered in all",
            each.0.name(),
            cycles(each)
        );
    }
}

#[test]
fn the_hot_path_does_not_notice_what_the_network_does() {
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
    let mut robot = Machine::ready(Some(&a), "ns-robot", &robot.changes());
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

    for counted in [&far, &cut, &again] {
        for (now, then) in counted.iter().zip(&well) {
            // Nobody on the hot path lost a frame, or could not give one away, because of the link.
            assert_eq!(held_up(now), held_up(then), "{}", now.0);
            let (now_cycles, then_cycles) = (cycles(now), cycles(then));
            assert!(now_cycles * 10 >= then_cycles * 9, "{}: {now_cycles} after {then_cycles} cycles", now.0);
            if std::env::var_os(QUIET).is_some() {
                for (now_us, then_us) in p99_us(now).into_iter().zip(p99_us(then)) {
                    assert!(now_us < then_us * 1.1, "{}: {now_us} us after {then_us} us", now.0);
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

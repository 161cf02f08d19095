//! Flood of connection attempts: no work for unvalidated addresses, and bounded memory.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use clock::Duration;
use rustix::process::Pid;
use serde_json::Value;

use crate::machine::{Machine, pause, wait_until};
use crate::peer::{Peer, TO_ROBOT, number, word};
use crate::{Side, alone, free_port, keys_or_skip};

/// Maximum memory growth of the link process in kB: by first packets, and by handshakes.
const MAX_GROWTH_BY_PACKETS_KB: u64 = 16 * 1024;
const MAX_GROWTH_KB: u64 = 32 * 1024;
/// Connections of one address whose certificate is not verified, and all connections (services/link/src/slots.rs).
const MAX_PER_ADDRESS: u64 = 32;
const MAX_CONNECTIONS: u64 = 256;

/// A listening robot, and a peer that floods it.
struct Flooded {
    robot: Machine,
    peer: Peer,
    keys: tempfile::TempDir,
    port: String,
}

impl Flooded {
    fn or_skip(name: &str) -> Option<Self> {
        let (keys, peer) = (keys_or_skip("DNS:localhost")?, Peer::or_skip()?);
        let port = free_port();
        let robot = Side::robot(&format!("quic/127.0.0.1:{port}")).keyed(keys.path(), "robot");
        let robot = Machine::ready(None, name, &robot.with("remote_processes", "[]").changes());
        Some(Self { robot, peer, keys, port: port.to_string() })
    }

    fn link(&self) -> Pid {
        self.robot.process("link").expect("it lives")
    }

    /// Resident memory of the link process, in kB.
    fn memory_kb(&self) -> u64 {
        let file = format!("/proc/{}/status", self.link().as_raw_nonzero());
        let status = std::fs::read_to_string(file).expect("it lives");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("it is told");
        line.trim().trim_end_matches(" kB").parse().expect("a number")
    }

    fn run(&self, command: &str, words: &[&str]) -> Vec<Value> {
        let folder = self.keys.path().to_str().expect("a name");
        self.peer.run(&[&[command, &self.port, TO_ROBOT, folder], words].concat())
    }

    /// Checks that the remote machine, with the right certificate, is accepted.
    fn assert_lets_in(&self, when: &str) {
        let came = self.run("connect", &["remote"]);
        let how = came.first().map(|line| word(line, "came"));
        assert_eq!(how, Some("talked to"), "{when}: {came:?}\n{}", self.robot.said());
    }

    /// Runs a flood; returns its report and the link's peak memory meanwhile, in kB.
    fn flood(&self, command: &str, words: &[&str], meanwhile: impl Fn()) -> (Value, u64) {
        let folder = self.keys.path().to_str().expect("a name");
        let mut flood = self.peer.start(&[&[command, &self.port, TO_ROBOT, folder], words].concat());
        assert!(flood.line().is_some(), "it begins");
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            let max = scope.spawn(|| {
                let mut max = 0;
                while !is_over.load(Ordering::Relaxed) {
                    max = max.max(self.memory_kb());
                    pause(Duration::from_millis(10));
                }
                max
            });
            meanwhile();
            let told = flood.rest().pop();
            is_over.store(true, Ordering::Relaxed);
            (told.expect("its counts"), max.join().expect("it ends"))
        })
    }
}

#[test]
fn an_unproven_address_gets_fewer_bytes_than_it_sends() {
    let _alone = alone();
    let Some(flooded) = Flooded::or_skip("link-initials") else { return };
    let link = flooded.link();
    flooded.assert_lets_in("before");
    let before = flooded.memory_kb();
    let (told, during) = flooded.flood("initials", &["3000", "6"], || flooded.assert_lets_in("meanwhile"));
    let after = flooded.memory_kb();
    println!("{told}; memory: {before} kB before, {during} kB at most, {after} kB after");
    let count = |key| number(&told, key).expect("a count");
    assert!(
        count("answers") > 0 && count("retries") == count("answers"),
        "each answer asks for a proof: {told}"
    );
    assert!(count("answered_bytes") * 3 < count("sent_bytes"), "{told}");
    assert!(
        during.saturating_sub(before) < MAX_GROWTH_BY_PACKETS_KB,
        "{before} kB before, {during} kB during"
    );
    flooded.assert_lets_in("after");
    assert_eq!(flooded.link(), link, "it lives on");
}

#[test]
fn connections_without_a_certificate_are_bounded_and_released() {
    let _alone = alone();
    let Some(flooded) = Flooded::or_skip("link-stalled") else { return };
    let link = flooded.link();
    flooded.assert_lets_in("before");
    let before = flooded.memory_kb();
    for (addresses, each) in [("1", "200"), ("60", "20")] {
        let (told, during) = flooded.flood("stall", &[addresses, each], || ());
        println!("{addresses} addresses: {told}; memory: {before} kB before, {during} kB at most");
        let count = |key| number(&told, key).expect("a count");
        let seconds = quantity::number::floor_i64(told["seconds"].as_f64().expect("a time")).cast_unsigned();
        // A slot is freed one second after its handshake ended. Half of all slots are for connections that close.
        let max_of_address = MAX_PER_ADDRESS * (1 + seconds);
        let max = MAX_CONNECTIONS + MAX_CONNECTIONS / 2 * (1 + seconds);
        let addresses: u64 = addresses.parse().expect("a number");
        assert!(count("answered") > 0 && count("answered") <= max.min(addresses * max_of_address), "{told}");
        assert!(during.saturating_sub(before) < MAX_GROWTH_KB, "{before} kB before, {during} kB during");
        // One address has used all its slots; the remote machine has another address.
        if addresses == 1 {
            flooded.assert_lets_in("while an address has no slot left");
        }
    }
    // Its slots are freed in the end.
    let is_answered = || number(&flooded.flood("stall", &["1", "1"], || ()).0, "answered") == Some(1);
    assert!(wait_until(is_answered), "{}", flooded.robot.said());
    let after = flooded.memory_kb();
    println!("memory: {after} kB after");
    assert!(after.saturating_sub(before) < MAX_GROWTH_KB, "{before} kB before, {after} kB after");
    flooded.assert_lets_in("after");
    assert_eq!(flooded.link(), link, "it lives on");
}

#[test]
fn the_other_machine_connects_during_a_flood_from_its_own_address() {
    let _alone = alone();
    let Some(flooded) = Flooded::or_skip("link-beside") else { return };
    let folder = flooded.keys.path().to_str().expect("a name");
    let mut flood =
        flooded.peer.start(&["stall", &flooded.port, TO_ROBOT, folder, "1", "1500", "127.0.0.1", "50"]);
    assert!(flood.line().is_some(), "it begins");
    // More often than by chance.
    let (mut tries, mut let_in) = (0, 0);
    while let_in < 5 && flood.is_running() {
        tries += 1;
        let came = flooded.run("connect", &["remote"]);
        let_in += u32::from(came.first().is_some_and(|line| word(line, "came") == "talked to"));
    }
    println!("let in {let_in} times in {tries} tries");
    assert_eq!((let_in, flood.is_running()), (5, true), "{}", flooded.robot.said());
}

#[test]
fn the_other_machine_connects_during_a_flood_from_hundreds_of_addresses() {
    let _alone = alone();
    let Some(flooded) = Flooded::or_skip("link-crowd") else { return };
    let link = flooded.link();
    // The address of an accepted certificate has slots of its own from now on.
    flooded.assert_lets_in("before");
    let folder = flooded.keys.path().to_str().expect("a name");
    let full = MAX_CONNECTIONS.to_string();
    let words = ["crowd", &flooded.port, TO_ROBOT, folder, "300", "100", "60", &full];
    let mut flood = flooded.peer.start(&words);
    // It has begun once it was given all the slots there are.
    let begun = flood.line().expect("it begins");
    assert_eq!(begun["begins"], true, "{begun}");
    for _try in 0..8 {
        flooded.assert_lets_in("meanwhile");
    }
    assert!(flood.is_running(), "the tries outlast the flood");
    drop(flood);
    assert_eq!(flooded.link(), link, "it lives on");
}

use std::fs;

use crossbeam::channel::{Receiver, bounded};
use serde_json::Value;
use tokio::sync::mpsc::{self, Receiver as Answers};

use super::*;

/// Time-out of these tests, generous for a loaded machine.
const LONG: Duration = Duration::from_secs(60);
const NOW: Instant = Instant::EPOCH;

/// A mock disk: each message completes one operation.
type Disk = crossbeam::channel::Sender<Result<(), String>>;

/// A recording on the mock disk.
struct Slow(Receiver<Result<(), String>>);

impl Recording for Slow {
    fn has_ended(&self) -> bool {
        false
    }

    fn dropped(&self) -> u64 {
        3
    }

    fn stop(self: Box<Self>) -> Result<u64, String> {
        self.0.recv().unwrap().map(|()| 7)
    }
}

/// A tape on a mock disk that buffers two results.
fn tape(folder: &Path) -> (Tape, Disk) {
    let (disk, told) = bounded::<Result<(), String>>(2);
    let start = move |output: &Output| {
        told.recv().unwrap()?;
        output.create().unwrap();
        Ok(Box::new(Slow(told.clone())) as Box<dyn Recording>)
    };
    (Tape::with(Some(folder.join("recordings")), Arc::new(start)), disk)
}

fn asked(tape: &mut Tape, on: bool) -> Answers<String> {
    let (answer, answers) = mpsc::channel(1);
    tape.ask(on, Requester { page: answer, id: Some(1) });
    answers
}

/// Steps the tape until the answer has arrived.
fn answered(tape: &mut Tape, answers: &mut Answers<String>) -> Value {
    let end = clock::now() + LONG;
    loop {
        tape.step(NOW);
        if let Ok(answer) = answers.try_recv() {
            return serde_json::from_str(&answer).unwrap();
        }
        assert!(clock::now() < end, "no answer");
    }
}

fn is_on(tape: &Tape) -> bool {
    let mut state_store = StateStore::default();
    tape.show(NOW, &mut state_store);
    state_store.since(0).unwrap().contains("\"on\":true")
}

#[test]
fn only_the_requester_waits_for_the_disk() {
    let folder = tempfile::tempdir().unwrap();
    let (mut tape, disk) = tape(folder.path());
    let [mut begun, mut joined, mut ended] = [true, true, false].map(|on| asked(&mut tape, on));
    // The disk is blocked: the loop continues.
    assert!(tape.step(NOW));
    assert!(!tape.step(NOW) && !is_on(&tape));
    assert!(begun.try_recv().is_err());
    disk.send(Ok(())).unwrap();
    let file = folder.path().join("recordings/recording_1.mcap").display().to_string();
    assert_eq!(answered(&mut tape, &mut begun)["file"], file);
    // Two start requests share one recording.
    assert_eq!(answered(&mut tape, &mut joined)["file"], file);
    // The recording ends only after all data is written.
    tape.step(NOW);
    assert!(ended.try_recv().is_err() && !is_on(&tape));
    disk.send(Ok(())).unwrap();
    assert_eq!(answered(&mut tape, &mut ended)["file"], file);
    assert_eq!(tape.last.as_ref().map(|(_, dropped)| *dropped), Some(7));
    assert_eq!(answered_none(&mut tape), Value::Null);
}

/// The answer to a stop request without a recording.
fn answered_none(tape: &mut Tape) -> Value {
    let mut answers = asked(tape, false);
    answered(tape, &mut answers)["file"].clone()
}

#[test]
fn a_recording_that_cannot_start_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let (mut tape, disk) = tape(folder.path());
    let mut answers = asked(&mut tape, true);
    disk.send(Err("no space left on device".to_owned())).unwrap();
    assert_eq!(answered(&mut tape, &mut answers)["error"], "no space left on device");
    assert_eq!(fs::read_dir(folder.path().join("recordings")).unwrap().count(), 0);
    // The next request is tried nevertheless.
    let mut answers = asked(&mut tape, true);
    disk.send(Ok(())).unwrap();
    assert_eq!(answered(&mut tape, &mut answers)["ok"], true);
    assert!(is_on(&tape));
    disk.send(Err("the disk is gone".to_owned())).unwrap();
    assert_eq!(tape.finish(), Err("the disk is gone".to_owned()));
}

#[test]
fn repeated_requests_during_a_disk_stall_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (mut tape, disk) = tape(folder.path());
    let _first = asked(&mut tape, true);
    tape.step(NOW);
    let waiting: Vec<_> = (0..MAX_WAITING).map(|_| asked(&mut tape, true)).collect();
    let told: Value = serde_json::from_str(&asked(&mut tape, true).try_recv().unwrap()).unwrap();
    insta::assert_snapshot!(told["error"].as_str().unwrap());
    drop((waiting, disk));
}

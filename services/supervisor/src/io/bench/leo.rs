//! Measures Leo's own processes at the reader of the beliefs.

use std::time::Duration;

use message::{BeliefHead, Beliefs, Health, Histogram, Hop, Percepts, Process, ProcessState};
use process::Launch;
use quantity::number::float_of_count;
use transport::{Domain, FrameSubscriber, HealthReader, Node};

use super::{BenchError, Case, PerceptFrame, bare};
use crate::{Children, RosterPublisher};

/// The processes from an observation to a belief, in start order.
const PROCESSES: [Process; 3] = [Process::Belief, Process::Sensor, Process::Simulator];
/// Timeout until they are ready.
const READY_WITHIN: Duration = Duration::from_secs(10);
/// The perspective whose buffer is published last.
const LAST_PERSPECTIVE: u32 = 1;
/// Frames before the measurement starts, to warm up caches, page tables and connections.
const WARM_UP_FRAMES: u64 = 100;

/// Number of percept frames that are kept for the loop.
const KEPT_FRAMES: usize = 600;

/// The measurements of one case.
#[derive(Default)]
pub(super) struct Measured {
    /// From percept buffer published to belief buffers read.
    pub(super) latency: Histogram,
    /// Duration of the belief process's step, publishing included.
    pub(super) step: Histogram,
    /// Wake-up latency of the sensor process.
    pub(super) sensor_wakeup: Histogram,
    /// Wake-up latency of a bare thread at the same time.
    pub(super) bare_wakeup: Histogram,
    /// Number of lost belief frames.
    pub(super) lost: u64,
    /// The percept frames before the measurement, in order.
    pub(super) frames: Vec<PerceptFrame>,
}

/// Runs simulator, sensor and belief at the case's rate and size, and reads the beliefs.
pub(super) fn percept_to_belief(domain: &Domain, node: &Node, case: Case) -> Result<Measured, BenchError> {
    let folder = std::env::temp_dir().join(format!(
        "leo-bench-{}-{}-{}",
        std::process::id(),
        case.rate_hz,
        case.objects
    ));
    std::fs::create_dir_all(&folder)?;
    let file = folder.join("leo.toml");
    let rate = f64::from(case.rate_hz);
    let text = config::Robot::leo_text_with(&[
        ("buffers.max_objects", float_of_count(case.capacity())),
        ("sensor.rate_hz", rate),
        ("simulator.rate_hz", rate),
    ]);
    std::fs::write(&file, text)?;
    let roster = RosterPublisher::publish_members(node, &PROCESSES).map_err(BenchError::port)?;
    let mut children = Children::new().map_err(crate::RunError::Executable)?.with_roster(roster);
    // Unique per incarnation of each process, because the board names of one domain contain it.
    let incarnation = u64::from(case.rate_hz) * 100_000 + u64::from(case.objects);
    let mut beliefs = node.waking_subscriber::<Beliefs>(Some(LAST_PERSPECTIVE)).map_err(BenchError::port)?;
    let measured = (|| {
        for process in PROCESSES {
            let launch = Launch {
                domain: domain.root().to_owned(),
                incarnation,
                parent: i32::try_from(std::process::id()).ok(),
                config: Some(file.clone()),
                synthetic: Some(case.objects),
                partners: Some(1),
                stay: true,
                ..Launch::default()
            };
            children.start(process, &launch)?;
            await_running(node, process, incarnation)?;
        }
        let frames = keep_frames(node)?;
        read(&mut beliefs, node, case, incarnation).map(|measured| Measured { frames, ..measured })
    })();
    for process in PROCESSES {
        children.terminate(process);
    }
    let give_up = clock::now() + READY_WITHIN;
    let mut look = clock::now();
    while !children.is_empty() && clock::now() < give_up {
        children.reap();
        look += Duration::from_millis(5);
        clock::sleep_until(look);
    }
    drop(children);
    drop(beliefs);
    node.clean_up_dead();
    std::fs::remove_dir_all(&folder)?;
    measured
}

/// Copies the next percept frames.
fn keep_frames(node: &Node) -> Result<Vec<PerceptFrame>, BenchError> {
    let mut percepts = node.waking_subscriber::<Percepts>(None).map_err(BenchError::port)?;
    let mut frames = Vec::with_capacity(KEPT_FRAMES);
    let give_up = clock::now() + READY_WITHIN;
    while frames.len() < KEPT_FRAMES {
        percepts.wait(Duration::from_millis(100)).map_err(BenchError::port)?;
        while let Some(frame) = percepts.receive().map_err(BenchError::port)? {
            frames.push(PerceptFrame { head: *frame.head(), entries: frame.entries().to_vec() });
        }
        if clock::now() > give_up {
            return Err(BenchError::NotReady(Process::Sensor.name()));
        }
    }
    Ok(frames)
}

fn await_running(node: &Node, process: Process, incarnation: u64) -> Result<(), BenchError> {
    let give_up = clock::now() + READY_WITHIN;
    let mut look = clock::now();
    loop {
        let health = health(node, process, incarnation);
        if health.and_then(|health| health.state()) == Some(ProcessState::Running) {
            return Ok(());
        }
        if clock::now() > give_up {
            return Err(BenchError::NotReady(process.name()));
        }
        look += Duration::from_millis(5);
        clock::sleep_until(look);
    }
}

fn health(node: &Node, process: Process, incarnation: u64) -> Option<Health> {
    HealthReader::open(node, process, incarnation).ok().map(|board| board.read())
}

fn read(
    beliefs: &mut FrameSubscriber<Beliefs>,
    node: &Node,
    case: Case,
    incarnation: u64,
) -> Result<Measured, BenchError> {
    let mut measured = Measured::default();
    let mut before = None;
    let mut bare = None;
    let give_up = clock::now() + READY_WITHIN;
    let mut end = give_up + case.lasting;
    let mut frames = 0;
    while clock::now() < end {
        beliefs.wait(Duration::from_millis(100)).map_err(BenchError::port)?;
        while let Some(frame) = beliefs.receive().map_err(BenchError::port)? {
            let now = clock::now().as_nanos();
            frames += 1;
            if frames == WARM_UP_FRAMES {
                before = health(node, Process::Sensor, incarnation);
                bare = Some(bare::wakeups(case)?);
                measured.lost = beliefs.drops();
                end = clock::now() + case.lasting;
            } else if frames > WARM_UP_FRAMES {
                note(&mut measured, frame.head(), now);
            }
        }
        if frames == 0 && clock::now() > give_up {
            return Err(BenchError::NotReady(Process::Belief.name()));
        }
    }
    measured.lost = beliefs.drops() - measured.lost;
    if let (Some(before), Some(after)) = (before, health(node, Process::Sensor, incarnation)) {
        measured.sensor_wakeup = after.wakeup.since(&before.wakeup);
    }
    // A thread that panicked has no measurements; the report shows that.
    measured.bare_wakeup = bare.and_then(|thread| thread.join().ok()).unwrap_or_default();
    Ok(measured)
}

fn note(measured: &mut Measured, head: &BeliefHead, now_ns: u64) {
    let header = &head.header;
    if let (Some(perceived), Some(started), Some(believed)) =
        (header.hop_time(Hop::Perceived), header.hop_time(Hop::BeliefStarted), header.hop_time(Hop::Believed))
    {
        measured.latency.record(now_ns.saturating_sub(perceived));
        measured.step.record(believed.saturating_sub(started));
    }
}

//! Measures the speed of a core by reference work.

use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{JoinHandle, spawn};

use clock::Duration;
use rustix::thread::{CpuSet, sched_setaffinity};

use crate::machine::pause;

/// Pause between two measurements.
const PAUSE: Duration = Duration::from_millis(10);
/// Iterations of a measurement: some tens of microseconds.
const COUNT: u64 = 40_000;

/// Repeats the same count on a core as an ordinary thread, which the hot path preempts; ends on drop. A
/// virtual core is at times half as fast for seconds or minutes. Measurements of such times show the host.
pub(crate) struct Yardstick {
    ends: Arc<AtomicBool>,
    measures: Receiver<Duration>,
    thread: Option<JoinHandle<()>>,
}

impl Yardstick {
    pub(crate) fn on(core: usize) -> Self {
        let ends = Arc::new(AtomicBool::new(false));
        let (sender, measures) = channel();
        let is_ended = Arc::clone(&ends);
        let measure = move || {
            let mut cores = CpuSet::new();
            cores.set(core);
            sched_setaffinity(None, &cores).expect("the core is there");
            while !is_ended.load(Ordering::Relaxed) {
                let started = clock::now();
                for number in 0..COUNT {
                    black_box(number);
                }
                // The receiver may be gone.
                let _taken = sender.send(clock::now().since(started));
                pause(PAUSE);
            }
        };
        Self { ends, measures, thread: Some(spawn(measure)) }
    }

    /// The 80th percentile of the measurements since the last call, in microseconds. The hot path preempts
    /// fewer than one in five; a slower core affects all.
    pub(crate) fn max_us(&self) -> f64 {
        let mut all: Vec<_> = self.measures.try_iter().collect();
        all.sort();
        all.get(all.len() * 4 / 5).map_or(f64::NAN, |took| took.as_secs_f64() * 1e6)
    }
}

impl Drop for Yardstick {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}

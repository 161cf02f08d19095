//! What the same work takes, time after time.

use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{JoinHandle, spawn};

use clock::Duration;
use rustix::thread::{CpuSet, sched_setaffinity};

use crate::machine::pause;

/// Between two measures.
const PAUSE: Duration = Duration::from_millis(10);
/// So often it counts for one: some tens of microseconds.
const COUNT: u64 = 40_000;

/// Counts to the same number on a core again and again, as an ordinary thread that whatever is on the hot path
/// preempts; ends when dropped. A virtual core is at times a half slower than at others, for seconds or minutes:
/// what was measured then is of the host.
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
                // Nobody takes the last.
                let _taken = sender.send(clock::now().since(started));
                pause(PAUSE);
            }
        };
        Self { ends, measures, thread: Some(spawn(measure)) }
    }

    /// What four in five took at most since it was last asked, in microseconds. What is on the hot path preempts fewer
    /// of them; and where the core became slower meanwhile, it is seen.
    pub(crate) fn most_us(&self) -> f64 {
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

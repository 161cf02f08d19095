use std::collections::VecDeque;
use std::thread::JoinHandle;

use clock::Duration;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, unbounded};

use crate::Kept;

/// What became of an example.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome<E> {
    /// It is durable.
    Durable(Kept),
    /// It is not, and is tried again.
    Owed(Kept, E),
    /// It was owed, and is durable now.
    AtLast(Kept),
}

/// A thread that makes examples durable, one after the other, so that a slow disk holds up nothing
/// else, and a full one loses nothing as long as the process lives: what could not be kept is tried
/// again, and nothing is kept before it. Dropping it waits until all of them are, or cannot be.
#[derive(Debug)]
pub(crate) struct Keeper<E> {
    to: Option<Sender<Kept>>,
    from: Receiver<Outcome<E>>,
    thread: Option<JoinHandle<()>>,
    under_way: usize,
}

/// The thread ended, which it does only if it panicked: nothing more is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the thread that makes what was learned durable ended")]
pub(crate) struct Ended;

impl<E: Send + 'static> Keeper<E> {
    /// Starts the thread; `keep` makes one example durable, and is asked `again` after so long where it
    /// could not.
    ///
    /// # Errors
    /// The system has no thread left.
    pub(crate) fn start(
        mut keep: impl FnMut(&Kept) -> Result<(), E> + Send + 'static,
        again: Duration,
    ) -> std::io::Result<Self> {
        let (to, orders) = unbounded::<Kept>();
        let (done, from) = unbounded();
        let work = move || {
            let mut owed = VecDeque::new();
            loop {
                let order = if owed.is_empty() {
                    orders.recv().map_err(|_| RecvTimeoutError::Disconnected)
                } else {
                    orders.recv_timeout(again)
                };
                let mut wrong = None;
                while let Some(oldest) = owed.pop_front() {
                    if let Err(error) = keep(&oldest) {
                        owed.push_front(oldest);
                        wrong = Some(error);
                        break;
                    }
                    // Nobody listens at the end any more.
                    let _told = done.send(Outcome::AtLast(oldest));
                }
                match order {
                    Ok(kept) => {
                        let outcome = match wrong.map_or_else(|| keep(&kept), Err) {
                            Ok(()) => Outcome::Durable(kept),
                            Err(error) => {
                                owed.push_back(kept.clone());
                                Outcome::Owed(kept, error)
                            }
                        };
                        let _told = done.send(outcome);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
            }
        };
        let thread = std::thread::Builder::new().name("keeper".to_owned()).spawn(work)?;
        Ok(Self { to: Some(to), from, thread: Some(thread), under_way: 0 })
    }

    /// Has an example made durable, and does not wait for it.
    pub(crate) fn keep(&mut self, kept: Kept) -> Result<(), Ended> {
        let sent = self.to.as_ref().is_some_and(|to| to.send(kept).is_ok());
        self.under_way += usize::from(sent);
        if sent { Ok(()) } else { Err(Ended) }
    }

    /// What became of the next example, in their order; those that are durable at last come in between.
    pub(crate) fn kept(&mut self) -> Option<Outcome<E>> {
        let outcome = self.from.try_recv().ok()?;
        Some(self.note(outcome))
    }

    /// Waits for it; `None` when nothing is under way.
    pub(crate) fn wait(&mut self) -> Result<Option<Outcome<E>>, Ended> {
        if self.under_way == 0 {
            return Ok(None);
        }
        let outcome = self.from.recv().map_err(|_gone| Ended)?;
        Ok(Some(self.note(outcome)))
    }

    fn note(&mut self, outcome: Outcome<E>) -> Outcome<E> {
        self.under_way -= usize::from(!matches!(outcome, Outcome::AtLast(_)));
        outcome
    }
}

impl<E> Drop for Keeper<E> {
    fn drop(&mut self) {
        self.to = None;
        if let Some(thread) = self.thread.take() {
            // If it panicked, it has said so.
            let _ended = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use tasks::Example;

    use super::*;

    fn example(place: u64) -> Kept {
        let example = Example { teacher: 1, views: Vec::new() };
        Kept { key: "task 1".to_owned(), task: "Task 1".to_owned(), place, example }
    }

    const SOON: Duration = Duration::from_millis(1);
    const NEVER: Duration = Duration::from_secs(3600);

    #[test]
    fn nothing_is_acknowledged_before_it_is_durable_and_nobody_waits_for_it() {
        let (disk, turns) = unbounded::<Result<(), &str>>();
        let mut keeper = Keeper::start(move |_| turns.recv().unwrap(), NEVER).unwrap();
        // The disk stands still: whoever has it kept goes on all the same.
        for place in 0..3 {
            keeper.keep(example(place)).unwrap();
        }
        assert_eq!(keeper.kept(), None);
        disk.send(Ok(())).unwrap();
        assert_eq!(keeper.wait(), Ok(Some(Outcome::Durable(example(0)))));
        // It is full, and nothing is kept before what is owed.
        disk.send(Err("full")).unwrap();
        assert_eq!(keeper.wait(), Ok(Some(Outcome::Owed(example(1), "full"))));
        disk.send(Err("still full")).unwrap();
        assert_eq!(keeper.wait(), Ok(Some(Outcome::Owed(example(2), "still full"))));
        assert_eq!(keeper.wait(), Ok(None));
        // It has room again when the next one comes.
        (0..3).for_each(|_| disk.send(Ok(())).unwrap());
        keeper.keep(example(3)).unwrap();
        let became = [1, 2].map(|place| Outcome::AtLast(example(place)));
        for outcome in became.into_iter().chain([Outcome::Durable(example(3))]) {
            assert_eq!(keeper.wait(), Ok(Some(outcome)));
        }
        assert_eq!(keeper.wait(), Ok(None));
    }

    #[test]
    fn what_is_owed_is_tried_again_by_itself() {
        let (disk, turns) = unbounded::<Result<(), &str>>();
        for turn in [Err("full"), Err("full"), Err("full"), Ok(())] {
            disk.send(turn).unwrap();
        }
        let mut keeper = Keeper::start(move |_| turns.recv().unwrap(), SOON).unwrap();
        keeper.keep(example(0)).unwrap();
        assert_eq!(keeper.wait(), Ok(Some(Outcome::Owed(example(0), "full"))));
        assert_eq!(keeper.from.recv(), Ok(Outcome::AtLast(example(0))));
    }

    #[test]
    fn what_is_under_way_or_owed_is_durable_when_the_keeper_is_gone() {
        let (done, count) = unbounded();
        let mut tries = 0;
        let keep = move |kept: &Kept| {
            tries += 1;
            if tries < 60 { Err("full") } else { done.send(kept.place).map_err(|_| "gone") }
        };
        let mut keeper = Keeper::start(keep, NEVER).unwrap();
        for place in 0..100 {
            keeper.keep(example(place)).unwrap();
        }
        drop(keeper);
        assert_eq!(count.iter().collect::<Vec<u64>>(), (0..100).collect::<Vec<u64>>());
    }
}

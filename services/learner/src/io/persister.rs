use std::collections::VecDeque;
use std::thread::JoinHandle;

use clock::Duration;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, unbounded};

use crate::StoreChange;

/// The result of storing a change.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome<E> {
    /// It is durable.
    Durable(StoreChange),
    /// Storing failed and will be retried.
    Pending(StoreChange, E),
    /// An earlier failed change is durable now.
    PersistedLate(StoreChange),
}

/// A thread that stores changes, one after the other, so that a slow disk blocks nothing else. Changes that could
/// not be stored are retried in order, and no later change is stored before them. So a full disk loses nothing
/// while the process lives. Dropping it blocks until every change is stored or its last attempt has failed.
#[derive(Debug)]
pub(crate) struct Persister<E> {
    to: Option<Sender<StoreChange>>,
    from: Receiver<Outcome<E>>,
    thread: Option<JoinHandle<()>>,
    in_flight: usize,
}

/// The error when the thread has ended, which only happens after a panic: nothing more is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the thread that saves learned tasks ended")]
pub(crate) struct PersisterEndedError;

impl<E: Send + 'static> Persister<E> {
    /// Starts the thread. `keep` stores one change; after a failure it is called again after the time `again`.
    ///
    /// # Errors
    /// The thread could not be spawned.
    pub(crate) fn start(
        mut keep: impl FnMut(&StoreChange) -> Result<(), E> + Send + 'static,
        again: Duration,
    ) -> std::io::Result<Self> {
        let (to, examples) = unbounded::<StoreChange>();
        let (done, from) = unbounded();
        let work = move || {
            let mut owed = VecDeque::new();
            loop {
                let order = if owed.is_empty() {
                    examples.recv().map_err(|_| RecvTimeoutError::Disconnected)
                } else {
                    examples.recv_timeout(again)
                };
                let mut wrong = None;
                while let Some(oldest) = owed.pop_front() {
                    if let Err(error) = keep(&oldest) {
                        owed.push_front(oldest);
                        wrong = Some(error);
                        break;
                    }
                    // Sending fails only at shutdown, when the receiver is gone.
                    let _sent = done.send(Outcome::PersistedLate(oldest));
                }
                match order {
                    Ok(kept) => {
                        let outcome = match wrong.map_or_else(|| keep(&kept), Err) {
                            Ok(()) => Outcome::Durable(kept),
                            Err(error) => {
                                owed.push_back(kept.clone());
                                Outcome::Pending(kept, error)
                            }
                        };
                        let _sent = done.send(outcome);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
            }
        };
        let thread = std::thread::Builder::new().name("keeper".to_owned()).spawn(work)?;
        Ok(Self { to: Some(to), from, thread: Some(thread), in_flight: 0 })
    }

    /// Queues a change for storing; does not block.
    pub(crate) fn keep(&mut self, kept: StoreChange) -> Result<(), PersisterEndedError> {
        let sent = self.to.as_ref().is_some_and(|to| to.send(kept).is_ok());
        self.in_flight += usize::from(sent);
        if sent { Ok(()) } else { Err(PersisterEndedError) }
    }

    /// The next result, in the order of the changes; [`Outcome::PersistedLate`] comes in between. Does not block.
    pub(crate) fn kept(&mut self) -> Option<Outcome<E>> {
        let outcome = self.from.try_recv().ok()?;
        Some(self.note(outcome))
    }

    /// Blocks for the next result; `None` if nothing is queued.
    pub(crate) fn wait(&mut self) -> Result<Option<Outcome<E>>, PersisterEndedError> {
        if self.in_flight == 0 {
            return Ok(None);
        }
        let outcome = self.from.recv().map_err(|_gone| PersisterEndedError)?;
        Ok(Some(self.note(outcome)))
    }

    fn note(&mut self, outcome: Outcome<E>) -> Outcome<E> {
        self.in_flight -= usize::from(!matches!(outcome, Outcome::PersistedLate(_)));
        outcome
    }
}

impl<E> Drop for Persister<E> {
    fn drop(&mut self) {
        self.to = None;
        if let Some(thread) = self.thread.take() {
            // A panic was already reported by the panic hook.
            let _ended = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use tasks::Example;

    use super::*;
    use crate::Kept;

    fn example(index: u64) -> StoreChange {
        let example = Example::shown(1, Vec::new());
        StoreChange::Example(Kept { key: "task 1".to_owned(), task: "Task 1".to_owned(), index, example })
    }

    const SOON: Duration = Duration::from_millis(1);
    const NEVER: Duration = Duration::from_secs(3600);

    #[test]
    fn an_example_is_acknowledged_once_durable_without_blocking_the_caller() {
        let (disk, turns) = unbounded::<Result<(), &str>>();
        let mut persister = Persister::start(move |_| turns.recv().unwrap(), NEVER).unwrap();
        // The disk blocks; the caller does not.
        for index in 0..3 {
            persister.keep(example(index)).unwrap();
        }
        assert_eq!(persister.kept(), None);
        disk.send(Ok(())).unwrap();
        assert_eq!(persister.wait(), Ok(Some(Outcome::Durable(example(0)))));
        // The disk is full: the next example is not stored before the failed one.
        disk.send(Err("full")).unwrap();
        assert_eq!(persister.wait(), Ok(Some(Outcome::Pending(example(1), "full"))));
        disk.send(Err("still full")).unwrap();
        assert_eq!(persister.wait(), Ok(Some(Outcome::Pending(example(2), "still full"))));
        assert_eq!(persister.wait(), Ok(None));
        // The disk has space again when the next example comes.
        (0..3).for_each(|_| disk.send(Ok(())).unwrap());
        persister.keep(example(3)).unwrap();
        let became = [1, 2].map(|index| Outcome::PersistedLate(example(index)));
        for outcome in became.into_iter().chain([Outcome::Durable(example(3))]) {
            assert_eq!(persister.wait(), Ok(Some(outcome)));
        }
        assert_eq!(persister.wait(), Ok(None));
    }

    #[test]
    fn a_failed_write_of_an_example_is_retried_until_it_succeeds() {
        let (disk, turns) = unbounded::<Result<(), &str>>();
        for turn in [Err("full"), Err("full"), Err("full"), Ok(())] {
            disk.send(turn).unwrap();
        }
        let mut persister = Persister::start(move |_| turns.recv().unwrap(), SOON).unwrap();
        persister.keep(example(0)).unwrap();
        assert_eq!(persister.wait(), Ok(Some(Outcome::Pending(example(0), "full"))));
        assert_eq!(persister.from.recv(), Ok(Outcome::PersistedLate(example(0))));
    }

    #[test]
    fn pending_examples_are_durable_when_the_persister_ends() {
        let (done, count) = unbounded();
        let mut tries = 0;
        let keep = move |change: &StoreChange| {
            tries += 1;
            if tries < 60 { Err("full") } else { done.send(change.clone()).map_err(|_| "gone") }
        };
        let mut persister = Persister::start(keep, NEVER).unwrap();
        for index in 0..100 {
            persister.keep(example(index)).unwrap();
        }
        drop(persister);
        assert_eq!(count.iter().collect::<Vec<_>>(), (0..100).map(example).collect::<Vec<_>>());
    }
}

use std::thread::JoinHandle;

use crossbeam::channel::{Receiver, Sender, unbounded};

use crate::Kept;

/// An example, and whether it is durable.
type Outcome<E> = (Kept, Result<(), E>);

/// A thread that makes examples durable, one after the other, so that a slow disk holds up nothing
/// else. Dropping it waits until all of them are.
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
    /// Starts the thread; `keep` makes one example durable.
    ///
    /// # Errors
    /// The system has no thread left.
    pub(crate) fn start(
        mut keep: impl FnMut(&Kept) -> Result<(), E> + Send + 'static,
    ) -> std::io::Result<Self> {
        let (to, orders) = unbounded::<Kept>();
        let (done, from) = unbounded();
        let work = move || {
            for kept in orders {
                let result = keep(&kept);
                if done.send((kept, result)).is_err() {
                    break;
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

    /// The next example, in their order, about which it is known whether it is durable.
    pub(crate) fn kept(&mut self) -> Option<Outcome<E>> {
        let kept = self.from.try_recv().ok()?;
        self.under_way -= 1;
        Some(kept)
    }

    /// Waits for it; `None` when nothing is under way.
    pub(crate) fn wait(&mut self) -> Result<Option<Outcome<E>>, Ended> {
        if self.under_way == 0 {
            return Ok(None);
        }
        let kept = self.from.recv().map_err(|_gone| Ended)?;
        self.under_way -= 1;
        Ok(Some(kept))
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

    #[test]
    fn nothing_is_acknowledged_before_it_is_durable_and_nobody_waits_for_it() {
        let (disk, turns) = unbounded::<Result<(), &str>>();
        let mut keeper = Keeper::start(move |_| turns.recv().unwrap()).unwrap();
        // The disk stands still: whoever has it kept goes on all the same.
        for place in 0..3 {
            keeper.keep(example(place)).unwrap();
        }
        assert!(keeper.kept().is_none());
        for (place, result) in [(0, Ok(())), (1, Err("full")), (2, Ok(()))] {
            disk.send(result).unwrap();
            assert_eq!(keeper.wait().unwrap(), Some((example(place), result)));
        }
        assert_eq!(keeper.wait(), Ok(None));
    }

    #[test]
    fn what_is_under_way_is_durable_when_the_keeper_is_gone() {
        let (done, count) = unbounded();
        let mut keeper = Keeper::start(move |kept| done.send(kept.place)).unwrap();
        for place in 0..100 {
            keeper.keep(example(place)).unwrap();
        }
        drop(keeper);
        assert_eq!(count.iter().collect::<Vec<u64>>(), (0..100).collect::<Vec<u64>>());
    }
}

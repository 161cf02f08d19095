use std::path::Path;

use serde::{Deserialize, Serialize};
use store::{Entry, Lost, OpenError, ReadError, Store, WriteError};
use tasks::{Task, key};

use crate::{Kept, StoreChange};

/// Persistent storage of what was learned: the tasks and their examples.
#[derive(Debug)]
pub struct Memory(Store);

/// The stored data of a task, apart from its examples.
#[derive(Deserialize, Serialize)]
struct Head {
    name: String,
}

impl Memory {
    /// Opens the store, or creates an empty one. Repaired damage and losses are logged.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open(file: &Path) -> Result<Self, OpenError> {
        let store = Store::open(file)?;
        let findings = store.findings();
        if findings.lost != Lost::Nothing {
            tracing::error!("{findings}");
        } else if !findings.is_empty() {
            tracing::warn!("{findings}");
        }
        Ok(Self(store))
    }

    /// The losses that were not reported yet.
    pub(crate) fn losses(&self) -> &[String] {
        self.0.losses()
    }

    /// Marks the losses as reported.
    pub(crate) fn said(&mut self) -> Result<(), WriteError> {
        self.0.mark_losses_reported()
    }

    /// All tasks, sorted by key.
    ///
    /// # Errors
    /// As [`Store::load`].
    pub fn tasks(&mut self) -> Result<Vec<Task>, ReadError> {
        let entries = self.0.load::<Head, _>()?;
        Ok(entries
            .into_iter()
            .map(|Entry { head, items, .. }| Task { name: head.name, examples: items })
            .collect())
    }

    /// Stores one change. It is durable on return.
    ///
    /// # Errors
    /// As [`Store::put`], [`Store::save_all`] and [`Store::forget`].
    pub fn change(&mut self, change: &StoreChange) -> Result<(), WriteError> {
        match change {
            StoreChange::Example(kept) => self.keep(kept),
            StoreChange::Rewrite { key: old, task } => {
                if let Some(task) = task {
                    self.replace(std::slice::from_ref(task))?;
                }
                let is_stored = task.as_ref().is_some_and(|task| key(&task.name) == *old);
                if is_stored { Ok(()) } else { self.0.forget(old).map(drop) }
            }
        }
    }

    /// Stores one example. It is durable on return.
    ///
    /// # Errors
    /// As [`Store::put`].
    pub fn keep(&mut self, kept: &Kept) -> Result<(), WriteError> {
        let head = Head { name: kept.task.clone() };
        self.0.put(&kept.key, &head, kept.index, &kept.example)
    }

    /// Stores tasks with all their examples, replacing tasks of the same name; atomic. Durable on return.
    ///
    /// # Errors
    /// As [`Store::save_all`].
    pub fn replace(&mut self, tasks: &[Task]) -> Result<(), WriteError> {
        let entries: Vec<Entry<Head, &tasks::Example>> = tasks
            .iter()
            .map(|task| Entry {
                key: key(&task.name),
                head: Head { name: task.name.clone() },
                items: task.examples.iter().collect(),
            })
            .collect();
        self.0.save_all(&entries)
    }

    /// Removes a task with all its examples; `false` if there is none of this name.
    ///
    /// # Errors
    /// As [`Store::forget`].
    pub fn forget(&mut self, name: &str) -> Result<bool, WriteError> {
        self.0.forget(&key(name))
    }
}

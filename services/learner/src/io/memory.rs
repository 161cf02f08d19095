use std::path::Path;

use serde::{Deserialize, Serialize};
use store::{Entry, Lost, OpenError, ReadError, Store, WriteError};
use tasks::{Task, key};

use crate::Kept;

/// What was learned, beyond the life of the process: a store of tasks and their examples.
#[derive(Debug)]
pub struct Memory(Store);

/// What the file says of a task beside its examples.
#[derive(Deserialize, Serialize)]
struct Head {
    name: String,
}

impl Memory {
    /// Opens the store, or makes an empty one; one of an older version is taken over. What was damaged and mended, and
    /// what is lost, is logged.
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

    /// What was lost and not said yet, now or before.
    pub(crate) fn losses(&self) -> &[String] {
        self.0.losses()
    }

    /// The losses were said.
    pub(crate) fn said(&mut self) -> Result<(), WriteError> {
        self.0.told()
    }

    /// All tasks, in the order of their keys.
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

    /// Keeps one more example. Durable when it returns.
    ///
    /// # Errors
    /// As [`Store::put`].
    pub fn keep(&mut self, kept: &Kept) -> Result<(), WriteError> {
        let head = Head { name: kept.task.clone() };
        self.0.put(&kept.key, &head, kept.place, &kept.example)
    }

    /// Keeps tasks with all their examples, each in place of the known one of its name; all of them or
    /// none. Durable when it returns.
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

    /// Forgets a task with all its examples; `false` where there is none of this name.
    ///
    /// # Errors
    /// As [`Store::forget`].
    pub fn forget(&mut self, name: &str) -> Result<bool, WriteError> {
        self.0.forget(&key(name))
    }
}

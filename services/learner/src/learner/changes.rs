//! Changes of what was learned: names, and what is forgotten.

use message::{Event, EventKind};
use tasks::{Task, key, listed};

use super::saying::say;
use super::{Learner, Output, StoreChange};
use crate::{Body, answers};

impl<B: Body> Learner<B> {
    /// The names of the known tasks, as a list in words.
    pub(super) fn known_names(&self) -> String {
        let known: Vec<String> = self.tasks.values().map(|task| task.name.clone()).collect();
        if known.is_empty() { "nothing yet".to_owned() } else { listed(&known) }
    }

    /// The task of a name, or the current one. Says so if there is none.
    pub(super) fn known_task(&self, name: Option<&str>, output: &mut Output) -> Option<&Task> {
        let task = match name {
            Some(name) => self.tasks.get(&key(name)),
            None => self.current_task(),
        };
        if task.is_none() {
            let known = self.known_names();
            let text = match name {
                Some(name) => format!("I have not learned {name}; I know {known}"),
                None => format!("which task do you mean? I know {known}"),
            };
            say(output, name.unwrap_or_default(), &text);
        }
        task
    }

    /// Names what is being shown, or renames a task.
    pub(super) fn rename(&mut self, old: Option<&str>, new: &str, output: &mut Output) {
        if let Some(teaching) = &mut self.teaching
            && old.is_none_or(|old| key(old) == key(&teaching.recording.task))
        {
            let name = self.tasks.get(&key(new)).map_or(new, |task| &task.name);
            name.clone_into(&mut teaching.recording.task);
            say(output, name, &format!("I call it {name}; say \"I'm done\" at the end"));
            return;
        }
        let Some(old_key) = self.known_task(old, output).map(|task| key(&task.name)) else { return };
        let new_key = key(new);
        if new_key != old_key && self.tasks.contains_key(&new_key) {
            say(output, new, &format!("I know another task {new}: please choose another name"));
            return;
        }
        let Some(mut task) = self.tasks.remove(&old_key) else { return };
        let old = std::mem::replace(&mut task.name, new.to_owned());
        output.save.push(StoreChange::Rewrite { key: old_key.clone(), task: Some(task.clone()) });
        for reference in [&mut self.current_task, &mut self.stopped].into_iter().flatten() {
            if *reference == old_key {
                reference.clone_from(&new_key);
            }
        }
        self.tasks.insert(new_key, task);
        self.question = None;
        output.events.push(Event::new(EventKind::Renamed, &old, new));
        say(output, new, &format!("I call {old} {new} now"));
    }

    /// Forgets a task.
    pub(super) fn forget_task(&mut self, task_key: &str, output: &mut Output) {
        let Some(task) = self.tasks.remove(task_key) else { return };
        output.save.push(StoreChange::Rewrite { key: task_key.to_owned(), task: None });
        self.current_task.take_if(|current| current == task_key);
        self.stopped.take_if(|stopped| stopped == task_key);
        self.question = None;
        output.events.push(Event::new(EventKind::Forgotten, &task.name, &task.name));
        say(output, &task.name, &format!("I forgot {}", task.name));
    }

    /// Forgets the last example of a task; with its only example the task is forgotten.
    pub(super) fn forget_example(&mut self, task_key: &str, output: &mut Output) {
        let Some(task) = self.tasks.get_mut(task_key) else { return };
        let last = task.remove(task.examples.len().saturating_sub(1));
        if task.examples.is_empty() {
            self.forget_task(task_key, output);
            return;
        }
        let task = task.clone();
        let left = answers::evidence(&task);
        output.save.push(StoreChange::Rewrite { key: task_key.to_owned(), task: Some(task.clone()) });
        self.question = None;
        output.events.extend(self.recall(task_key));
        let was_told = last.is_some_and(|last| last.telling.is_some());
        let last = if was_told { "what you said last about" } else { "the last example of" };
        say(output, &task.name, &format!("I forgot {last} {}; I go by {left}", task.name));
    }

    /// A name for a task that has none yet: "task 3".
    pub(super) fn fresh_name(&self) -> String {
        let mut names = (self.tasks.len() + 1..).map(|number| format!("task {number}"));
        names.find(|name| !self.tasks.contains_key(&key(name))).unwrap_or_default()
    }
}

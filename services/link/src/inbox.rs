//! What came, in order and once.

use crate::wire::{Bundle, Frame};

/// What is known of the bundles that the other machine sends.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inbox {
    life: u64,
    newest: u64,
    wanted: u64,
    pub(crate) lost: u64,
}

/// What is new in a bundle.
#[derive(Debug, Default)]
pub struct New {
    /// Of those of which every one is wanted: the next ones.
    pub said: Vec<Frame>,
    /// The others.
    pub newest: Vec<Frame>,
}

impl Inbox {
    /// Takes a bundle, and gives what is new in it.
    pub(crate) fn take(&mut self, bundle: Bundle) -> New {
        if bundle.life != self.life {
            *self = Self { life: bundle.life, wanted: bundle.oldest, lost: self.lost, newest: 0 };
        } else if bundle.number <= self.newest {
            return New::default();
        } else {
            self.lost = self.lost.saturating_add(bundle.number - self.newest - 1);
        }
        self.newest = bundle.number;
        self.wanted = self.wanted.max(bundle.oldest);
        let mut newest = bundle.frames;
        let numbered = newest.split_off(newest.len().saturating_sub(bundle.numbered));
        let mut said = Vec::new();
        for (frame, number) in numbered.into_iter().zip(bundle.first..) {
            if number == self.wanted {
                self.wanted += 1;
                said.push(frame);
            }
        }
        New { said, newest }
    }

    /// What to tell the sender: whose bundles, the newest that came, and the frame that is wanted next.
    pub(crate) fn heard(&self) -> (u64, u64, u64) {
        (self.life, self.newest, self.wanted)
    }
}

//! Receives batches: every frame in order and exactly once.

use crate::wire::{Batch, Frame};

/// State of the batches received from the peer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inbox {
    epoch: u64,
    newest: u64,
    wanted: u64,
    pub(crate) lost: u64,
}

/// The new frames of a batch.
#[derive(Debug, Default)]
pub struct NewFrames {
    /// Reliable frames: the next ones in sequence.
    pub said: Vec<Frame>,
    /// The other frames.
    pub newest: Vec<Frame>,
}

impl Inbox {
    /// Accepts a batch and returns its new frames.
    pub(crate) fn take(&mut self, bundle: Batch) -> NewFrames {
        if bundle.epoch != self.epoch {
            *self = Self { epoch: bundle.epoch, wanted: bundle.oldest, lost: self.lost, newest: 0 };
        } else if bundle.number <= self.newest {
            return NewFrames::default();
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
        NewFrames { said, newest }
    }

    /// The acknowledgement: epoch of the sender, newest batch received, next reliable frame expected.
    pub(crate) fn heard(&self) -> (u64, u64, u64) {
        (self.epoch, self.newest, self.wanted)
    }
}

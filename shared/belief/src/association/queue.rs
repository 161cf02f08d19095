use invariant::{invariant, require};
use std::cmp::Ordering;

use super::pair::Pair;

const NO_PAIR: Pair =
    Pair { distance: 0.0, older: 0, younger: 0, older_slot: 0, younger_slot: 0, younger_version: 0 };

/// Not in the queue.
const OUT: u32 = u32::MAX;

/// An indexed binary heap with at most one pair per slot, that of the slot's older member.
#[derive(Debug)]
pub(crate) struct Queue {
    heap: Vec<Entry>,
    /// Position in the heap, by slot.
    places: Box<[u32]>,
    /// By slot.
    pairs: Box<[Pair]>,
}

/// A copy of the distance, for comparisons without access to the pair.
#[derive(Clone, Copy, Debug)]
struct Entry {
    distance: f64,
    slot: u32,
}

impl Queue {
    pub(crate) fn new(slots: usize) -> Self {
        Self {
            heap: Vec::with_capacity(slots),
            places: vec![OUT; slots].into_boxed_slice(),
            pairs: vec![NO_PAIR; slots].into_boxed_slice(),
        }
    }

    /// The pair of a slot.
    pub(crate) fn get(&self, slot: u32) -> Option<&Pair> {
        let waits = *self.places.get(slot as usize)? != OUT;
        if waits { self.pairs.get(slot as usize) } else { None }
    }

    /// The first of all pairs.
    pub(crate) fn first(&self) -> Option<Pair> {
        self.pairs.get(self.heap.first()?.slot as usize).copied()
    }

    /// Adds a pair while the queue is being filled; replaces that of its slot if it precedes it. The caller must call
    /// [`Self::heapify`] afterwards.
    pub(crate) fn propose(&mut self, pair: Pair) {
        let slot = pair.older_slot as usize;
        let entries = self.places.get_mut(slot).zip(self.pairs.get_mut(slot));
        let Some((place, held)) = require!(entries, "slot {slot} exists") else { return };
        let entry = Entry { distance: pair.distance, slot: pair.older_slot };
        match self.heap.get_mut(*place as usize) {
            Some(waiting) if pair.is_before(held) => *waiting = entry,
            Some(_) => return,
            None => {
                *place = u32::try_from(self.heap.len()).unwrap_or(OUT);
                self.heap.push(entry);
            }
        }
        *held = pair;
    }

    /// Builds the heap after the queue was filled.
    pub(crate) fn heapify(&mut self) {
        for place in (0..self.heap.len() / 2).rev() {
            self.sift_down(place);
        }
    }

    /// Sets or removes the pair of a slot.
    pub(crate) fn set(&mut self, slot: u32, pair: Option<Pair>) {
        let Some(&place) = require!(self.places.get(slot as usize), "slot {slot} exists") else { return };
        match (pair, place) {
            (None, OUT) => {}
            (None, place) => self.remove(place as usize),
            (Some(pair), place) => {
                if let Some(held) = self.pairs.get_mut(slot as usize) {
                    *held = pair;
                }
                let entry = Entry { distance: pair.distance, slot };
                let place = if place == OUT {
                    self.heap.push(entry);
                    self.heap.len() - 1
                } else {
                    place as usize
                };
                self.put(place, entry);
                let place = self.sift_up(place);
                self.sift_down(place);
            }
        }
    }

    fn remove(&mut self, place: usize) {
        let Some(last) = require!(self.heap.pop(), "the queue has an entry {place}") else { return };
        let removed = self.heap.get(place).copied().unwrap_or(last);
        if let Some(place) = self.places.get_mut(removed.slot as usize) {
            *place = OUT;
        }
        if place < self.heap.len() {
            self.put(place, last);
            let place = self.sift_up(place);
            self.sift_down(place);
        }
    }

    fn put(&mut self, place: usize, entry: Entry) {
        let slots =
            (self.heap.get_mut(place), self.places.get_mut(entry.slot as usize), u32::try_from(place));
        let (Some(held), Some(held_place), Ok(place)) = slots else {
            invariant!(false, "the queue has an entry {place}, and slot {} exists", entry.slot);
            return;
        };
        (*held, *held_place) = (entry, place);
    }

    fn sift_up(&mut self, mut place: usize) -> usize {
        let Some(entry) = self.heap.get(place).copied() else { return place };
        while place > 0 {
            let above = (place - 1) / 2;
            let Some(parent) = self.heap.get(above).copied() else { break };
            if !self.is_before(entry, parent) {
                break;
            }
            self.put(place, parent);
            place = above;
        }
        self.put(place, entry);
        place
    }

    fn sift_down(&mut self, mut place: usize) {
        let Some(entry) = self.heap.get(place).copied() else { return };
        loop {
            let (left, right) = (self.heap.get(2 * place + 1), self.heap.get(2 * place + 2));
            let (child, below) = match (left.copied(), right.copied()) {
                (Some(left), Some(right)) if self.is_before(right, left) => (right, 2 * place + 2),
                (Some(left), _) => (left, 2 * place + 1),
                (None, _) => break,
            };
            if !self.is_before(child, entry) {
                break;
            }
            self.put(place, child);
            place = below;
        }
        self.put(place, entry);
    }

    fn is_before(&self, a: Entry, b: Entry) -> bool {
        match a.distance.total_cmp(&b.distance) {
            Ordering::Less => true,
            Ordering::Greater => false,
            Ordering::Equal => match (self.pairs.get(a.slot as usize), self.pairs.get(b.slot as usize)) {
                (Some(a), Some(b)) => a.is_before(b),
                _ => false,
            },
        }
    }
}

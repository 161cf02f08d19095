const NONE: usize = usize::MAX;

/// Lists of slots, each slot in at most one of them, in fixed room.
#[derive(Clone, Debug)]
pub(crate) struct Lists {
    first: Box<[usize]>,
    links: Box<[Link]>,
}

#[derive(Clone, Copy, Debug)]
struct Link {
    list: usize,
    previous: usize,
    next: usize,
}

const UNLINKED: Link = Link { list: NONE, previous: NONE, next: NONE };

impl Lists {
    pub(crate) fn new(lists: usize, slots: usize) -> Self {
        Self { first: vec![NONE; lists].into_boxed_slice(), links: vec![UNLINKED; slots].into_boxed_slice() }
    }

    pub(crate) fn clear(&mut self) {
        self.first.fill(NONE);
        self.links.fill(UNLINKED);
    }

    /// The slots of a list.
    pub(crate) fn of(&self, list: usize) -> impl Iterator<Item = usize> {
        let mut slot = self.first.get(list).copied().unwrap_or(NONE);
        std::iter::from_fn(move || {
            let link = self.links.get(slot)?;
            Some(std::mem::replace(&mut slot, link.next))
        })
    }

    /// The first slot of a list.
    pub(crate) fn first_of(&self, list: usize) -> Option<usize> {
        self.first.get(list).copied().filter(|&slot| slot != NONE)
    }

    /// Puts a slot that is in no list into one.
    pub(crate) fn insert(&mut self, list: usize, slot: usize) {
        let Some(first) = self.first.get_mut(list) else { return };
        let next = std::mem::replace(first, slot);
        if let Some(follower) = self.links.get_mut(next) {
            follower.previous = slot;
        }
        if let Some(link) = self.links.get_mut(slot) {
            *link = Link { list, previous: NONE, next };
        }
    }

    /// Takes a slot out of its list, if it is in one.
    pub(crate) fn remove(&mut self, slot: usize) {
        let Some(link) = self.links.get_mut(slot) else { return };
        let Link { list, previous, next } = std::mem::replace(link, UNLINKED);
        if let Some(follower) = self.links.get_mut(next) {
            follower.previous = previous;
        }
        match self.links.get_mut(previous) {
            Some(predecessor) => predecessor.next = next,
            // It was the first, or in no list.
            None => {
                if let Some(first) = self.first.get_mut(list) {
                    *first = next;
                }
            }
        }
    }
}

use std::ops::{Deref, DerefMut};

/// A vector of fixed capacity. A clone has the same capacity, so a clone of a belief system allocates nothing in a step.
///
/// A clone of a plain vector has room for its elements only. The capacities come from the configuration, so an array of
/// a capacity known at compile time (`arrayvec`) cannot hold them.
#[derive(Debug)]
pub(crate) struct BoundedVec<T>(Vec<T>);

impl<T> BoundedVec<T> {
    pub(crate) fn with_bound(max: usize) -> Self {
        Self(Vec::with_capacity(max))
    }
}

impl<T: Clone> Clone for BoundedVec<T> {
    fn clone(&self) -> Self {
        let mut copy = Vec::with_capacity(self.0.capacity());
        copy.extend(self.0.iter().cloned());
        Self(copy)
    }
}

impl<T> Deref for BoundedVec<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T> DerefMut for BoundedVec<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.0
    }
}

use std::ops::{Deref, DerefMut};

/// A vector of fixed capacity. A clone has the same capacity, unlike that of a plain vector.
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

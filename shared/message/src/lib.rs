//! The words of Leo: fixed layouts that its processes share through memory.

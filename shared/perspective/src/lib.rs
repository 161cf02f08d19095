//! The world as a partner perceives it: visibility, transform, one belief system each.

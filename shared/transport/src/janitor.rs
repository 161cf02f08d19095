//! Cleans a domain after processes that died.

//! Real-time rights of a thread: scheduling, affinity, locked memory.

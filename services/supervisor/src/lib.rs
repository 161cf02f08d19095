//! Supervisor: starts, watches, restarts and stops the processes; the conductor of lockstep time.

pub mod policy;

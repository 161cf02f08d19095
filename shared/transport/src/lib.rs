//! Shared memory between Leo's processes: outlets, inlets, bells, health, the janitor.

//! What the shells of all processes have in common: joining the domain, the pace, the health they publish.

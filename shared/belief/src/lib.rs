#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! The tuple (B, G, M, d, q, w, c) of the paper:
//!
//! | | what it is | where |
//! |---|---|---|
//! | B | the current set of beliefs, b = {(p, h), …} | [`BeliefSystem`] |
//! | G, Eq. 3 | history generators; h(t) = (m′, c′, d′) | `storage::histories`, chosen by `history` of a percept |
//! | N, Eq. 6 | a snapshot becomes a belief | [`BeliefSystem::step`] |
//! | d, q, w, Eq. 4 | D(b₁, b₂) = Σ wᵢ·qᵢ·dᵢ | `association::metric`, `[[belief.distance]]` |
//! | M | the union of histories; the older identity survives | `storage::memory`, `storage::histories` |
//! | c, Eq. 5 | C(b) = Π cⱼ(b) | [`BeliefSystem::step`], `[[belief.cull]]` |
//!
//! The clustering loop is "while some pair has D < threshold, merge the pair of globally minimal D". [`Clustering`]
//! implements it over any [`AssociationProblem`]; its result equals that of the [naive loop](cluster_naively) bit for
//! bit.
//!
//! # Rooms
//!
//! The source has three rooms, and imports flow one way: from `system` to the other two.
//!
//! - `association` decides which detection belongs to which belief: prediction, distance, gating, clustering, cannot-link.
//! - `storage` remembers each belief: slots, histories, samples.
//! - `system` makes a belief system of both: steps, culling, settings, plug-in functions.
//!
//! Of each other, `association` and `storage` share one trait, `association::FeatureStore`. The storage implements it,
//! so that the association can read and predict the features that are stored.
//!
//! # Example
//!
//! With the built-in percepts, a red block is seen at x = 0.50 m. 5 ms later a red thing is seen at 0.54 m and a blue
//! one at 0.55 m. For the first, D = 1.0·0.04 + 0.5·0 + 0.5·0 = 0.04 (position, shape, colour). That is below the
//! threshold 0.15, so it is the same block. The low-pass with share 0.5 places it at 0.5·0.54 + 0.5·0.50 = 0.52 m. For
//! the blue one D = 0.05 + 0.5 is above the threshold: it becomes a new belief. The two observations of one instant
//! cannot be linked in any case. After 2 s without an observation, the confidence of the position has decayed from 0.9
//! to 0.9·exp(−0.2·2) = 0.603.
//!
//! ```
//! use belief::BeliefSystem;
//! use clock::{Duration, Instant};
//! use belief::percepts::Percepts;
//! use message::{Feature, Observation, Perceived, SourceSet};
//! use perception::{Frame, Perception};
//!
//! let percepts = Percepts::builtin();
//! let perception = Perception::new(&percepts)?;
//! let mut system = BeliefSystem::new(&percepts, 16)?;
//! let see = |at: Instant, x: f32, colour_rgb| {
//!     let observation = Observation {
//!         confidence: 0.9,
//!         position_m: [x, 0.0, 0.0],
//!         colour_rgb,
//!         half_extents_m: [0.03; 3],
//!         ..Observation::object(0, at.as_nanos())
//!     };
//!     Perceived { observation, snapshot: perception.perceive(&observation, &Frame { agent: 0 }) }
//! };
//! let (red, blue) = ([0.80, 0.05, 0.05], [0.05, 0.15, 0.80]);
//!
//! let first = Instant::from_nanos(1_000_000_000);
//! system.step(first, &[see(first, 0.50, red)], 0..1, SourceSet::of(0), |_place| true);
//! let then = first + Duration::from_millis(5);
//! let seen = [see(then, 0.54, red), see(then, 0.55, blue)];
//! system.step(then, &seen, 0..2, SourceSet::of(0), |_place| true);
//!
//! let beliefs: Vec<_> = system.beliefs().collect();
//! assert_eq!(beliefs.iter().map(|belief| (belief.id, belief.observations)).collect::<Vec<_>>(), [(1, 2), (2, 1)]);
//! let position = percepts.index("position").unwrap();
//! let Some(Feature::Vector([x, ..])) = beliefs[0].percept(position).unwrap().feature() else { panic!() };
//! assert!((x - 0.52).abs() < 1e-6);
//!
//! let later = system.write(0, then + Duration::from_secs(2)).unwrap();
//! assert!((later.percept(position).unwrap().confidence - 0.603).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Eq. 5 with two culling functions: "unseen for longer than 600 ms" and "confidence of the position below a floor".
//! The confidence is 0.9·exp(−0.2·0.5) = 0.814 at 0.5 s after the last observation, 0.782 at 0.7 s and 0.737 at 1 s.
//! With a floor of 0.85, C = 0·1 = 0 at 0.5 s, so the belief stays; at 0.7 s C = 1·1 = 1, so it is culled. With a floor
//! of 0.75, C = 0·0, 1·0 and 1·1: both functions agree only at 1 s.
//!
//! ```
//! use belief::BeliefSystem;
//! use clock::{Duration, Instant};
//! use belief::percepts::{Cull, Percepts};
//! use message::{Observation, Perceived, SourceSet};
//! use perception::{Frame, Perception};
//!
//! let mut percepts = Percepts::builtin();
//! let place = percepts.index("position").unwrap();
//! let seen_at = Instant::from_nanos(1_000_000_000);
//! let observation = Observation { confidence: 0.9, ..Observation::object(0, seen_at.as_nanos()) };
//! let snapshot = Perception::new(&percepts)?.perceive(&observation, &Frame { agent: 0 });
//! for (floor, expected) in [(0.85, [1, 0, 0]), (0.75, [1, 1, 0])] {
//!     let unseen = Cull::UnseenLongerThan(Duration::from_millis(600));
//!     percepts.belief.cull = vec![unseen, Cull::ConfidenceBelow { percept: place, floor }];
//!     let mut system = BeliefSystem::new(&percepts, 16)?;
//!     system.step(seen_at, &[Perceived { observation, snapshot }], 0..1, SourceSet::of(0), |_place| true);
//!     for (millis, confidence) in [(500, 0.814), (700, 0.782), (1_000, 0.737)] {
//!         let remembered = system.write(0, seen_at + Duration::from_millis(millis)).unwrap();
//!         assert!((remembered.percept(place).unwrap().confidence - confidence).abs() < 1e-3);
//!     }
//!     let left = [500, 700, 1_000].map(|millis| {
//!         let now = seen_at + Duration::from_millis(millis);
//!         system.step(now, &[], 0..0, SourceSet::of(0), |_place| true);
//!         system.len()
//!     });
//!     assert_eq!(left, expected);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Plug-in functions
//!
//! A program can supply its own distance d with its applicability q ([`Distance`]), culling function c ([`Cull`]) and
//! history generator g ([`History`]). It registers them under names ([`BeliefPlugins`]), and the configuration refers
//! to these names: `measure = { plugin = "NAME" }`, `when = { plugin = "NAME" }`, `history = { plugin = "NAME" }`.
//! Plug-in percepts are [`perception::Classify`]. The weights w are in the configuration; M follows from the unions
//! that the histories define. The built-in functions cost the same whether or not plug-ins exist.
//!
//! # Cost
//!
//! The cost of a step is proportional to the number of observations plus the number of beliefs, because every belief is
//! tested for culling (`cargo bench -p belief-process`). A step with frames of two sources, where the second sees every
//! fifth thing, costs two and a half times as much. A detection that no belief takes is compared with every belief, for
//! a track that it may continue. Association uses only the few features that D compares; the
//! histories are updated afterwards, in memory order. Nothing allocates after [`BeliefSystem::new`].

mod association;
mod storage;
mod system;

pub use association::{
    AssociationProblem, Clustering, Distance, GateKeys, MemberSummary, Motion, cluster_naively,
};
pub use storage::{History, Sample, Samples};
pub use system::{
    BeliefPlugins, BeliefSystem, BeliefSystemError, Counts, Cull, CullContext, StepBuilder, percepts,
};

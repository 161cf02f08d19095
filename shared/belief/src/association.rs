//! Association: the decision which detection belongs to which belief.
//!
//! [`Clustering`] makes it over any [`AssociationProblem`]. `metric` is the distance D, `features` caches what it
//! compares of each belief, `tracks` predicts where each thing is, and `detection_history` yields the cannot-link
//! constraints. The room stores no samples and imports no other room: what it needs of a storage is the trait
//! [`FeatureStore`].

mod axis;
mod clustering;
mod detection_history;
mod distance;
mod features;
mod gate_keys;
mod grouping;
mod interval;
mod matching;
mod metric;
mod naive;
mod pair;
mod problem;
mod queue;
pub(crate) mod settings;
mod spatial_hash;
mod track;
mod tracks;

pub use clustering::Clustering;
pub(crate) use clustering::PREFETCH_DISTANCE;
pub(crate) use detection_history::DetectionHistory;
pub use distance::Distance;
pub(crate) use features::{FeatureStore, Features};
pub use gate_keys::GateKeys;
pub(crate) use interval::Interval;
pub(crate) use metric::Metric;
pub use naive::cluster as cluster_naively;
pub use problem::{AssociationProblem, MemberSummary};
pub use track::Motion;

//! The clustering under average and complete linkage, compared with an independent library.
//!
//! The belief distance is not a linkage, but the clustering only asks a [`AssociationProblem`] for distances. Over
//! fixed points, with the linkage of two point sets as their distance, the loop of the paper is agglomerative
//! clustering cut at the threshold.

#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a reference is written to be read, and a test that panics has failed"
)]

use std::collections::BTreeSet;

use belief::{AssociationProblem, Clustering, cluster_naively};
use kodama::Method;
use proptest::prelude::*;

/// How the distance of two point sets is computed from the distances of their points.
#[derive(Clone, Copy, Debug)]
enum Linkage {
    Average,
    Complete,
}

/// Point sets, initially one per point.
struct Sets {
    linkage: Linkage,
    threshold: f64,
    points: Vec<[f64; 3]>,
    slots: Vec<u32>,
    members: Vec<Vec<usize>>,
    versions: Vec<u32>,
}

impl Sets {
    fn new(linkage: Linkage, threshold: f64, points: &[[f64; 3]]) -> Self {
        let count = u32::try_from(points.len()).unwrap();
        Self {
            linkage,
            threshold,
            points: points.to_vec(),
            slots: (0..count).collect(),
            members: (0..points.len()).map(|point| vec![point]).collect(),
            versions: vec![0; points.len()],
        }
    }

    fn partition(&self) -> BTreeSet<BTreeSet<usize>> {
        let sets = self.members.iter().filter(|members| !members.is_empty());
        sets.map(|members| members.iter().copied().collect()).collect()
    }
}

impl AssociationProblem for Sets {
    fn old(&self) -> &[u32] {
        &[]
    }

    fn fresh(&self) -> &[u32] {
        &self.slots
    }

    fn is_live(&self, slot: u32) -> bool {
        !self.members[slot as usize].is_empty()
    }

    fn id(&self, slot: u32) -> u64 {
        u64::from(slot)
    }

    fn version(&self, slot: u32) -> u32 {
        self.versions[slot as usize]
    }

    /// The centroid of the set: the distance of two centroids is at most the mean distance of the points.
    fn place(&self, slot: u32) -> Option<[f32; 3]> {
        let members = &self.members[slot as usize];
        let count = quantity::number::float_of_count(members.len());
        let mean = |axis: usize| members.iter().map(|&point| self.points[point][axis]).sum::<f64>() / count;
        Some([0, 1, 2].map(|axis| quantity::number::single(mean(axis))))
    }

    fn distance(&self, a: u32, b: u32) -> Option<f64> {
        let (a, b) = (&self.members[a as usize], &self.members[b as usize]);
        let pairs = a.iter().flat_map(|&a| b.iter().map(move |&b| (a.min(b), a.max(b))));
        let distances = pairs.map(|(a, b)| distance(&self.points[a], &self.points[b]));
        let distance = match self.linkage {
            Linkage::Complete => distances.fold(0.0, f64::max),
            Linkage::Average => {
                // Summed in an order that does not depend on which set comes first.
                let mut distances: Vec<_> = distances.collect();
                distances.sort_by(f64::total_cmp);
                distances.iter().sum::<f64>() / quantity::number::float_of_count(distances.len())
            }
        };
        (distance < self.threshold).then_some(distance)
    }

    fn merge(&mut self, kept: u32, gone: u32) {
        let members = std::mem::take(&mut self.members[gone as usize]);
        self.members[kept as usize].extend(members);
        self.versions[kept as usize] += 1;
        self.versions[gone as usize] += 1;
    }
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// The partition computed by the library, cut at the threshold.
fn by_kodama(linkage: Linkage, threshold: f64, points: &[[f64; 3]]) -> BTreeSet<BTreeSet<usize>> {
    let mut distances: Vec<f64> = Vec::new();
    for (index, a) in points.iter().enumerate() {
        distances.extend(points[index + 1..].iter().map(|b| distance(a, b)));
    }
    let method = match linkage {
        Linkage::Average => Method::Average,
        Linkage::Complete => Method::Complete,
    };
    let dendrogram = kodama::linkage(&mut distances, points.len(), method);
    let mut clusters: Vec<BTreeSet<usize>> = (0..points.len()).map(|point| BTreeSet::from([point])).collect();
    for step in dendrogram.steps().iter().filter(|step| step.dissimilarity < threshold) {
        let other = std::mem::take(&mut clusters[step.cluster1]);
        let joined = other.into_iter().chain(std::mem::take(&mut clusters[step.cluster2])).collect();
        clusters.push(joined);
    }
    clusters.into_iter().filter(|cluster| !cluster.is_empty()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn linkage_clusters_equal_those_of_an_independent_library(
        points in prop::collection::vec([0.0..2.0_f64, 0.0..2.0_f64, 0.0..0.5_f64], 2..60),
        threshold in 0.05..0.9_f64,
        complete in any::<bool>(),
    ) {
        let linkage = if complete { Linkage::Complete } else { Linkage::Average };
        let expected = by_kodama(linkage, threshold, &points);

        let mut sets = Sets::new(linkage, threshold, &points);
        let merged = Clustering::new(points.len(), Some(threshold)).run(&mut sets, true, false);
        prop_assert_eq!(sets.partition(), expected.clone());
        prop_assert_eq!(usize::try_from(merged).unwrap(), points.len() - expected.len());

        let mut sets = Sets::new(linkage, threshold, &points);
        cluster_naively(&mut sets);
        prop_assert_eq!(sets.partition(), expected);
    }
}

//! Partitions the kinds seen into the classes of each template, one template after another.

use invariant::require;

use crate::hypotheses::key::{Key, MAX_FEATURES, Mask, field, present};

/// A kind of object to be classified.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    pub(crate) key: Key,
    pub(crate) count: EvidenceCount,
    /// Whether any example contains it; a queried kind does not make a class of its own.
    pub(crate) is_seen: bool,
}

/// The evidence about a kind or a class.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EvidenceCount {
    /// Number of changed objects minus number of left-out ones.
    pub(crate) net: i64,
    /// Whether any was changed.
    pub(crate) is_changed: bool,
}

/// An accumulator over the classes of one template.
pub(crate) trait ClassSum: Copy {
    /// Adds one class.
    fn with(self, class: EvidenceCount) -> Self;
}

/// The classes of a template that a further feature can still divide. A class of a single kind that has every
/// feature is final; it is only part of the sum.
#[derive(Clone, Debug, Default)]
pub(crate) struct Classes {
    /// Indices of the members, class by class.
    members: Vec<u32>,
    /// The end of each class in `members`, and its evidence.
    ends: Vec<(usize, EvidenceCount)>,
}

impl Classes {
    /// The member indices of each class, and its evidence.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&[u32], EvidenceCount)> {
        let begins = std::iter::once(0).chain(self.ends.iter().map(|(end, _)| *end));
        let ranges = begins.zip(&self.ends);
        ranges.map(|(begin, &(end, count))| (range(&self.members, begin, end), count))
    }
}

/// Visits every template over the features, with the sum over its classes and the classes that are not final.
/// `visit` returns whether to visit the extensions of a template by features of higher index.
///
/// A template with one more feature refines the classes of its parent. So each step costs one pass over the kinds
/// that are not alone in their class, and most kinds are alone after a few features.
pub(crate) fn each_template<S: ClassSum>(
    members: &[Member],
    features: usize,
    nothing: S,
    mut visit: impl FnMut(Mask, S, &Classes) -> bool,
) {
    let features = features.min(MAX_FEATURES);
    let all: Mask = (0..features).fold(0, |mask, feature| mask | 1 << feature);
    let column = |feature| members.iter().map(|one| field(one.key, feature)).collect();
    let mark = |one: &Member| MemberInfo {
        count: one.count,
        is_seen: one.is_seen,
        is_whole: present(one.key) & all == all,
    };
    let mut walk = TemplateWalk {
        columns: (0..features).map(column).collect(),
        member_infos: members.iter().map(mark).collect(),
        pool: Vec::new(),
        buckets: Buckets::default(),
        visit: &mut visit,
    };
    let together: Vec<u32> = (0..).take(members.len()).collect();
    let mut classes = Classes::default();
    let sums = walk.add(&together, Sums { settled: nothing, all: nothing }, &mut classes);
    walk.go(0, 0, sums, classes);
}

struct TemplateWalk<V> {
    /// The values, by feature and member.
    columns: Vec<Vec<u32>>,
    /// The precomputed properties, by member.
    member_infos: Vec<MemberInfo>,
    /// A pool of `Classes` buffers.
    pool: Vec<Classes>,
    buckets: Buckets,
    visit: V,
}

/// Precomputed properties of a member.
#[derive(Clone, Copy)]
struct MemberInfo {
    count: EvidenceCount,
    is_seen: bool,
    /// Whether it has every feature.
    is_whole: bool,
}

/// The sum over the final classes, and over all classes.
#[derive(Clone, Copy)]
struct Sums<S> {
    settled: S,
    all: S,
}

impl<V> TemplateWalk<V> {
    fn go<S: ClassSum>(&mut self, mask: Mask, begin: usize, sums: Sums<S>, classes: Classes)
    where
        V: FnMut(Mask, S, &Classes) -> bool,
    {
        let end = if (self.visit)(mask, sums.all, &classes) { self.columns.len() } else { begin };
        for feature in begin..end {
            let mut divided = self.pool.pop().unwrap_or_default();
            let sums = self.divide(&classes, feature, sums.settled, &mut divided);
            self.go(mask | 1 << feature, feature + 1, sums, divided);
        }
        self.pool.push(classes);
    }

    /// Divides every class by a feature; members without the feature are dropped.
    fn divide<S: ClassSum>(
        &mut self,
        classes: &Classes,
        feature: usize,
        settled: S,
        into: &mut Classes,
    ) -> Sums<S> {
        into.members.clear();
        into.ends.clear();
        let mut sums = Sums { settled, all: settled };
        let mut buckets = std::mem::take(&mut self.buckets);
        let column = require!(self.columns.get(feature), "feature {feature} exists");
        let column = column.map_or(&[][..], Vec::as_slice);
        for (members, _) in classes.iter() {
            buckets.fill(members, column);
            for bucket in buckets.iter() {
                sums = self.add(bucket, sums, into);
            }
        }
        self.buckets = buckets;
        sums
    }

    /// Adds a class, unless no example contains a member of it.
    #[inline]
    fn add<S: ClassSum>(&self, members: &[u32], sums: Sums<S>, into: &mut Classes) -> Sums<S> {
        let (mut count, mut is_seen, mut is_whole) = (EvidenceCount::default(), false, true);
        for mark in members.iter().filter_map(|&number| self.member_infos.get(number as usize)) {
            count.net += mark.count.net;
            count.is_changed |= mark.count.is_changed;
            is_seen |= mark.is_seen;
            is_whole &= mark.is_whole;
        }
        if !is_seen {
            return sums;
        }
        let all = sums.all.with(count);
        if members.len() == 1 && is_whole {
            // The class is final: it is the same under every extension of the template.
            return Sums { settled: sums.settled.with(count), all };
        }
        into.members.extend_from_slice(members);
        into.ends.push((into.members.len(), count));
        Sums { all, ..sums }
    }
}

/// Counting sort of members by their value of one feature, in the order of the values' first appearance.
#[derive(Debug, Default)]
struct Buckets {
    /// By value: the number of members, later the next free slot; zero between calls.
    counts: Vec<usize>,
    values: Vec<usize>,
    members: Vec<u32>,
    ends: Vec<usize>,
}

impl Buckets {
    fn fill(&mut self, members: &[u32], column: &[u32]) {
        let Self { counts, values, members: placed, ends } = self;
        let with_value = || {
            let valued = members.iter().filter_map(|&member| Some((member, *column.get(member as usize)?)));
            valued.filter(|(_, value)| *value != 0).map(|(member, value)| (member, value as usize))
        };
        for (_, value) in with_value() {
            if counts.len() <= value {
                counts.resize(value + 1, 0);
            }
            if let Some(count) = counts.get_mut(value) {
                if *count == 0 {
                    values.push(value);
                }
                *count += 1;
            }
        }
        let mut end = 0;
        ends.clear();
        for &value in values.iter() {
            if let Some(count) = counts.get_mut(value) {
                end += std::mem::replace(count, end);
                ends.push(end);
            }
        }
        placed.resize(end, 0);
        for (member, value) in with_value() {
            if let Some(next) = counts.get_mut(value)
                && let Some(place) = placed.get_mut(*next)
            {
                *place = member;
                *next += 1;
            }
        }
        for value in values.drain(..) {
            if let Some(count) = counts.get_mut(value) {
                *count = 0;
            }
        }
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins.zip(&self.ends).map(|(begin, &end)| range(&self.members, begin, end))
    }
}

/// The members of one class.
fn range(members: &[u32], begin: usize, end: usize) -> &[u32] {
    require!(members.get(begin..end), "the ends of classes ascend: {begin}, {end}").unwrap_or(&[])
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use proptest::prelude::*;

    use super::*;
    use crate::hypotheses::key::{key_mask, with_field};

    /// The number of classes, Σ net², and the number of classes with a changed object.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    struct Tally(i64, i64, i64);

    impl ClassSum for Tally {
        fn with(self, class: EvidenceCount) -> Self {
            Self(self.0 + 1, self.1 + class.net.pow(2), self.2 + i64::from(class.is_changed))
        }
    }

    proptest! {
        #[test]
        fn a_template_partitions_examples_by_its_features(kinds in prop::collection::vec(
            (prop::collection::vec(0..3_u32, 4), -2..3_i64, any::<bool>()), 1..30,
        )) {
            let members: Vec<Member> = kinds
                .iter()
                .map(|(values, net, is_seen)| Member {
                    key: (0..).zip(values).fold(0, |key, (feature, value)| with_field(key, feature, *value)),
                    count: EvidenceCount { net: if *is_seen { *net } else { 0 }, is_changed: *is_seen && *net > 0 },
                    is_seen: *is_seen,
                })
                .collect();
            let mut visited = BTreeSet::new();
            each_template(&members, 4, Tally::default(), |mask, tally, classes| {
                let mut expected: BTreeMap<Key, (EvidenceCount, bool, usize)> = BTreeMap::new();
                for one in members.iter().filter(|one| present(one.key) & mask == mask) {
                    let (count, is_seen, size) = expected.entry(one.key & key_mask(mask)).or_default();
                    count.net += one.count.net;
                    count.is_changed |= one.count.is_changed;
                    *is_seen |= one.is_seen;
                    *size += 1;
                }
                expected.retain(|_, (_, is_seen, _)| *is_seen);
                let sum = expected.values().fold(Tally::default(), |sum, (count, ..)| sum.with(*count));
                assert_eq!(tally, sum, "{mask:b}");
                for (together, count) in classes.iter() {
                    let key = members[together[0] as usize].key & key_mask(mask);
                    let (of_class, _, size) = expected[&key];
                    assert_eq!((together.len(), count.net), (size, of_class.net));
                }
                visited.insert(mask)
            });
            assert_eq!(visited.len(), 16, "each once");
        }

        #[test]
        fn no_extension_of_a_pruned_template_is_visited(end in 0..16_u16) {
            let member = Member { key: with_field(0, 0, 1), count: EvidenceCount::default(), is_seen: true };
            let mut visited = Vec::new();
            each_template(&[member], 4, Tally::default(), |mask, _, _| {
                visited.push(mask);
                mask != end
            });
            // Those that extend the template by features of higher index.
            let beyond = |mask: &u16| mask & end == end && mask != &end && (mask ^ end).trailing_zeros() >= 16 - end.leading_zeros();
            prop_assert!(!visited.iter().any(|mask| beyond(mask) && end != 0), "{visited:?}");
            prop_assert!(end != 0 || visited == [0]);
        }
    }
}

use clock::Instant;
use invariant::require;
use message::{Feature, MAX_PERCEPTS, Perceived, PerceptValue, Snapshot};

use super::gate_keys::GateKeys;
use super::metric::{Gate, Metric};
use super::problem::MemberSummary;
use super::settings::Tracking;
use super::track::Motion;
use super::tracks::Tracks;

/// The features that a storage remembers of each percept: all that the association needs of it.
pub(crate) trait FeatureStore {
    /// Whether [`Self::predict_feature`] can predict the features of a percept.
    fn is_predictable(&self, percept: u16) -> bool;

    /// The part of a feature that can be stored for a percept; `Feature::None` for a feature that the percept cannot
    /// derive.
    fn representable(&self, percept: u16, feature: Feature) -> Feature;

    /// Updates `newest` to the value that it will have once a sound sample newer than all others is added.
    fn predict_feature(&self, percept: u16, newest: &mut Option<Feature>, sample: &PerceptValue);

    /// The newest feature of a percept in a row.
    fn newest_feature(&self, row: u32, percept: u16) -> Option<Feature>;
}

/// What the association compares of the belief in each slot: the newest features, and the gate keys among them.
///
/// They are copies of what the [storage](FeatureStore) remembers, in contiguous arrays. With [tracks](Tracks), the
/// position is the expected one instead.
#[derive(Clone, Debug)]
pub(crate) struct Features {
    /// Per slot, the newest features that the metric compares, in the order of its terms.
    features: Box<[Option<Feature>]>,
    terms: Box<[u16]>,
    /// Per slot, those of its symbols that are gate keys.
    gate_keys: Box<[GateKeys]>,
    /// Whether the new value of each compared feature can be predicted from the old value and the new snapshot. False
    /// if a plug-in history keeps one of them.
    predictable: bool,
    metric: Metric,
    gate: Option<Gate>,
    /// `None` if the remembered position is compared.
    tracks: Option<Tracks>,
}

impl Features {
    /// Without features. `place` is the percept of the position. Without `tracking`, or if no position is compared, the
    /// remembered features are compared.
    pub(crate) fn new(
        metric: Metric,
        place: Option<u16>,
        slots: usize,
        store: &impl FeatureStore,
        tracking: Option<Tracking>,
    ) -> Self {
        let terms: Box<[u16]> = metric.percepts().collect();
        let gate = metric.gate(place);
        let compares_place = gate.is_some_and(|gate| terms.get(gate.term).copied() == place);
        Self {
            tracks: tracking.filter(|_| compares_place).map(|tracking| Tracks::new(tracking, slots)),
            predictable: terms.iter().all(|percept| store.is_predictable(*percept)),
            features: vec![None; slots * terms.len()].into_boxed_slice(),
            gate_keys: vec![GateKeys::NONE; slots].into_boxed_slice(),
            terms,
            gate,
            metric,
        }
    }

    /// The gate of the position.
    #[inline]
    pub(crate) fn gate(&self) -> Option<Gate> {
        self.gate
    }

    /// Whether the new value of each compared feature can be predicted from the old value and the new snapshot.
    #[inline]
    pub(crate) fn are_predictable(&self) -> bool {
        self.predictable
    }

    /// Whether position and symbols usually suffice to find the belief of a detection, and the belief's new features
    /// can be predicted before its histories are updated.
    pub(crate) fn suffice_by_summary(&self) -> bool {
        let finds = self.gate.is_some() && self.metric.weight_of_place().is_some();
        self.predictable && finds && self.terms.len() <= MAX_PERCEPTS
    }

    /// The newest features that the metric compares, in the order of its terms.
    #[inline]
    pub(crate) fn of(&self, slot: u32) -> &[Option<Feature>] {
        let start = slot as usize * self.terms.len();
        require!(self.features.get(start..start + self.terms.len()), "slot {slot} exists").unwrap_or(&[])
    }

    /// The newest remembered feature of a percept that the metric compares; `None` if it is not known here.
    #[inline]
    pub(crate) fn newest(&self, slot: u32, percept: u16) -> Option<Option<Feature>> {
        let term = self.terms.iter().position(|term| *term == percept)?;
        if self.tracks.is_some() && self.gate.is_some_and(|gate| gate.term == term) {
            return None;
        }
        Some(self.of(slot).get(term).copied().flatten())
    }

    /// The position by which a belief is gated.
    #[inline]
    pub(crate) fn place(&self, slot: u32) -> Option<[f32; 3]> {
        let Gate { term, .. } = self.gate?;
        self.of(slot).get(term).copied().flatten()?.vector()
    }

    /// The gate keys of a belief.
    #[inline]
    pub(crate) fn gate_keys(&self, slot: u32) -> GateKeys {
        let gate_keys = require!(self.gate_keys.get(slot as usize), "slot {slot} exists");
        gate_keys.copied().unwrap_or(GateKeys::NONE)
    }

    /// Whether the gate keys of the belief in `older` remain valid when it merges with another one. `newer` are the
    /// other's gate keys; `features` returns its features and is called only if needed.
    #[inline]
    pub(crate) fn keeps_gate_keys<F: AsRef<[Option<Feature>]>>(
        &self,
        older: u32,
        newer: GateKeys,
        features: impl FnOnce() -> Option<F>,
    ) -> bool {
        // If the position is the only other term, no other feature is a symbol: both members were found by position.
        if self.metric.weight_of_place().is_some()
            && self.gate_keys.get(older as usize).is_some_and(|older| older.is_subset_of(newer))
        {
            return true;
        }
        let is_symbol = |feature: &Feature| matches!(feature, Feature::Symbol(_));
        features().is_some_and(|newer| {
            self.of(older).iter().zip(newer.as_ref()).all(|(older, newer)| {
                let was_symbol = older.as_ref().is_some_and(is_symbol);
                !was_symbol || newer.as_ref().is_none_or(is_symbol)
            })
        })
    }

    /// D of two beliefs; `None` unless it is below the threshold.
    pub(crate) fn distance(&self, a: u32, b: u32) -> Option<f64> {
        self.metric.below_threshold(self.of(a), self.of(b))
    }

    /// D of a belief and some features in the order of the terms; `None` unless it is below the threshold.
    pub(crate) fn distance_to(&self, slot: u32, features: &[Option<Feature>]) -> Option<f64> {
        self.metric.below_threshold(self.of(slot), features)
    }

    /// `Some(d)` if the distance can be computed from position and symbols alone (`d` is `None` when above the
    /// threshold); `None` if the full feature rows are needed.
    #[inline]
    pub(crate) fn distance_from_summaries(
        &self,
        a: &MemberSummary,
        b: &MemberSummary,
    ) -> Option<Option<f64>> {
        let weight = self.metric.weight_of_place()?;
        let are_complete = a.gate_keys.are_complete() && b.gate_keys.are_complete();
        are_complete.then(|| self.metric.below_threshold_of(weight, a.place_m, b.place_m))
    }

    /// Upper bound on the pairwise distance of some beliefs: see [`Metric::diameter_bound`].
    pub(crate) fn diameter_bound(&self, members: &[u32]) -> Option<f64> {
        self.metric.diameter_bound(&members.iter().map(|&slot| self.of(slot)))
    }

    /// Sets the features of a new belief from an observation made at `at`. `prevalidated`: the caller has validated the
    /// snapshot.
    #[inline]
    pub(crate) fn set(
        &mut self,
        slot: u32,
        at: Instant,
        perceived: &Perceived,
        prevalidated: bool,
        store: &impl FeatureStore,
    ) {
        let snapshot = &perceived.snapshot;
        self.update(slot, |percept, feature| *feature = feature_in(snapshot, percept, prevalidated, store));
        let place = self.place(slot);
        if let Some(tracks) = &mut self.tracks {
            let sighting = place.map(|place| tracks.sighting(at, place, &perceived.observation));
            tracks.begin(slot, sighting);
        }
    }

    /// Changes the features of a belief, and with them its gate keys. `change` gets the percept and the feature of each
    /// term.
    #[inline(always)]
    fn update(&mut self, slot: u32, change: impl Fn(u16, &mut Option<Feature>)) {
        let terms = self.terms.len();
        let features = self.features.get_mut(slot as usize * terms..(slot as usize + 1) * terms);
        let row = features.zip(self.gate_keys.get_mut(slot as usize));
        let Some((features, gate_keys)) = require!(row, "slot {slot} exists") else { return };
        for (feature, percept) in features.iter_mut().zip(&self.terms) {
            change(*percept, feature);
        }
        *gate_keys = self.metric.gate_keys_of(features);
    }

    /// Updates the features of the belief in `kept` to the values they have once it has stored the snapshot that is the
    /// belief in `gone`.
    #[inline]
    pub(crate) fn append(&mut self, kept: u32, gone: u32, store: &impl FeatureStore) {
        let terms = self.terms.len();
        let row = |slot: u32| slot as usize * terms..(slot as usize + 1) * terms;
        if let Ok([features, newer]) = self.features.get_disjoint_mut([row(kept), row(gone)]) {
            for ((feature, newer), percept) in features.iter_mut().zip(newer).zip(&self.terms) {
                if let Some(newer) = newer {
                    let newer = PerceptValue::new(*percept, 1.0, 1.0, *newer);
                    store.predict_feature(*percept, feature, &newer);
                }
            }
            // The symbols are usually equal.
            if let Ok([gate_keys, newer]) = self.gate_keys.get_disjoint_mut([kept as usize, gone as usize])
                && (gate_keys != newer || !newer.are_complete())
            {
                *gate_keys = self.metric.gate_keys_of(features);
            }
        }
        self.merge_tracks(kept, gone);
    }

    /// Updates the features of a belief to the values they have once it has stored an observation made at `at`, which
    /// is newer than all its samples. `newer` are the gate keys of the snapshot.
    #[inline]
    pub(crate) fn predict(
        &mut self,
        slot: u32,
        at: Instant,
        perceived: &Perceived,
        newer: GateKeys,
        prevalidated: bool,
        store: &impl FeatureStore,
    ) {
        let snapshot = &perceived.snapshot;
        // Usually the symbols are unchanged, and only the position needs an update.
        if self.gate_keys.get(slot as usize) == Some(&newer)
            && self.metric.cover_all_terms(newer)
            && let Some(Gate { term, .. }) = self.gate
        {
            let feature = self.features.get_mut(slot as usize * self.terms.len() + term);
            if let (Some(feature), Some(percept)) = (feature, self.terms.get(term))
                && let Some(value) = evaluation(snapshot, *percept, prevalidated)
            {
                store.predict_feature(*percept, feature, value);
            }
        } else {
            self.predict_all(slot, snapshot, prevalidated, store);
        }
        if let Some(tracks) = &mut self.tracks
            && let Some(Gate { term, .. }) = self.gate
            && let Some(percept) = self.terms.get(term)
            && let Some(position_m) =
                feature_in(snapshot, *percept, prevalidated, store).and_then(Feature::vector)
        {
            let sighting = tracks.sighting(at, position_m, &perceived.observation);
            let expected = tracks.add(slot, &sighting);
            self.set_place(slot, expected);
        }
    }

    /// Merges the track of the belief in `gone` into that of the one in `kept`.
    fn merge_tracks(&mut self, kept: u32, gone: u32) {
        if let Some(tracks) = &mut self.tracks {
            let expected = tracks.merge(kept, gone);
            self.set_place(kept, expected);
        }
    }

    /// Compares the position of a belief by where it is expected.
    #[inline]
    fn set_place(&mut self, slot: u32, expected: Option<[f32; 3]>) {
        if let Some(Gate { term, .. }) = self.gate
            && let Some(feature) = self.features.get_mut(slot as usize * self.terms.len() + term)
        {
            *feature = expected.map(Feature::Vector);
        }
    }

    /// Compares the belief in the slot from now on by the position that is expected at an instant. Returns whether
    /// positions are predicted.
    #[inline]
    pub(crate) fn expect_at(&mut self, slot: u32, instant: Instant) -> bool {
        let Some(tracks) = &self.tracks else { return false };
        let expected = tracks.position_m(slot, instant);
        self.set_place(slot, expected);
        true
    }

    /// Whether positions are predicted, and by which settings.
    #[inline]
    pub(crate) fn tracking(&self) -> Option<&Tracking> {
        self.tracks.as_ref().map(|tracks| &tracks.settings)
    }

    /// The expected motion of a belief; `None` if positions are not predicted, or the belief has none.
    pub(crate) fn motion(&self, slot: u32, instant: Instant) -> Option<Motion> {
        self.tracks.as_ref()?.motion(slot, instant)
    }

    /// D of a belief and a new one whose position is outside the gate of the metric, but within that of the
    /// [track](Tracks::share_of_gate), or on its [way](Tracks::share_along_way): this share takes the place of metres, so
    /// that D is the threshold at the gate. `None` unless D is below the threshold.
    pub(crate) fn distance_along_track(&self, old: u32, fresh: u32, is_hidden: bool) -> Option<f64> {
        let (tracks, Gate { term, metres, .. }) = (self.tracks.as_ref()?, self.gate?);
        let share = if is_hidden {
            tracks.share_along_way(old, fresh, metres)?
        } else {
            tracks.share_of_gate(old, fresh, metres)?
        };
        let mut at_one_place = [None; MAX_PERCEPTS];
        let of_old = self.of(old);
        at_one_place.iter_mut().zip(of_old).for_each(|(feature, of_old)| *feature = *of_old);
        *at_one_place.get_mut(term)? = *self.of(fresh).get(term)?;
        let others = self.metric.below_threshold(at_one_place.get(..of_old.len())?, self.of(fresh))?;
        self.metric.if_below_threshold(others + share * self.metric.threshold())
    }

    /// Moves the belief in the slot with what carries it: it is at a position at an instant and has a velocity.
    pub(crate) fn carry(
        &mut self,
        slot: u32,
        instant: Instant,
        position_m: [f32; 3],
        velocity_m_s: [f32; 3],
    ) {
        if let Some(tracks) = &mut self.tracks {
            tracks.carry(slot, instant, position_m, velocity_m_s);
            self.expect_at(slot, instant);
        }
    }

    /// Expresses the track of a belief in another frame, and compares its position in that frame.
    pub(crate) fn reanchor(
        &mut self,
        slot: u32,
        position: impl Fn([f32; 3]) -> [f32; 3],
        rotation: &[[f64; 3]; 3],
    ) {
        if let Some(tracks) = &mut self.tracks {
            tracks.reanchor(slot, position, rotation);
            if let Some(at) = tracks.at(slot) {
                self.expect_at(slot, at);
            }
        }
    }

    /// Like [`Self::predict`], for every compared feature.
    #[inline(never)]
    fn predict_all(&mut self, slot: u32, snapshot: &Snapshot, prevalidated: bool, store: &impl FeatureStore) {
        self.update(slot, |percept, feature| {
            if let Some(value) = evaluation(snapshot, percept, prevalidated) {
                store.predict_feature(percept, feature, value);
            }
        });
    }

    /// Recomputes the features and symbols of a belief from its row in the storage. `united` is the belief that was
    /// merged into it, if that is the reason.
    pub(crate) fn refresh(&mut self, slot: u32, row: u32, united: Option<u32>, store: &impl FeatureStore) {
        let place = self.place(slot);
        self.update(slot, |percept, feature| *feature = store.newest_feature(row, percept));
        if self.tracks.is_some() {
            self.set_place(slot, place);
        }
        if let Some(gone) = united {
            self.merge_tracks(slot, gone);
        }
    }

    /// Position and gate keys of a snapshot.
    #[inline(always)]
    pub(crate) fn summary(
        &self,
        snapshot: &Snapshot,
        prevalidated: bool,
        store: &impl FeatureStore,
    ) -> (Option<[f32; 3]>, GateKeys) {
        let feature = |term: usize| feature_in(snapshot, *self.terms.get(term)?, prevalidated, store);
        let place = self.gate.and_then(|Gate { term, .. }| feature(term)?.vector());
        (place, self.metric.gate_keys(feature))
    }

    /// The features of a snapshot that the metric compares, in the order of its terms.
    pub(crate) fn features_in(
        &self,
        snapshot: &Snapshot,
        prevalidated: bool,
        store: &impl FeatureStore,
    ) -> [Option<Feature>; MAX_PERCEPTS] {
        let mut features = [None; MAX_PERCEPTS];
        for (feature, percept) in features.iter_mut().zip(&self.terms) {
            *feature = feature_in(snapshot, *percept, prevalidated, store);
        }
        features
    }

    /// Checks that the features of a belief are those of its row in the storage.
    #[cfg(test)]
    pub(crate) fn assert_are_stored(&self, slot: u32, row: u32, store: &impl FeatureStore) {
        for (feature, percept) in self.of(slot).iter().zip(&self.terms) {
            let newest = store.newest_feature(row, *percept);
            let is_tracked = self.newest(slot, *percept).is_none();
            assert!(is_tracked || *feature == newest, "what was clustered by is what is remembered");
        }
        assert_eq!(self.gate_keys[slot as usize], self.metric.gate_keys_of(self.of(slot)));
    }
}

/// The feature of a percept in a snapshot.
#[inline(always)]
fn feature_in(
    snapshot: &Snapshot,
    percept: u16,
    prevalidated: bool,
    store: &impl FeatureStore,
) -> Option<Feature> {
    let value = evaluation(snapshot, percept, prevalidated)?;
    Some(store.representable(percept, value.sound_feature()))
}

/// The evaluation of a percept in a snapshot, if it is valid. `prevalidated`: the caller has validated the snapshot.
#[inline(always)]
fn evaluation(snapshot: &Snapshot, percept: u16, prevalidated: bool) -> Option<&PerceptValue> {
    snapshot.value(percept).filter(|value| prevalidated || value.is_sound())
}

use std::cmp::Ordering;

use clock::Instant;
use message::{Feature, PerceptValue};
use quantity::number::single;

use crate::storage::sample::Sample;
use crate::storage::stored_sample::{SampleRef, StoredSample};

/// The low-pass history: y = a·x + (1 − a)·y, with a the share of the newest sample x.
///
/// Numbers and vectors are filtered component by component, orientations on the unit sphere. Symbols are not filtered:
/// the newest holds. It stores no past: any instant from its first sample on is answered with the present value. A
/// caller that needs the past takes a snapshot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LowPass {
    filter: Option<Filter>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Filter {
    first_at: Instant,
    /// The newest sample, unfiltered.
    newest: StoredSample,
    samples: u32,
    /// y
    value: Feature,
    /// y before the newest sample: needed when a better sample of the same instant arrives.
    before: Option<Feature>,
}

impl LowPass {
    pub(crate) fn newest(&self) -> Option<Sample> {
        self.filter.map(|filter| filter.present())
    }

    #[inline(always)]
    pub(crate) fn at(&self, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        let filter = self.filter.filter(|filter| filter.first_at <= instant)?;
        Some(filter.present().decayed(instant, decay_per_s))
    }

    pub(crate) fn map(&mut self, change: impl Fn(Feature) -> Feature) {
        if let Some(filter) = &mut self.filter {
            filter.newest = filter.newest.with(change(filter.newest.feature()));
            filter.value = change(filter.value);
            filter.before = filter.before.map(change);
        }
    }

    /// Adds a sample, with a the `share` of the newest.
    #[inline]
    pub(crate) fn take(&mut self, sample: SampleRef<'_>, share: f64) {
        match &mut self.filter {
            // The common case, updated in place.
            Some(filter) if filter.newest.at < sample.at => {
                filter.before = Some(filter.value);
                mix_into(sample.value, share, &mut filter.value, 1.0 - share);
                filter.newest = sample.kept();
                filter.samples = filter.samples.saturating_add(1);
            }
            _ => self.add_slow_path(sample.kept(), share),
        }
    }

    #[cold]
    #[inline(never)]
    fn add_slow_path(&mut self, sample: StoredSample, share: f64) {
        self.merge(&Self::of(sample), share);
    }

    /// Filters the later history on top of the earlier one. If the later one has one sample, which is the common case,
    /// this is the recurrence itself. The samples of two longer histories can no longer be separated, so the later one
    /// is weighted by its number of samples.
    pub(crate) fn merge(&mut self, other: &Self, share: f64) {
        self.filter = match (self.filter, other.filter) {
            (Some(a), Some(b)) if a.order(&b) == Ordering::Less => Some(chain(&a, &b, share)),
            (Some(a), Some(b)) => Some(chain(&b, &a, share)),
            (one, None) | (None, one) => one,
        };
    }

    /// g(m, c, d) = h: the history of one sample.
    fn of(sample: StoredSample) -> Self {
        let filter =
            Filter { first_at: sample.at, newest: sample, samples: 1, value: sample.feature(), before: None };
        Self { filter: Some(filter) }
    }
}

impl Filter {
    fn present(&self) -> Sample {
        Sample { feature: self.value, ..self.newest.sample() }
    }

    /// Orders by time; ties are broken by the values, so that merging is commutative.
    fn order(&self, other: &Self) -> Ordering {
        (self.newest.at.cmp(&other.newest.at))
            .then_with(|| self.newest.rank(&other.newest))
            .then_with(|| self.samples.cmp(&other.samples))
            .then_with(|| self.value.total_cmp(&other.value))
            .then_with(|| match (&self.before, &other.before) {
                (Some(a), Some(b)) => a.total_cmp(b),
                (a, b) => a.is_some().cmp(&b.is_some()),
            })
    }
}

/// `later` filtered on top of `earlier`. If both end at one instant, `earlier` is the one whose last sample ranks
/// lower, and that sample is removed.
fn chain(earlier: &Filter, later: &Filter, share: f64) -> Filter {
    let same_instant = earlier.newest.at == later.newest.at;
    let past = if same_instant { earlier.before } else { Some(earlier.value) };
    let first_at = earlier.first_at.min(later.first_at);
    let Some(past) = past else { return Filter { first_at, ..*later } };
    let before = match later.before {
        Some(before) => filtered(&before, &past, later.samples.saturating_sub(1), share),
        None => past,
    };
    Filter {
        first_at,
        newest: later.newest,
        samples: earlier.samples.saturating_add(later.samples).saturating_sub(u32::from(same_instant)),
        value: filtered(&later.value, &past, later.samples, share),
        before: Some(before),
    }
}

/// The value after `samples` samples, filtered among themselves to `value`, are added on top of `past`.
fn filtered(value: &Feature, past: &Feature, samples: u32, share: f64) -> Feature {
    let (new, old) = match samples {
        0 | 1 => (share, 1.0 - share),
        more => {
            let old = (1.0 - share).powi(i32::try_from(more).unwrap_or(i32::MAX));
            (1.0 - old, old)
        }
    };
    mix(value, new, past, old)
}

/// a·x + b·y for two features of one kind, with a + b = 1; x for others.
fn mix(x: &Feature, a: f64, y: &Feature, b: f64) -> Feature {
    let mut mixed = *y;
    mix_into(&PerceptValue::new(0, 1.0, 1.0, *x), a, &mut mixed, b);
    mixed
}

/// [`mix`] in place of y, for the feature of a sound evaluation. Inlined, so that x is not first assembled in memory.
#[inline(always)]
pub(super) fn mix_into(x: &PerceptValue, a: f64, y: &mut Feature, b: f64) {
    let weigh = |x: f32, y: f32| single(a * f64::from(x) + b * f64::from(y));
    let (kind, [p, q, r, s]) = x.raw_feature();
    match (y, kind) {
        (Feature::Number(y), Feature::NUMBER) => *y = weigh(p, *y),
        (Feature::Vector([u, v, w]), Feature::VECTOR) => {
            (*u, *v, *w) = (weigh(p, *u), weigh(q, *v), weigh(r, *w));
        }
        (Feature::Orientation(y), Feature::ORIENTATION) => *y = mix_on_sphere([p, q, r, s], a, *y, b),
        (y, _) => hold(x, y),
    }
}

/// For features that are not filtered, or of another kind than before, the newest holds.
#[cold]
#[inline(never)]
fn hold(x: &PerceptValue, y: &mut Feature) {
    *y = x.sound_feature();
}

/// The weighted mean of two unit quaternions along the shorter arc; x if there is none.
#[inline]
fn mix_on_sphere(x: [f32; 4], a: f64, y: [f32; 4], b: f64) -> [f32; 4] {
    let (wide_x, wide_y) = (x.map(f64::from), y.map(f64::from));
    let cosine = dot(wide_x, wide_y);
    // Most things do not turn.
    if x.map(f32::to_bits) == y.map(f32::to_bits) && (cosine - 1.0).abs() < ROUNDED {
        return y;
    }
    // q and −q are the same orientation.
    let b = if cosine < 0.0 { -b } else { b };
    let mut mean = wide_x;
    for (x, y) in mean.iter_mut().zip(&wide_y) {
        *x = a * *x + b * y;
    }
    let squared = dot(mean, mean);
    let excess = squared - 1.0;
    let scale = if excess.abs() < SMALL {
        1.0 + excess * (0.375 * excess - 0.5)
    } else if squared > 1e-12 {
        1.0 / squared.sqrt()
    } else {
        return x;
    };
    mean.map(|part| single(part * scale))
}

/// Largest deviation from one of the squared norm of a quaternion with rounded components.
const ROUNDED: f64 = 1e-6;

/// For such e the series of 1/√(1 + e) up to e² is exact but for 4e-10, a hundredth of the rounding.
const SMALL: f64 = 1e-3;

/// Pairwise sum, for a shorter dependency chain: the filter's square root waits for it.
#[inline]
fn dot([p, q, r, s]: [f64; 4], [t, u, v, w]: [f64; 4]) -> f64 {
    (p * t + q * u) + (r * v + s * w)
}

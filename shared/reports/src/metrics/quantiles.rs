use std::time::Duration;

use message::Histogram;
use serde::Serialize;

/// Quantiles of a histogram in microseconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quantiles {
    /// Number of values.
    pub count: u64,
    /// Median.
    pub p50: f64,
    /// 99 % quantile.
    pub p99: f64,
    /// 99.9 % quantile.
    pub p999: f64,
    /// Maximum.
    pub max: f64,
}

impl Quantiles {
    /// The quantiles of a histogram.
    #[must_use]
    pub fn of(histogram: &Histogram) -> Self {
        let micros = |nanos: u64| Duration::from_nanos(nanos).as_secs_f64() * 1e6;
        Self {
            count: histogram.count(),
            p50: micros(histogram.quantile_ns(0.5)),
            p99: micros(histogram.quantile_ns(0.99)),
            p999: micros(histogram.quantile_ns(0.999)),
            max: micros(histogram.max_ns()),
        }
    }
}

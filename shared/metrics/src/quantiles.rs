use std::time::Duration;

use message::Histogram;
use serde::Serialize;

/// A distribution in microseconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quantiles {
    /// How many.
    pub count: u64,
    /// Half are not above.
    pub p50: f64,
    /// 99 % are not above.
    pub p99: f64,
    /// 99.9 % are not above.
    pub p999: f64,
    /// None is above.
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

//! Sums of numbers that are given by their logarithms.

/// A term this many nats below the largest term of a sum is lost to floating-point rounding.
pub(crate) const ROUNDING_NATS: f64 = 40.0;

/// Log-sum-exp accumulator: adds numbers given by their logarithms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogSum {
    max: f64,
    scaled: f64,
}

impl Default for LogSum {
    fn default() -> Self {
        Self { max: f64::NEG_INFINITY, scaled: 0.0 }
    }
}

impl LogSum {
    pub(crate) fn add(&mut self, log: f64) {
        if log > self.max {
            self.scaled = self.scaled.mul_add((self.max - log).exp(), 1.0);
            self.max = log;
        } else if log > f64::NEG_INFINITY {
            self.scaled += (log - self.max).exp();
        }
    }

    pub(crate) fn value(&self) -> f64 {
        if self.scaled > 0.0 { self.max + self.scaled.ln() } else { f64::NEG_INFINITY }
    }
}

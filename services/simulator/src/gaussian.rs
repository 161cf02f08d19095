use quantity::number::float;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Seeded normally distributed numbers (Box-Muller transform).
#[derive(Clone, Debug)]
pub(crate) struct Gaussian {
    rng: ChaCha8Rng,
    spare: Option<f64>,
}

impl Gaussian {
    pub(crate) fn new(seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), spare: None }
    }

    /// The next number, of mean zero and standard deviation one.
    pub(crate) fn next(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * self.uniform()).sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }

    /// Uniform in (0, 1]: zero has no logarithm.
    fn uniform(&mut self) -> f64 {
        const BITS: u32 = 53;
        float((self.rng.next_u64() >> (u64::BITS - BITS)) + 1) / float(1 << BITS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaussian_numbers_have_mean_zero_and_deviation_one() {
        let mut gaussian = Gaussian::new(1);
        let numbers: Vec<f64> = (0..100_000).map(|_| gaussian.next()).collect();
        let mean = numbers.iter().sum::<f64>() / 1e5;
        let variance = numbers.iter().map(|number| (number - mean).powi(2)).sum::<f64>() / 1e5;
        let beyond_two = numbers.iter().filter(|number| number.abs() > 2.0).count();
        assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
        assert!((4_300..4_800).contains(&beyond_two), "4550 expected, {beyond_two} seen");
    }
}

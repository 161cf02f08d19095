use crate::BudgetError;

/// Expanded size in bytes that is allowed for any file, however short.
const EXPANSION_FLOOR: u64 = 256 << 20;
/// Additional expanded size per byte read. The recorder's compression has a ratio of at most 255.
const EXPANSION_RATIO: u64 = 1024;
/// Memory in bytes that is allowed for any file.
const MEMORY_FLOOR: u64 = 64 << 20;
/// Additional memory per byte read.
const MEMORY_RATIO: u64 = 16;

/// Resource limit for processing a file: a fixed amount, plus an amount for each byte read.
///
/// So the cost may grow with the length of a file, and a short file cannot cause a large cost.
///
/// ```
/// let mut budget = budget::Budget::expansion();
/// budget.set_read_bytes(1000);
/// assert!(budget.spend(100 << 20).is_ok());
/// assert!(budget.spend(200 << 20).is_err());
/// ```
#[derive(Clone, Debug)]
pub struct Budget {
    kind: Kind,
    read_bytes: u64,
    spent_bytes: u64,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Expansion,
    /// With the remedy to report if the limit is exceeded.
    Memory(&'static str),
}

impl Budget {
    /// A limit for the decompressed size.
    #[must_use]
    pub const fn expansion() -> Self {
        Self { kind: Kind::Expansion, read_bytes: 0, spent_bytes: 0 }
    }

    /// A limit for the memory kept; `advice` is the remedy to report if it is exceeded.
    #[must_use]
    pub const fn memory(advice: &'static str) -> Self {
        Self { kind: Kind::Memory(advice), read_bytes: 0, spent_bytes: 0 }
    }

    /// Sets the number of bytes read so far.
    pub fn set_read_bytes(&mut self, bytes: u64) {
        self.read_bytes = bytes;
    }

    /// Number of bytes read so far.
    #[must_use]
    pub fn read_bytes(&self) -> u64 {
        self.read_bytes
    }

    /// Charges `bytes`; to be called before they are allocated.
    ///
    /// # Errors
    ///
    /// The limit for the bytes read so far is exceeded.
    pub fn spend(&mut self, bytes: u64) -> Result<(), BudgetError> {
        let spent = self.spent_bytes.saturating_add(bytes);
        let max_bytes = self.max_bytes();
        if spent > max_bytes {
            return Err(match self.kind {
                Kind::Expansion => BudgetError::Expansion { read_bytes: self.read_bytes, max_bytes },
                Kind::Memory(advice) => BudgetError::Memory { max_bytes, advice },
            });
        }
        self.spent_bytes = spent;
        Ok(())
    }

    /// Resets the charged amount, because the data is no longer kept.
    pub fn clear(&mut self) {
        self.spent_bytes = 0;
    }

    fn max_bytes(&self) -> u64 {
        let (floor, ratio) = match self.kind {
            Kind::Expansion => (EXPANSION_FLOOR, EXPANSION_RATIO),
            Kind::Memory(_) => (MEMORY_FLOOR, MEMORY_RATIO),
        };
        self.read_bytes.saturating_mul(ratio).saturating_add(floor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_grows_with_the_file_and_released_bytes_return() {
        let mut budget = Budget::memory("split it");
        budget.spend(MEMORY_FLOOR).unwrap();
        let error = budget.spend(1).unwrap_err();
        assert!(
            matches!(error, BudgetError::Memory { max_bytes: MEMORY_FLOOR, advice: "split it" }),
            "{error:?}"
        );
        budget.set_read_bytes(1);
        budget.spend(MEMORY_RATIO).unwrap();
        assert!(budget.spend(1).is_err());
        budget.clear();
        budget.spend(MEMORY_FLOOR + MEMORY_RATIO).unwrap();
        assert!(budget.spend(u64::MAX).is_err());
        assert_eq!(budget.read_bytes(), 1);
    }
}

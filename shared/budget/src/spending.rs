use crate::BudgetError;

/// What any file may expand to, in bytes, however short it is ...
const EXPANSION_FLOOR: u64 = 256 << 20;
/// ... and for each of its bytes so many more. The recorder's compression saves a factor of 255 at most.
const EXPANSION_RATIO: u64 = 1024;
/// What may be kept in memory of any file, in bytes ...
const MEMORY_FLOOR: u64 = 64 << 20;
/// ... and for each of its bytes so many more.
const MEMORY_RATIO: u64 = 16;

/// What a file may cost: a fixed amount, and more for each byte of it that was read.
///
/// So the cost of a long file grows with its length, and a short one cannot be made to cost much.
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
    /// What to do where it is exceeded.
    Memory(&'static str),
}

impl Budget {
    /// For what is decompressed.
    #[must_use]
    pub const fn expansion() -> Self {
        Self { kind: Kind::Expansion, read_bytes: 0, spent_bytes: 0 }
    }

    /// For what is kept in memory; `advice` says what to do where it is too much.
    #[must_use]
    pub const fn memory(advice: &'static str) -> Self {
        Self { kind: Kind::Memory(advice), read_bytes: 0, spent_bytes: 0 }
    }

    /// Notes how many bytes were read up to now.
    pub fn set_read_bytes(&mut self, bytes: u64) {
        self.read_bytes = bytes;
    }

    /// Bytes that were read.
    #[must_use]
    pub fn read_bytes(&self) -> u64 {
        self.read_bytes
    }

    /// Spends `bytes`, before they are made.
    ///
    /// # Errors
    ///
    /// More would be spent than the bytes read allow.
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

    /// Gives all back that was spent: what was kept is kept no longer.
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
    fn a_longer_file_may_cost_more_and_what_is_given_back_can_be_spent_again() {
        let mut budget = Budget::memory("split it");
        budget.spend(MEMORY_FLOOR).unwrap();
        let error = budget.spend(1).unwrap_err();
        assert_eq!(error.to_string(), "what is to be kept of it needs more than 64 MiB of memory: split it");
        budget.set_read_bytes(1);
        budget.spend(MEMORY_RATIO).unwrap();
        assert!(budget.spend(1).is_err());
        budget.clear();
        budget.spend(MEMORY_FLOOR + MEMORY_RATIO).unwrap();
        assert!(budget.spend(u64::MAX).is_err());
        assert_eq!(budget.read_bytes(), 1);
    }
}

use std::fmt;

/// Hardware Error Status (address 70 of the control table), one bit per error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HardwareErrors(pub u8);

/// The defined bits and their meanings.
const MEANINGS: [(u8, &str); 5] = [
    (1 << 0, "input voltage out of range"),
    (1 << 2, "overheating"),
    (1 << 3, "encoder trouble"),
    (1 << 4, "electrical shock or not enough power"),
    (1 << 5, "overload"),
];

impl HardwareErrors {
    /// Whether no error is set.
    #[must_use]
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }
}

impl fmt::Display for HardwareErrors {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (bit, meaning) in MEANINGS {
            if self.0 & bit != 0 {
                write!(out, "{separator}{meaning}")?;
                separator = ", ";
            }
        }
        let known = MEANINGS.iter().fold(0, |bits, (bit, _)| bits | bit);
        match self.0 & !known {
            0 if self.0 == 0 => out.write_str("no hardware error"),
            0 => Ok(()),
            unknown => write!(out, "{separator}error bits {unknown:#04x}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hardware_error_bit_has_a_name() {
        let bits = (0..8).map(|bit| 1 << bit).chain([0, 0b10_0100, 0b100_0001]);
        let wording: Vec<String> = bits.map(|bits| format!("{bits:#04x} {}", HardwareErrors(bits))).collect();
        insta::assert_snapshot!(wording.join("\n"));
    }
}

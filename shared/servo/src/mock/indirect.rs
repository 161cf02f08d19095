use crate::Model;
use crate::table::{Entry, entries};

/// Indirect addressing: indirect data registers are aliases of bytes elsewhere in the table.
#[derive(Clone, Debug)]
pub(super) struct Indirect {
    /// For each pair the address of the indirect address register, and of its data register.
    pairs: Vec<(u16, u16)>,
    /// Whether any pair is redirected away from its own data register.
    pub(super) is_used: bool,
}

impl Indirect {
    pub(super) fn new(model: Model) -> Self {
        let of = |name| entries(model).filter(move |entry: &Entry| entry.name == name);
        let pairs = of("indirect_address").zip(of("indirect_data"));
        let pairs = pairs.map(|(address, data)| (address.item.address, data.item.address)).collect();
        Self { pairs, is_used: false }
    }

    /// Updates whether any pair is redirected.
    pub(super) fn update_used(&mut self, bytes: &[u8]) {
        self.is_used = self.pairs.iter().any(|&(address, data)| target(bytes, address) != Some(data));
    }

    /// Copies the target bytes to the data registers.
    pub(super) fn refresh(&mut self, bytes: &mut [u8]) {
        if !self.is_used {
            return;
        }
        self.update_used(bytes);
        for &(address, data) in &self.pairs {
            let byte = target(bytes, address).and_then(|target| bytes.get(usize::from(target)).copied());
            if let (Some(byte), Some(place)) = (byte, bytes.get_mut(usize::from(data))) {
                *place = byte;
            }
        }
    }

    /// Resolves a write to its targets: runs of bytes at consecutive addresses.
    pub(super) fn runs(&self, address: u16, data: &[u8], bytes: &[u8]) -> Vec<(u16, Vec<u8>)> {
        let mut runs: Vec<(u16, Vec<u8>)> = Vec::new();
        for (at, &byte) in (address..).zip(data) {
            let pair = self.pairs.iter().find(|(_, data)| *data == at);
            let at = pair.and_then(|&(address, _)| target(bytes, address)).unwrap_or(at);
            match runs.last_mut() {
                Some((start, run)) if usize::from(*start) + run.len() == usize::from(at) => run.push(byte),
                _ => runs.push((at, vec![byte])),
            }
        }
        runs
    }
}

fn target(bytes: &[u8], address: u16) -> Option<u16> {
    let at = usize::from(address);
    let &[low, high] = bytes.get(at..at + 2)? else { return None };
    Some(u16::from_le_bytes([low, high]))
}

/// Every layout of this version, byte by byte. A test compares the file with the compiler's layouts.
const WRITTEN_DOWN: &str = include_str!("../tests/layout.txt");

/// Hash (FNV-1a, 64 bits) of the layouts of all shared types. Programs with different hashes cannot share memory.
#[must_use]
pub fn layouts() -> u64 {
    hash(WRITTEN_DOWN.bytes())
}

/// A number that differs between texts: FNV-1a of their bytes.
pub fn hash(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// Every layout of this version, byte by byte: a test holds the file to what the compiler makes.
const WRITTEN_DOWN: &str = include_str!("../tests/layout.txt");

/// A number for the layouts of all shared types (FNV-1a, 64 bits). Where two programs have different ones, they do not
/// mean the same by the bytes that they share.
#[must_use]
pub fn layouts() -> u64 {
    WRITTEN_DOWN.bytes().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

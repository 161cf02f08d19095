//! Common Data Representation, little-endian, as used by ROS 2 (OMG DDS-XTypes 1.3, 7.4.1; encoding version 1). Every
//! number is aligned to its size, relative to the end of the four-byte encapsulation header.

/// Encapsulation header: plain CDR, little-endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Serialises one message.
#[derive(Clone, Debug)]
pub(crate) struct Cdr(Vec<u8>);

impl Cdr {
    pub(crate) fn new() -> Self {
        Self(ENCAPSULATION.to_vec())
    }

    pub(crate) fn finish(self) -> Vec<u8> {
        self.0
    }

    fn align(&mut self, size: usize) {
        let written = self.0.len() - ENCAPSULATION.len();
        self.0.resize(ENCAPSULATION.len() + written.next_multiple_of(size), 0);
    }

    fn put<const SIZE: usize>(&mut self, bytes: [u8; SIZE]) {
        self.align(SIZE);
        self.0.extend_from_slice(&bytes);
    }

    pub(crate) fn u8(&mut self, number: u8) {
        self.0.push(number);
    }

    pub(crate) fn bool(&mut self, is_so: bool) {
        self.u8(u8::from(is_so));
    }

    pub(crate) fn u32(&mut self, number: u32) {
        self.put(number.to_le_bytes());
    }

    pub(crate) fn i32(&mut self, number: i32) {
        self.put(number.to_le_bytes());
    }

    pub(crate) fn f32(&mut self, number: f32) {
        self.put(number.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, number: f64) {
        self.put(number.to_le_bytes());
    }

    /// The length of a sequence; its elements follow.
    pub(crate) fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).unwrap_or(u32::MAX));
    }

    /// A string; it ends with a zero byte, which its length includes.
    pub(crate) fn string(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }

    /// An array of fixed length.
    pub(crate) fn f64s(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.f64(*number));
    }

    /// A sequence of numbers.
    pub(crate) fn f64_sequence(&mut self, numbers: &[f64]) {
        self.length(numbers.len());
        self.f64s(numbers);
    }

    /// `builtin_interfaces/Time`.
    pub(crate) fn time(&mut self, at_ns: u64) {
        const SECOND: u64 = 1_000_000_000;
        self.i32(i32::try_from(at_ns / SECOND).unwrap_or(i32::MAX));
        self.u32(u32::try_from(at_ns % SECOND).unwrap_or(0));
    }

    /// `std_msgs/Header`.
    pub(crate) fn header(&mut self, at_ns: u64, frame: &str) {
        self.time(at_ns);
        self.string(frame);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size_and_texts_end_with_zero() {
        let mut cdr = Cdr::new();
        cdr.string("ab");
        cdr.f64(1.0);
        cdr.bool(true);
        cdr.u32(7);
        let mut should = vec![0, 1, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, 0];
        should.extend_from_slice(&1.0_f64.to_le_bytes());
        should.extend_from_slice(&[1, 0, 0, 0, 7, 0, 0, 0]);
        assert_eq!(cdr.finish(), should);
    }
}

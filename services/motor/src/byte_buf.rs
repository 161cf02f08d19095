/// A byte buffer of fixed capacity on the stack. Data that does not fit is dropped.
pub(crate) struct ByteBuf<const MOST: usize> {
    bytes: [u8; MOST],
    end: usize,
}

impl<const MOST: usize> Default for ByteBuf<MOST> {
    fn default() -> Self {
        Self { bytes: [0; MOST], end: 0 }
    }
}

impl<const MOST: usize> ByteBuf<MOST> {
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        if let Some(place) = self.bytes.get_mut(self.end..self.end + bytes.len()) {
            place.copy_from_slice(bytes);
            self.end += bytes.len();
        }
    }

    pub(crate) fn get(&self) -> &[u8] {
        self.bytes.get(..self.end).unwrap_or_default()
    }
}

impl<const MOST: usize> FromIterator<u8> for ByteBuf<MOST> {
    fn from_iter<I: IntoIterator<Item = u8>>(bytes: I) -> Self {
        let mut byte_buf = Self::default();
        bytes.into_iter().for_each(|byte| byte_buf.push(&[byte]));
        byte_buf
    }
}

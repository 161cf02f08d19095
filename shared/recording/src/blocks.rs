use std::io::{self, Read, Write};
use std::slice::Iter;

/// Size of a block. It is small compared with a part of about a megabyte, and a part of a quiet robot needs only one.
const BLOCK: usize = 16 << 10;

/// A byte buffer made of blocks of one size: appended at its end, read from its beginning.
///
/// The ring allocates and frees parts for days. With allocations of varying sizes the heap fragments and grows without
/// bound. With blocks of one size every freed block is reused.
#[derive(Debug, Default)]
pub(crate) struct BlockBuffer {
    /// Each has a capacity of [`BLOCK`] bytes and never more; all but the last one are full.
    blocks: Vec<Vec<u8>>,
}

impl BlockBuffer {
    /// Number of bytes written.
    pub(crate) fn bytes(&self) -> usize {
        self.blocks.iter().map(Vec::len).sum()
    }

    /// Allocated memory in bytes: whole blocks.
    pub(crate) fn held(&self) -> usize {
        self.blocks.iter().map(Vec::capacity).sum()
    }

    /// A reader from the beginning, without copying.
    pub(crate) fn reading(&self) -> Reading<'_> {
        Reading { block: &[], later: self.blocks.iter() }
    }
}

impl Write for BlockBuffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut left = bytes;
        while !left.is_empty() {
            if self.blocks.last().is_none_or(|block| block.len() >= BLOCK) {
                self.blocks.push(Vec::with_capacity(BLOCK));
            }
            let Some(block) = self.blocks.last_mut() else { break };
            let (now, later) = left.split_at(left.len().min(BLOCK - block.len()));
            block.extend_from_slice(now);
            left = later;
        }
        Ok(bytes.len() - left.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Reads [`BlockBuffer`].
#[derive(Clone, Debug)]
pub(crate) struct Reading<'a> {
    /// The rest of the current block.
    block: &'a [u8],
    later: Iter<'a, Vec<u8>>,
}

impl Read for Reading<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.block.is_empty() {
            self.block = self.later.next().map_or(&[], Vec::as_slice);
        }
        self.block.read(into)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The bytes that come back, read `at_once` at a time at most.
    fn read(blocks: &BlockBuffer, at_once: usize) -> Vec<u8> {
        let (mut reading, mut found, mut some) = (blocks.reading(), Vec::new(), vec![0; at_once]);
        loop {
            match reading.read(&mut some).unwrap() {
                0 => return found,
                read => found.extend_from_slice(&some[..read]),
            }
        }
    }

    #[test]
    fn an_empty_buffer_holds_no_memory() {
        let mut blocks = BlockBuffer::default();
        assert_eq!(blocks.write(&[]).unwrap(), 0);
        assert_eq!((blocks.bytes(), blocks.held()), (0, 0));
        assert!(read(&blocks, 10).is_empty());
    }

    #[test]
    fn a_block_is_allocated_only_when_needed() {
        let mut blocks = BlockBuffer::default();
        for (more, held) in [(1, 1), (BLOCK - 1, 1), (0, 1), (1, 2), (3 * BLOCK, 5), (BLOCK - 1, 5)] {
            blocks.write_all(&vec![7; more]).unwrap();
            assert_eq!(blocks.held(), held * BLOCK, "with {} bytes", blocks.bytes());
        }
        assert_eq!(blocks.bytes(), 5 * BLOCK);
    }

    proptest! {
        #[test]
        fn blocks_return_what_was_written_for_any_read_size(
            sizes in prop::collection::vec(prop_oneof![0..20_usize, 0..3 * BLOCK, Just(BLOCK)], 0..12),
            at_once in 1..2 * BLOCK,
        ) {
            let mut written = Vec::new();
            let mut blocks = BlockBuffer::default();
            for (number, size) in (0_u8..).zip(sizes) {
                let bytes: Vec<u8> = (0..=250).cycle().skip(usize::from(number)).take(size).collect();
                prop_assert_eq!(blocks.write(&bytes).unwrap(), size);
                written.extend(bytes);
            }
            prop_assert_eq!(blocks.bytes(), written.len());
            prop_assert_eq!(blocks.held(), written.len().next_multiple_of(BLOCK));
            prop_assert!(read(&blocks, at_once) == written);
        }
    }
}

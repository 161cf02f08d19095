use std::io::{self, Read, Write};
use std::slice::Iter;

/// So many bytes lie in one block. Of a part of a megabyte half a block is nothing, and a part of a robot
/// that is quiet takes no more than one.
const BLOCK: usize = 16 << 10;

/// Bytes in memory in blocks of one size: written at their end, read from their beginning.
///
/// What is kept for a while and forgotten in turns, for days, must not ask for a piece of another size each
/// time: a heap that gets such pieces back can rarely use the whole of one for another, and grows although
/// what it holds does not. Of blocks, those that one of these gives back are those that the next one takes.
#[derive(Debug, Default)]
pub(crate) struct Blocks {
    /// Each has room for [`BLOCK`] bytes and never more; all but the last one are full.
    blocks: Vec<Vec<u8>>,
}

impl Blocks {
    /// Bytes that were written.
    pub(crate) fn bytes(&self) -> usize {
        self.blocks.iter().map(Vec::len).sum()
    }

    /// Bytes of memory that are taken for them: whole blocks.
    pub(crate) fn held(&self) -> usize {
        self.blocks.iter().map(Vec::capacity).sum()
    }

    /// What was written, from its beginning, without a copy of it.
    pub(crate) fn reading(&self) -> Reading<'_> {
        Reading { block: &[], later: self.blocks.iter() }
    }
}

impl Write for Blocks {
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

/// Reads what lies in [`Blocks`].
#[derive(Clone, Debug)]
pub(crate) struct Reading<'a> {
    /// What is left of the present block.
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
    fn read(blocks: &Blocks, at_once: usize) -> Vec<u8> {
        let (mut reading, mut found, mut some) = (blocks.reading(), Vec::new(), vec![0; at_once]);
        loop {
            match reading.read(&mut some).unwrap() {
                0 => return found,
                read => found.extend_from_slice(&some[..read]),
            }
        }
    }

    #[test]
    fn where_nothing_was_written_nothing_is_held() {
        let mut blocks = Blocks::default();
        assert_eq!(blocks.write(&[]).unwrap(), 0);
        assert_eq!((blocks.bytes(), blocks.held()), (0, 0));
        assert!(read(&blocks, 10).is_empty());
    }

    #[test]
    fn a_block_is_taken_when_a_byte_needs_it_and_not_before() {
        let mut blocks = Blocks::default();
        for (more, held) in [(1, 1), (BLOCK - 1, 1), (0, 1), (1, 2), (3 * BLOCK, 5), (BLOCK - 1, 5)] {
            blocks.write_all(&vec![7; more]).unwrap();
            assert_eq!(blocks.held(), held * BLOCK, "with {} bytes", blocks.bytes());
        }
        assert_eq!(blocks.bytes(), 5 * BLOCK);
    }

    proptest! {
        #[test]
        fn what_was_written_comes_back_however_it_was_cut(
            sizes in prop::collection::vec(prop_oneof![0..20_usize, 0..3 * BLOCK, Just(BLOCK)], 0..12),
            at_once in 1..2 * BLOCK,
        ) {
            let mut written = Vec::new();
            let mut blocks = Blocks::default();
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

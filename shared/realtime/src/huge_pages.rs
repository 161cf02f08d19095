use std::fs;
use std::ops::Range;

use libc::c_void;

/// Moves the process's own memory into huge pages at once, as far as the kernel can. Returns the number of bytes that
/// are in huge pages afterwards.
///
/// A hot path that touches megabytes per frame otherwise spends much time on TLB misses. Call it once, when all
/// memory is allocated and locked. Huge pages are not merely advised (`MADV_HUGEPAGE`), because later moves by the
/// kernel cause page faults in the middle of a cycle. If the kernel cannot move a page (before Linux 6.1, without
/// huge pages, or without free memory), the small pages stay and keep working.
pub fn use_huge_pages() -> u64 {
    let maps = fs::read_to_string("/proc/self/maps");
    if let (Some(size), Ok(maps)) = (huge_page_bytes(), maps) {
        for range in maps.lines().filter_map(own_memory) {
            // One page at a time: in a longer range, the kernel stops at the first page that it cannot move. Ranges
            // that were never used cannot be moved.
            for page in within(&range, size).step_by(size) {
                let _one_that_stays_is_as_good_as_before = collapse(page, size);
            }
        }
    }
    in_huge_pages().unwrap_or(0)
}

/// Makes the allocator use one heap and never return memory. Separate mappings for large blocks would be too small
/// for whole huge pages, and returned memory would come back as new pages. Applies to the GNU C library only.
pub(crate) fn disable_heap_trimming() {
    #[cfg(target_env = "gnu")]
    for (parameter, value) in [(libc::M_MMAP_MAX, 0), (libc::M_TRIM_THRESHOLD, -1)] {
        // SAFETY: mallopt(3) takes plain numbers, and a heap that never returns memory is as sound as any other.
        unsafe { libc::mallopt(parameter, value) };
    }
}

/// Size of a huge page; `None` if the kernel does not support them.
fn huge_page_bytes() -> Option<usize> {
    let size = fs::read_to_string("/sys/kernel/mm/transparent_hugepage/hpage_pmd_size").ok()?;
    size.trim().parse().ok().filter(|size: &usize| size.is_power_of_two())
}

/// The address range of a line of `/proc/self/maps` (proc_pid_maps(5)), if it is private anonymous memory with read
/// and write access.
fn own_memory(line: &str) -> Option<Range<usize>> {
    let mut words = line.split_ascii_whitespace();
    let (start, end) = words.next()?.split_once('-')?;
    let is_private = words.next()? == "rw-p";
    let [_offset, _device, inode] = [words.next()?, words.next()?, words.next()?];
    let is_memory =
        inode == "0" && words.next().is_none_or(|name| name == "[heap]" || name.starts_with("[anon"));
    let address = |text| usize::from_str_radix(text, 16).ok();
    (is_private && is_memory).then_some(address(start)?..address(end)?)
}

/// The whole pages of a size within a range.
fn within(range: &Range<usize>, size: usize) -> Range<usize> {
    let start = range.start.checked_next_multiple_of(size).unwrap_or(range.end);
    start..(range.end - range.end % size).max(start)
}

/// Moves the range of `size` bytes at an address into a huge page; returns whether it is one now.
fn collapse(page: usize, size: usize) -> bool {
    let start = std::ptr::without_provenance_mut::<c_void>(page);
    // SAFETY: MADV_COLLAPSE (madvise(2)) changes the pages that back the memory, and nothing that a program can read
    // from it. For an address that is no longer mapped it returns an error.
    unsafe { libc::madvise(start, size, libc::MADV_COLLAPSE) == 0 }
}

/// Bytes of this process's own memory in huge pages.
fn in_huge_pages() -> Option<u64> {
    let rollup = fs::read_to_string("/proc/self/smaps_rollup").ok()?;
    let line = rollup.lines().find_map(|line| line.strip_prefix("AnonHugePages:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asserts that whatever the kernel can move was moved: `after` is at least the size of the whole pages in
    /// `bytes`. Skips this with a message if the kernel cannot move them.
    fn assert_moved(bytes: &[u8], after: u64) {
        let Some(size) = huge_page_bytes() else {
            return skip::skip("this kernel has no huge pages");
        };
        let start = bytes.as_ptr().addr();
        let whole = within(&(start..start + bytes.len()), size);
        assert!(!whole.is_empty(), "no whole page is in {} bytes", bytes.len());
        if whole.clone().step_by(size).all(|page| collapse(page, size)) {
            let length = u64::try_from(whole.len()).unwrap();
            assert!(after >= length, "{after} bytes are in huge pages, of {length} that can be");
        } else {
            skip::skip("this kernel does not move all of the memory into huge pages");
        }
    }

    #[test]
    fn moving_memory_to_huge_pages_keeps_its_content() {
        const BYTES: usize = 32 << 20;
        let bytes: Vec<u8> = (0..BYTES).map(|index| u8::try_from(index % 251).unwrap()).collect();
        let after = use_huge_pages();
        assert_moved(&bytes, after);
        assert!((0..BYTES).all(|index| bytes.get(index) == u8::try_from(index % 251).ok().as_ref()));
    }

    #[test]
    fn memory_behind_untouched_pages_is_moved_to_huge_pages() {
        // Larger than the memory of the other tests in this process, whose huge pages would count.
        const BYTES: usize = 128 << 20;
        const HOLE: usize = 32 << 20;
        // Zeroed memory is mapped, but gets pages only when it is first used.
        let mut bytes = vec![0; BYTES];
        let after_hole = bytes.get_mut(HOLE..).unwrap();
        after_hole.fill(7);
        let after = use_huge_pages();
        assert_moved(after_hole, after);
        assert!(bytes == [vec![0; HOLE], vec![7; BYTES - HOLE]].concat());
    }

    #[test]
    fn only_memory_of_this_process_alone_is_moved() {
        let lines = [
            ("7f00-7f80 rw-p 00000000 00:00 0 ", Some(0x7f00..0x7f80)),
            (
                "55aa000-55ab000 rw-p 00000000 00:00 0                          [heap]",
                Some(0x55a_a000..0x55a_b000),
            ),
            (
                "7f00-7f80 rw-p 00000000 00:00 0                                [anon: glibc: malloc]",
                Some(0x7f00..0x7f80),
            ),
            ("7ffc00-7ffd00 rw-p 00000000 00:00 0                            [stack]", None),
            ("7f00-7f80 ---p 00000000 00:00 0 ", None),
            ("7f00-7f80 r-xp 00000000 00:00 0                                [vdso]", None),
            ("7f00-7f80 rw-s 00000000 00:19 77                               /dev/shm/buffer", None),
            ("7f00-7f80 rw-p 00001000 fd:00 12                               /usr/lib/libc.so.6", None),
            ("nonsense", None),
            ("", None),
        ];
        for (line, range) in lines {
            assert_eq!(own_memory(line), range, "{line}");
        }
    }

    #[test]
    fn a_range_is_cut_to_whole_pages() {
        assert_eq!(within(&(100..1000), 256), 256..768);
        assert_eq!(within(&(256..512), 256), 256..512);
        assert!(within(&(257..511), 256).is_empty());
        assert!(within(&(usize::MAX - 10..usize::MAX), 256).is_empty());
    }
}

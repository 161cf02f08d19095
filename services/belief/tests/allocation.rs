//! The hot path of the belief process allocates nothing.

#![expect(unsafe_code, reason = "an allocator that counts is a `GlobalAlloc`, whose methods are unsafe")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod frames;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use belief_process::Believer;
use frames::{Frames, capacity};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is handed to the system's allocator, which keeps the promises of the trait;
// counting in a constant-initialised thread local allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promises about `layout` are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `System` with this layout, since `alloc` hands on to it.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations_in(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.with(Cell::get);
    work();
    ALLOCATIONS.with(Cell::get) - before
}

#[test]
fn the_counter_counts() {
    let mut kept = Vec::new();
    assert!(allocations_in(|| kept.push(vec![0_u8; 16])) >= 2);
}

#[test]
fn hundreds_of_frames_with_two_partners_nested_twice_and_64_things_allocate_nothing() {
    let percepts = config::percepts::Percepts::builtin();
    let mut config = config::perspective::Perspective::builtin();
    config.resource.by = config::perspective::Owning::Territory;
    let mut believer = Believer::new(&percepts, &config, 2, 2, capacity()).unwrap();
    let mut frames = Frames::new(64);
    let mut published = 0;
    let allocations = allocations_in(|| {
        for _ in 0..300 {
            let (now, header, entries) = frames.next();
            believer.step(now, &header, entries);
            for perspective in 0..believer.perspectives() {
                let _head = believer.head(perspective);
                let beliefs = (0..believer.len(perspective)).filter_map(|at| believer.entry(perspective, at));
                published += beliefs.count();
            }
        }
    });
    assert_eq!(allocations, 0);
    assert!(published > 300 * 64, "only {published} beliefs were published");
    // The frames were not idle: partners saw things, missed things, and turned away.
    assert_eq!(believer.head(0).culled, 4);
    for perspective in 1..=2 {
        let head = believer.head(perspective);
        assert!(head.created > 64 && head.merged > 64, "{head:?}");
        assert!(head.hidden > 0, "{head:?}");
    }
}

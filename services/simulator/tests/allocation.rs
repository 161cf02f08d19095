//! A step of the world allocates nothing, and neither does what it gives away.

#![expect(unsafe_code, reason = "an allocator that counts is a `GlobalAlloc`, whose methods are unsafe")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use clock::{Duration, Instant};
use config::lesson::Lesson;
use simulator_process::World;

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
fn a_whole_lesson_allocates_nothing() {
    let lesson = Lesson::builtin();
    let mut world = World::new(&lesson, lesson.seed);
    let (mut observed, mut said, mut steps) = (0, 0, 0);
    let allocations = allocations_in(|| {
        while !world.is_finished() {
            steps += 1;
            world.step(Instant::EPOCH + Duration::from_millis(10) * steps, [None, None]);
            observed += world.observations().count();
            said += world.utterances().count() + world.scene().filter(|object| object.kind == 0).count();
        }
    });
    assert_eq!(allocations, 0);
    assert!(steps > 1_000 && observed > 10_000 && said == 5, "{steps} {observed} {said}");
}

//! Performing allocates nothing, and neither does planning.

#![expect(unsafe_code, reason = "an allocator that counts is a `GlobalAlloc`, whose methods are unsafe")]
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod leo;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use clock::{Duration, Instant};
use geometry::Position;
use leo::{LEO, MOTOR};
use motion::{Performer, Progress, Skill};

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
    assert!(allocations_in(|| drop(std::hint::black_box(MOTOR.to_owned()))) >= 1);
}

#[test]
fn an_insertion_from_beginning_to_end_allocates_nothing() {
    let mut performer = Performer::new(&LEO.body, &LEO.rest_rad, Duration::from_millis(40)).expect("a body");
    let mut present: Vec<Option<f64>> = LEO.rest_rad.iter().copied().map(Some).collect();
    let skill = Skill::Insert {
        thing: Position::new(0.4, -0.2, 0.03),
        half_height_m: 0.03,
        hole: Position::new(0.45, 0.05, 0.06),
    };
    let mut now = Instant::from_nanos(0);
    let (mut steps, mut end) = (0, Progress::Idle);
    let allocations = allocations_in(|| {
        performer.begin(now, &skill, &present).expect("in reach");
        for _step in 0..5_000 {
            end = performer.step(now, &present);
            if end == Progress::Done {
                break;
            }
            for (present, goal) in present.iter_mut().zip(performer.goals()) {
                *present = Some(goal.goal_position_rad);
            }
            now += Duration::from_millis(20);
            steps += 1;
        }
    });
    assert_eq!(end, Progress::Done);
    assert!(steps > 100, "only {steps} steps");
    assert_eq!(allocations, 0);
}

//! The promise that comparing two perspectives allocates nothing after `new`.

#![expect(unsafe_code, reason = "an allocator that counts is an allocator")]
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use config::percepts::Percepts;
use message::{Belief, BeliefHead, Feature, Header, NOBODY, Remembered};
use perspective::{Divergence, Side};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // The thread's storage may be gone when the thread ends.
    let _gone = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is handed to the system's allocator as it came, which keeps its promises.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises about `layout` are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `alloc` above with the same layout, says the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const CAPACITY: usize = 40;

/// More beliefs than there is room for, which move, change and are begun anew.
fn beliefs(side: u64, round: u64) -> Vec<Belief> {
    let number = |value: u64| f32::from(u16::try_from(value % 1000).unwrap());
    let belief = |thing: u64| {
        let mut belief =
            Belief::new(thing + round / 50 * 3, round / 50, round - thing % 3 * side, round, NOBODY);
        let moved = if side == 1 { 0.0 } else { number(round) * 0.01 };
        let place = [number(thing % 8) * 0.2 + moved, number(thing / 8) * 0.2, 0.03];
        assert!(belief.push(Remembered::new(0, round, 1.0, 1.0, Feature::Vector(place))));
        let colour = Feature::Symbol(u16::try_from((thing + side * round / 7) % 3).unwrap());
        assert!(belief.push(Remembered::new(5, round, 1.0, 1.0, colour)));
        belief
    };
    (0..45 - side * 4).map(belief).collect()
}

#[test]
fn comparing_allocates_nothing() {
    let mut divergence = Divergence::new(&Percepts::builtin(), CAPACITY);
    let (mut most, mut agreed) = (0, 0);
    for round in 10..400 {
        let head = |perspective| BeliefHead::of(perspective, Header::at(round));
        let (one, other) = (head(0), head(1));
        let (ones, others) = (beliefs(0, round), beliefs(1, round));
        let before = ALLOCATIONS.get();
        let differences = divergence
            .compare(Side { head: &one, beliefs: &ones }, Side { head: &other, beliefs: &others })
            .len();
        assert_eq!(ALLOCATIONS.get(), before, "in round {round}");
        most = most.max(differences);
        agreed = agreed.max(divergence.agreed());
    }
    // It had something to do, and its allocations would have been counted.
    assert!(most > CAPACITY && agreed > 0, "{most} {agreed}");
    let before = ALLOCATIONS.get();
    drop(std::hint::black_box(vec![0_u8; 10]));
    assert_eq!(ALLOCATIONS.get(), before + 1);
}

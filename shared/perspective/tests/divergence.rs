//! Guarantees that comparing two perspectives allocates nothing after `new`.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use belief::percepts::Percepts;
use message::{Belief, BeliefHead, Feature, Header, NOBODY, Remembered};
use perspective::{Divergence, PerspectiveBeliefs};
use testkit::allocations_in;

const CAPACITY: usize = 40;

/// More beliefs than the capacity, which move, change and restart.
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
fn comparing_perspectives_allocates_no_memory() {
    let mut divergence = Divergence::new(&Percepts::builtin(), CAPACITY);
    let (mut max, mut agreed) = (0, 0);
    for round in 10..400 {
        let head = |perspective| BeliefHead::of(perspective, Header::at(round));
        let (one, other) = (head(0), head(1));
        let (ones, others) = (beliefs(0, round), beliefs(1, round));
        let sides = (
            PerspectiveBeliefs { head: &one, beliefs: &ones },
            PerspectiveBeliefs { head: &other, beliefs: &others },
        );
        let allocations = allocations_in(|| max = max.max(divergence.compare(sides.0, sides.1).len()));
        assert_eq!(allocations, 0, "in round {round}");
        agreed = agreed.max(divergence.agreed());
    }
    assert!(max > CAPACITY && agreed > 0, "it had something to do: {max} {agreed}");
}

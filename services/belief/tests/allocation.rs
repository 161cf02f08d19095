//! The hot path of the belief process does not allocate.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod frames;

use belief_process::{Believer, Divergences};
use frames::{Frames, capacity};
use testkit::allocations_in;

#[test]
fn frames_with_two_nested_partners_and_64_objects_allocate_nothing() {
    let percepts = belief::percepts::Percepts::builtin();
    let mut config = perspective::settings::Perspective::builtin();
    config.ownership.rule = perspective::settings::OwnershipRule::Territory;
    let mut believer = Believer::new(&percepts, &config, 2, 2, capacity()).unwrap();
    let mut divergences = Divergences::new(&percepts, &believer, capacity());
    let mut frames = Frames::new(64);
    let (mut published, mut differing) = (0, 0);
    let allocations = allocations_in(|| {
        for _ in 0..300 {
            let (now, head, entries) = frames.next();
            believer.step(now, &head, entries);
            for perspective in 0..believer.perspectives() {
                let _head = believer.head(perspective);
                let beliefs = (0..believer.len(perspective)).filter_map(|at| believer.entry(perspective, at));
                published += beliefs.count();
            }
            divergences.read(&believer);
            divergences.compare();
            differing += (1..7).map(|number| divergences.differences(number).len()).sum::<usize>();
        }
    });
    assert_eq!(allocations, 0);
    assert!(published > 300 * 64, "only {published} beliefs were published");
    assert!(differing > 300 && (1..=2).all(|number| divergences.head(number).compared == 1));
    // The frames had varied content: partners saw things, missed things, and turned away.
    assert_eq!(believer.head(0).culled, 4);
    for perspective in 1..=2 {
        let head = believer.head(perspective);
        assert!(head.created > 64 && head.merged > 64, "{head:?}");
        assert!(head.hidden > 0, "{head:?}");
    }
}

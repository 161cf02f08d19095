//! Steps and outputs of the world do not allocate.

use clock::{Duration, Instant};
use config::lesson::Lesson;
use simulator_process::World;
use testkit::allocations_in;

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

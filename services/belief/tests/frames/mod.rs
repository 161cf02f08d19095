//! Frames of the percept buffer, as the sensor process would publish them: two partners opposite each other, a barrier,
//! and things of which some are moved and change.

use clock::{Duration, Instant};
use geometry::{Base, Eye, Pose, Position};
use message::{Header, Hop, NOBODY, Observation, ObservationKind, Perceived, PerceptHead, SourceSet, State};
use perception::{Frame, Perception};
use quantity::number::single;

/// Capacity of a frame and of a belief system in these tests.
pub(crate) fn capacity() -> usize {
    80
}

/// A source of frames, one every 5 ms.
pub(crate) struct Frames {
    perception: Perception,
    things: u16,
    count: u16,
    entries: Vec<Perceived>,
}

impl Frames {
    pub(crate) fn new(things: u16) -> Self {
        let percepts = belief::percepts::Percepts::builtin();
        let perception = Perception::new(&percepts).unwrap();
        Self { perception, things, count: 0, entries: Vec::with_capacity(usize::from(things) + 3) }
    }

    /// The next frame: its arrival time, its head and its entries. Does not allocate.
    pub(crate) fn next(&mut self) -> (Instant, PerceptHead, &[Perceived]) {
        self.count += 1;
        let now = Instant::EPOCH + Duration::from_millis(5) * u32::from(self.count);
        self.entries.clear();
        // The first partner looks away for one second in every two.
        let first_looks_at =
            if (self.count / 200).is_multiple_of(2) { [0.7, 0.0, 0.0] } else { [3.0, 0.0, 0.5] };
        self.push(now, person(1, [1.5, 0.0, 0.55], first_looks_at));
        // The second partner walks up and down, so that the partner's frame changes.
        let along = f64::from(self.count % 400) * 0.005 - 1.0;
        self.push(now, person(2, [0.7, -1.5 + along * 0.3, 0.55], [0.7 + along, 0.0, 0.0]));
        let wall = Observation {
            kind: ObservationKind::Occluder.raw(),
            position_m: [0.5, 0.0, 0.12],
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            half_extents_m: [0.01, 0.15, 0.12],
            ..Observation::object(0, 0)
        };
        self.push(now, wall);
        // Four of the things are removed.
        let things = if self.count > 50 { self.things.saturating_sub(4) } else { self.things };
        for thing in 0..things {
            self.push(now, block(thing, self.count));
        }
        let mut header = Header::at(now.as_nanos());
        header.pass(Hop::Observed, now.as_nanos());
        (now, PerceptHead::new(header, SourceSet::of(0)), &self.entries)
    }

    fn push(&mut self, now: Instant, thing: Observation) {
        let observation = Observation { observed_at_ns: now.as_nanos(), ..thing };
        let snapshot = self.perception.perceive(&observation, &Frame { agent: 0 });
        self.entries.push(Perceived { observation, snapshot });
    }
}

/// One of the things on a grid of 15 cm; the first partner carries every eighth one.
fn block(thing: u16, count: u16) -> Observation {
    let carried = thing % 8 == 3;
    let sway = if carried { f32::from(count % 20) * 0.002 } else { 0.0 };
    let mut block = Observation {
        position_m: [0.1 + f32::from(thing / 8) * 0.15, -0.6 + f32::from(thing % 8) * 0.15 + sway, 0.03],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        half_extents_m: [0.03; 3],
        shape: [0.0; 4],
        colour_rgb: if thing.is_multiple_of(2) { [0.8, 0.05, 0.05] } else { [0.05, 0.15, 0.8] },
        confidence: 0.95,
        held_by: if carried { 1 } else { NOBODY },
        ..Observation::object(0, 0)
    };
    block.set_state(State::Filled, if (count / 100).is_multiple_of(2) { 0.0 } else { 1.0 });
    block
}

fn person(partner: u16, from: [f64; 3], towards: [f64; 3]) -> Observation {
    let position = |[x, y, z]: [f64; 3]| Position::<Base>::new(x, y, z);
    let eye = Pose::<Base, Eye>::looking(&position(from), &position(towards));
    Observation {
        kind: ObservationKind::Person.raw(),
        partner,
        position_m: eye.position_m().map(single),
        orientation_xyzw: eye.orientation_xyzw().map(single),
        ..Observation::object(0, 0)
    }
}

use clock::{Duration, Instant};
use message::{Header, Hop, NOBODY, Observation, ObservationKind, Observations, STATES};
use transport::FramePublisher;

/// Position of the invalid observations: no thing of the lesson is there.
const ELSEWHERE_M: [f32; 3] = [50.0, 50.0, 50.0];

/// A partner whose perspective is not simulated.
const STRANGER: u16 = 200;

/// Invalid observations of every kind, in turn. None may become a percept except one observation of a
/// stranger in each frame.
pub(crate) struct Garbage {
    began: Instant,
    count: u64,
}

impl Garbage {
    pub(crate) fn new(began: Instant) -> Self {
        Self { began, count: 0 }
    }

    /// Sends the next invalid frame; returns whether the middleware accepted it.
    pub(crate) fn send(&mut self, publisher: &mut FramePublisher<Observations>, now: Instant) -> bool {
        self.count += 1;
        let (lie, began) = (self.count, self.began);
        let day_ns = u64::try_from(Duration::from_secs(86_400).as_nanos()).expect("fits");
        let mut header = Header::at(now.as_nanos());
        header.pass(Hop::Observed, now.as_nanos());
        // Sometimes a burst of ten times the robot's frame capacity.
        let entries = if lie.is_multiple_of(5) { publisher.capacity() } else { 20 };
        match lie % 16 {
            1 => header.valid_at_ns = now.as_nanos() + day_ns,
            2 => header.valid_at_ns = u64::MAX,
            3 => header.valid_at_ns = 0,
            4 => header.valid_at_ns = now.as_nanos() - 50_000_000,
            5 => header.hops_ns = [0; 8],
            6 => header.hops_ns = [u64::MAX; 8],
            7 => header.over_capacity = u64::MAX,
            _ => {}
        }
        publisher
            .send(
                header,
                entries,
                |entry| unsound(lie.wrapping_add(u64::try_from(entry).expect("fits")), began, now),
                |header| match lie % 16 {
                    8 => header.sequence = u64::MAX,
                    9 => header.sequence = 0,
                    10 => header.incarnation = lie,
                    _ => {}
                },
            )
            .is_ok()
    }
}

/// An observation with an error, a detection of an unknown person, a stale occluder, or a stranger: one in a frame.
fn unsound(lie: u64, began: Instant, now: Instant) -> Observation {
    let now_ns = now.as_nanos();
    let sound = Observation {
        position_m: ELSEWHERE_M,
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        half_extents_m: [0.03; 3],
        ..Observation::object(0, now_ns)
    };
    match lie % 20 {
        0 => Observation { kind: 0, ..sound },
        1 => Observation { modality: u16::MAX, ..sound },
        2 => Observation { position_m: [f32::NAN, 0.0, 0.0], ..sound },
        3 => Observation { position_m: [0.5, f32::INFINITY, 0.0], ..sound },
        4 => Observation { position_m: [f32::MAX; 3], ..sound },
        5 => Observation { orientation_xyzw: [0.0; 4], ..sound },
        6 => Observation { orientation_xyzw: [0.0, 0.0, f32::NAN, 1.0], ..sound },
        7 => Observation { half_extents_m: [-1.0; 3], ..sound },
        8 => Observation { colour_rgb: [f32::NEG_INFINITY; 3], ..sound },
        9 => Observation { shape: [0.0, 0.0, 0.0, f32::NAN], ..sound },
        10 => Observation { confidence: -1.0, ..sound },
        11 => Observation { confidence: f32::NAN, ..sound },
        12 => Observation { kind: ObservationKind::Person.raw(), partner: NOBODY, ..sound },
        13 => Observation { kind: ObservationKind::Person.raw(), orientation_xyzw: [0.0; 4], ..sound },
        14 => Observation { observed_at_ns: u64::MAX, ..sound },
        15 => Observation { observed_at_ns: 1, ..sound },
        16 => Observation { states: [2.0; STATES], ..sound },
        17 => Observation { kind: ObservationKind::Person.raw(), partner: STRANGER, ..sound },
        // Each number comes once, so that none of these persons gets a number.
        18 => Observation {
            kind: ObservationKind::Person.raw(),
            detection: u16::try_from(1 + lie % 60_000).expect("fits"),
            ..sound
        },
        _ => Observation { observed_at_ns: began.as_nanos(), kind: ObservationKind::Occluder.raw(), ..sound },
    }
}

use belief::BeliefSystem;
use clock::Instant;
use config::percepts::Percepts;
use config::perspective::Perspective;
use geometry::{Base, Pose, Position};
use message::{Belief, BeliefHead, Header, ObservationKind, Perceived};
use quantity::number::saturating_u32;
use scene::Cone;

use crate::field::Field;
use crate::transform::place_in_base;
use crate::{Awareness, NoPerspective};

/// The robot's own perspective: it perceives all that was observed, in its base frame, and notices
/// an absence where its sensors look.
#[derive(Clone, Debug)]
pub struct Robot {
    system: BeliefSystem,
    awareness: Awareness,
    field: Field,
    empty_margin_m: f64,
    at: Instant,
    perceivable: usize,
    refused: u64,
    left_out: u64,
}

impl Robot {
    /// The robot without beliefs yet, aware of up to `partners` partners. `capacity` is that of a
    /// frame of observations and of the belief system. Allocates all that it will ever need.
    ///
    /// # Errors
    ///
    /// The configuration's beliefs or field of view cannot be.
    pub fn new(
        percepts: &Percepts,
        config: &Perspective,
        partners: u16,
        capacity: usize,
    ) -> Result<Self, NoPerspective> {
        let system = BeliefSystem::new(percepts, capacity)
            .map_err(|source| NoPerspective::Belief { agent: 0, source })?;
        Ok(Self {
            system,
            awareness: Awareness::new(config, partners, capacity),
            field: field(&config.robot.field)?,
            empty_margin_m: config.sight.empty_margin_m.get(),
            at: Instant::EPOCH,
            perceivable: 0,
            refused: 0,
            left_out: 0,
        })
    }

    /// One instant: takes note of eyes and occluders, and believes what was perceived. Unsound
    /// entries are refused and counted, those beyond the capacity left out and counted.
    ///
    /// `looked` says whether any sensory process observed anything new, be it an empty table.
    /// Where none did, time passes and nothing is taken to have vanished: silence is no absence.
    pub fn step(&mut self, at: Instant, looked: bool, entries: &[Perceived]) {
        self.at = at;
        self.awareness.note(at, looked, entries, &self.field, is_sound);
        let noted = self.awareness.perceives();
        let refused = noted.iter().filter(|perceives| !**perceives).count();
        let left_out = entries.len().saturating_sub(noted.len());
        self.refused = self.refused.saturating_add(u64::from(saturating_u32(refused)));
        self.left_out = self.left_out.saturating_add(u64::from(saturating_u32(left_out)));
        let objects = || {
            let noted = noted.iter().zip(entries).enumerate();
            noted.filter(|(_, (perceives, entry))| **perceives && is_object(entry)).map(|(index, _)| index)
        };
        self.perceivable = objects().count();
        let (field, occluders) = (&self.field, self.awareness.occluders());
        self.system.step(at, entries, objects(), |place_m| {
            looked && field.surveys(occluders, place_in_base(&Pose::identity(), place_m), self.empty_margin_m)
        });
    }

    /// What it is aware of: the perspectives of its partners are made from it.
    #[must_use]
    pub fn awareness(&self) -> &Awareness {
        &self.awareness
    }

    /// What it believes.
    #[must_use]
    pub fn beliefs(&self) -> &BeliefSystem {
        &self.system
    }

    /// Entries that were no observation or no percepts, and were refused.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// The head of its belief buffer. Its eye is that of its field of view, or its base.
    #[must_use]
    pub fn head(&self, header: Header) -> BeliefHead {
        let counts = self.system.counts();
        let mut head = BeliefHead::of(0, header);
        if let Field::Cone { x_base_eye, .. } = self.field {
            head.eye_position_m = x_base_eye.position_m();
            head.eye_orientation_xyzw = x_base_eye.orientation_xyzw();
        }
        head.present = 1;
        head.perceivable = saturating_u32(self.perceivable);
        head.refused = self.refused.saturating_add(counts.refused());
        head.created = counts.created;
        head.merged = counts.merged;
        head.culled = counts.culled;
        head.overflowed = self.left_out.saturating_add(counts.overflowed);
        head
    }

    /// A belief by its place in the order of identities, evaluated at the last step's instant.
    #[must_use]
    pub fn entry(&self, index: usize) -> Option<Belief> {
        self.system.write(index, self.at)
    }
}

/// What comes from another process is an allegation: an observation and percepts to be used, by
/// the robot as by whoever is taken to see the same.
fn is_sound(entry: &Perceived) -> bool {
    entry.observation.is_sound()
        && entry.snapshot.values().iter().all(|value| {
            (0.0..=1.0).contains(&value.matching)
                && (0.0..=1.0).contains(&value.confidence)
                && value.feature().is_some()
        })
}

pub(crate) fn is_object(entry: &Perceived) -> bool {
    entry.observation.kind() == Some(ObservationKind::Object)
}

fn field(field: &config::perspective::Field) -> Result<Field, NoPerspective> {
    match field {
        config::perspective::Field::Everything => Ok(Field::Everything),
        config::perspective::Field::Cone { eye_m, looks_at_m, half_angle_deg, range_m } => {
            if !eye_m.iter().chain(looks_at_m).all(|number| number.is_finite()) {
                return Err(NoPerspective::Eye { eye_m: *eye_m, looks_at_m: *looks_at_m });
            }
            let cone = Cone::new(half_angle_deg.radians(), range_m.get())
                .map_err(|source| NoPerspective::Cone { agent: 0, source })?;
            let position = |[x, y, z]: [f64; 3]| Position::<Base>::new(x, y, z);
            Ok(Field::Cone { x_base_eye: Pose::looking(&position(*eye_m), &position(*looks_at_m)), cone })
        }
    }
}

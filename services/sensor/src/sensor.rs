use config::percepts::Percepts;
use message::{Observation, Perceived};
use perception::{Frame, Perception, Unperceivable};

/// The core of the sensor process: which observations of this cycle enter the percept buffer, and
/// what the robot perceives in each (Berlin et al. 2006, Eq. 1 and 2).
///
/// Allocates nothing after `new`.
pub struct Sensor {
    perception: Perception,
    chosen: Vec<(usize, usize)>,
    refused: u64,
}

impl Sensor {
    /// A sensor for frames of at most `capacity` observations.
    ///
    /// # Errors
    ///
    /// The percepts cannot be evaluated.
    pub fn new(percepts: &Percepts, capacity: usize) -> Result<Self, Unperceivable> {
        Ok(Self { perception: Perception::new(percepts)?, chosen: Vec::with_capacity(capacity), refused: 0 })
    }

    /// Chooses the sound observations of the newest frame of each source; returns how many there
    /// are, those beyond the capacity included.
    pub fn choose<'a>(&mut self, frames: impl Iterator<Item = (usize, &'a [Observation])>) -> usize {
        self.chosen.clear();
        let mut count = 0;
        for (source, observations) in frames {
            for (index, observation) in observations.iter().enumerate() {
                if observation.is_sound() {
                    count += 1;
                    if self.chosen.len() < self.chosen.capacity() {
                        self.chosen.push((source, index));
                    }
                } else {
                    self.refused += 1;
                }
            }
        }
        count
    }

    /// Source and place in its frame of a chosen observation.
    #[must_use]
    pub fn chosen(&self, index: usize) -> Option<(usize, usize)> {
        self.chosen.get(index).copied()
    }

    /// What the robot perceives in an observation: its percept snapshot (Eq. 2).
    #[must_use]
    pub fn perceive(&self, observation: &Observation) -> Perceived {
        Perceived {
            observation: *observation,
            snapshot: self.perception.perceive(observation, &Frame { agent: 0 }),
        }
    }

    /// Observations refused because their numbers were unsound.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsound_observations_are_refused_and_counted() {
        let mut sensor = Sensor::new(&Percepts::builtin(), 4).unwrap();
        let sound = Observation::object(0, 5);
        let unsound = Observation { confidence: f32::NAN, ..sound };
        assert_eq!(sensor.choose([(0, [unsound, sound].as_slice()), (1, &[sound])].into_iter()), 2);
        assert_eq!(sensor.refused(), 1);
        assert_eq!((sensor.chosen(0), sensor.chosen(1)), (Some((0, 1)), Some((1, 0))));
    }

    #[test]
    fn observations_beyond_the_capacity_are_counted_and_not_chosen() {
        let mut sensor = Sensor::new(&Percepts::builtin(), 4).unwrap();
        let frame = [Observation::object(0, 5); 6];
        assert_eq!(sensor.choose([(0, frame.as_slice())].into_iter()), 6);
        assert_eq!(sensor.chosen(4), None);
    }
}

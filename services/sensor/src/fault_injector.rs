use clock::{Duration, Instant};
use config::campaign::{PerceptFault, PerceptFaultKind};
use message::{Observation, Perceived};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Default delay of a delayed percept.
const DELAY: Duration = Duration::from_millis(50);

/// Injects the percept faults of a campaign. Allocates only in [`new`](Self::new).
#[derive(Clone, Debug)]
pub struct FaultInjector {
    faults: Vec<PerceptFault>,
    chance: ChaCha8Rng,
    begun_at: Option<Instant>,
    /// The current frame and the previous one.
    frame: Vec<Perceived>,
    before: Vec<Perceived>,
    /// Delayed percepts with their due times.
    late: Vec<(Instant, Perceived)>,
    capacity: usize,
}

impl FaultInjector {
    /// Returns an injector for frames of at most `capacity` percept snapshots.
    #[must_use]
    pub fn new(faults: &[PerceptFault], seed: u64, capacity: usize) -> Self {
        Self {
            faults: faults.to_vec(),
            chance: ChaCha8Rng::seed_from_u64(seed),
            begun_at: None,
            frame: Vec::with_capacity(capacity),
            before: Vec::with_capacity(capacity),
            late: Vec::with_capacity(capacity),
            capacity,
        }
    }

    /// Returns the frame with the active faults applied.
    pub fn inject(&mut self, now: Instant, perceived: impl Iterator<Item = Perceived>) -> &[Perceived] {
        let begun_at = *self.begun_at.get_or_insert(now);
        std::mem::swap(&mut self.frame, &mut self.before);
        self.frame.clear();
        self.frame.extend(perceived.take(self.capacity));
        for place in 0..self.faults.len() {
            let Some(fault) =
                self.faults.get(place).copied().filter(|fault| fault.is_on(now.since(begun_at)))
            else {
                continue;
            };
            self.apply(now, fault);
        }
        let mut at = 0;
        while let Some((due, late)) = self.late.get(at).copied() {
            if due <= now && self.frame.len() < self.capacity {
                self.frame.push(late);
                self.late.swap_remove(at);
            } else {
                at += 1;
            }
        }
        &self.frame
    }

    fn apply(&mut self, now: Instant, fault: PerceptFault) {
        let chance = fault.probability.get();
        match fault.kind {
            PerceptFaultKind::Drop => {
                let dice = &mut self.chance;
                self.frame.retain(|_| !strikes(dice, chance));
            }
            PerceptFaultKind::Delay => {
                let (dice, late, capacity) = (&mut self.chance, &mut self.late, self.capacity);
                let by = fault.delay_ms.map_or(DELAY, |ms| Duration::from_secs_f64(ms.get() / 1e3));
                self.frame.retain(|perceived| {
                    let delayed = late.len() < capacity && strikes(dice, chance);
                    if delayed {
                        late.push((now + by, *perceived));
                    }
                    !delayed
                });
            }
            PerceptFaultKind::Duplicate => {
                for place in 0..self.frame.len() {
                    if self.frame.len() < self.capacity
                        && strikes(&mut self.chance, chance)
                        && let Some(again) = self.frame.get(place).copied()
                    {
                        self.frame.push(again);
                    }
                }
            }
            PerceptFaultKind::Reorder => {
                if strikes(&mut self.chance, chance) {
                    self.frame.reverse();
                }
            }
            PerceptFaultKind::Nan => {
                for perceived in &mut self.frame {
                    if strikes(&mut self.chance, chance) {
                        perceived.observation = Observation {
                            position_m: [f32::NAN; 3],
                            half_extents_m: [f32::NAN; 3],
                            confidence: f32::NAN,
                            ..perceived.observation
                        };
                    }
                }
            }
            PerceptFaultKind::Freeze => {
                if strikes(&mut self.chance, chance) {
                    self.frame.clear();
                    self.frame.extend_from_slice(&self.before);
                }
            }
        }
    }
}

fn strikes(dice: &mut ChaCha8Rng, chance: f64) -> bool {
    f64::from(dice.next_u32()) < chance * (f64::from(u32::MAX) + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use config::campaign::Campaign;
    use message::Snapshot;

    fn fault_injector(text: &str) -> FaultInjector {
        let campaign: Campaign = config::parse(text, "c.toml".as_ref()).unwrap();
        FaultInjector::new(&campaign.percepts, 7, 8)
    }

    fn perceived(source: u16) -> Perceived {
        let observation = Observation { source, position_m: [1.0; 3], ..Observation::object(0, 1) };
        Perceived { observation, snapshot: Snapshot::default() }
    }

    /// The entries in each of `count` frames of four.
    fn frames(fault_injector: &mut FaultInjector, count: u64) -> Vec<Vec<u16>> {
        let at = |frame| Instant::from_nanos(frame * 5_000_000);
        (0..count)
            .map(|frame| {
                let first = u16::try_from(frame).unwrap() * 10;
                let said = fault_injector.inject(at(frame), (first..first + 4).map(perceived));
                said.iter().map(|perceived| perceived.observation.source).collect()
            })
            .collect()
    }

    #[test]
    fn every_kind_injects_its_fault() {
        let kind =
            |kind, more| fault_injector(&format!("[[percepts]]\nkind = \"{kind}\"\nprobability = 1\n{more}"));
        assert_eq!(frames(&mut kind("drop", "start_s = 0.005"), 2), [vec![0, 1, 2, 3], vec![]]);
        let late = frames(&mut kind("delay", "delay_ms = 10\nduration_s = 0.004"), 3);
        assert_eq!(late, [vec![], vec![10, 11, 12, 13], vec![20, 21, 22, 23, 0, 3, 2, 1]]);
        assert_eq!(frames(&mut kind("duplicate", ""), 1), [vec![0, 1, 2, 3, 0, 1, 2, 3]]);
        assert_eq!(frames(&mut kind("reorder", ""), 1), [vec![3, 2, 1, 0]]);
        assert_eq!(frames(&mut kind("freeze", "start_s = 0.005"), 3), [[0, 1, 2, 3]; 3]);
        let mut nan = kind("nan", "");
        assert!(nan.inject(Instant::EPOCH, [perceived(1)].into_iter())[0].observation.position_m[0].is_nan());
    }

    #[test]
    fn the_same_seed_makes_the_same_faults_and_nothing_exceeds_the_frame() {
        let text = ["drop", "delay", "duplicate", "reorder", "freeze"]
            .map(|kind| format!("[[percepts]]\nkind = \"{kind}\"\nprobability = 0.3\n"))
            .concat();
        let run = || frames(&mut fault_injector(&text), 500);
        let (one, other) = (run(), run());
        assert_eq!(one, other);
        assert!(one.iter().all(|frame| frame.len() <= 8));
        assert!(one.iter().any(|frame| frame.len() != 4));
    }
}

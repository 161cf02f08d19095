use super::hands::Hands;
use super::percepts::Carrying;

/// What unobserved things move with: see [`super::BeliefSystem::carry`].
#[derive(Clone, Debug)]
pub(super) struct Carriers {
    pub(super) settings: Carrying,
    /// Index of the percept that gives half a thing's extents, and of the one that gives its orientation.
    pub(super) extents: Option<u16>,
    pub(super) orientation: Option<u16>,
    pub(super) hands: Hands,
    /// Per slot.
    pub(super) carried: Box<[Carried]>,
    /// Per slot: the identity of its belief, and where that was expected at the end of the last step.
    pub(super) placed: Box<[(u64, [f32; 3])]>,
}

/// What the thing of a belief moves with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Carried {
    /// It is observed, or was not missed yet: its carrier is sought once it is missed.
    NotSought,
    /// It is missed, and nothing carries it.
    ByNothing,
    /// It is missed, and moves with a carrier.
    By {
        carrier: Carrier,
        /// Where it is from the carrier, in the perspective's frame. A carrier that turns does not turn it.
        offset_m: [f32; 3],
        /// Whether the carrier hides it, so that its empty place is no evidence of absence.
        is_hidden: bool,
    },
}

/// What moves a thing that is not observed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Carrier {
    /// The hand with this identity.
    Hand(u32),
    /// The thing that it is in.
    Container { slot: u32, id: u64 },
    /// The thing that it stands on.
    Support { slot: u32, id: u64 },
}

impl Carriers {
    pub(super) fn new(settings: Carrying, [extents, orientation]: [Option<u16>; 2], slots: usize) -> Self {
        Self {
            settings,
            extents,
            orientation,
            hands: Hands::new(),
            carried: vec![Carried::NotSought; slots].into_boxed_slice(),
            placed: vec![(0, [0.0; 3]); slots].into_boxed_slice(),
        }
    }

    pub(super) fn carried(&self, slot: u32) -> Carried {
        self.carried.get(slot as usize).copied().unwrap_or(Carried::NotSought)
    }

    /// Whether one thing is another, or moves with it through any number of carriers.
    pub(super) fn moves_with(&self, slot: u32, other: u32) -> bool {
        let mut at = slot;
        for _ in 0..self.carried.len() {
            if at == other {
                return true;
            }
            match self.carried(at) {
                Carried::By {
                    carrier: Carrier::Container { slot, .. } | Carrier::Support { slot, .. },
                    ..
                } => {
                    at = slot;
                }
                Carried::NotSought | Carried::ByNothing | Carried::By { carrier: Carrier::Hand(_), .. } => {
                    return false;
                }
            }
        }
        true
    }

    /// Where the belief with an identity in a slot was expected at the end of the last step.
    pub(super) fn placed(&self, slot: u32, id: u64) -> Option<[f32; 3]> {
        let (of, place_m) = *self.placed.get(slot as usize)?;
        (of == id).then_some(place_m)
    }

    /// Expresses all of it in another frame. `position` maps a position, `turned` a difference of two.
    pub(super) fn reanchor(
        &mut self,
        position: impl Fn([f32; 3]) -> [f32; 3],
        turned: impl Fn([f32; 3]) -> [f32; 3],
    ) {
        for carried in &mut self.carried {
            if let Carried::By { offset_m, .. } = carried {
                *offset_m = turned(*offset_m);
            }
        }
        for (_, place_m) in &mut self.placed {
            *place_m = position(*place_m);
        }
        self.hands.reanchor(position, turned);
    }
}

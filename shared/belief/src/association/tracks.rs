use clock::Instant;
use invariant::require;
use message::Observation;
use quantity::number::single;

use super::settings::Tracking;
use super::track::{Motion, Sighting, Track};

/// The least standard deviation of an observed position, in metres. The square of a smaller one may round to zero, and a
/// filter of two exact positions has no gain.
const MIN_POSITION_SD_M: f32 = 1e-6;

/// The track of the belief in each slot.
#[derive(Clone, Debug)]
pub(crate) struct Tracks {
    pub(crate) settings: Tracking,
    /// `None` for a belief whose position was never observed.
    tracks: Box<[Option<Track>]>,
}

impl Tracks {
    pub(crate) fn new(settings: Tracking, slots: usize) -> Self {
        Self { settings, tracks: vec![None; slots].into_boxed_slice() }
    }

    /// The sighting that an observation with this position is. Where the observation states no standard deviation, it is
    /// the configured one. It is at least a share of the thing's longest side, because the centre of a large thing is
    /// known less well.
    #[inline]
    pub(crate) fn sighting(&self, at: Instant, position_m: [f32; 3], observation: &Observation) -> Sighting {
        let half_m = observation.half_extents_m.iter().fold(0.0, |most: f32, half_m| most.max(*half_m));
        let of_size_m = single(self.settings.position_sd_of_size) * 2.0 * half_m;
        let default_m = single(self.settings.position_sd_m);
        let variance_m2 = observation.position_sd_m.map(|stated_m| {
            let sd_m = if stated_m > 0.0 { stated_m } else { default_m };
            sd_m.max(of_size_m).max(MIN_POSITION_SD_M).powi(2)
        });
        Sighting { at, position_m, variance_m2 }
    }

    /// Starts the track of a new belief.
    #[inline]
    pub(crate) fn begin(&mut self, slot: u32, sighting: Option<Sighting>) {
        if let Some(track) = require!(self.tracks.get_mut(slot as usize), "slot {slot} exists") {
            *track = sighting.map(|sighting| Track::new(&sighting, &self.settings));
        }
    }

    /// Adds a sighting to a track; returns its new position.
    #[inline]
    pub(crate) fn add(&mut self, slot: u32, sighting: &Sighting) -> Option<[f32; 3]> {
        let Self { settings, tracks } = self;
        let track = require!(tracks.get_mut(slot as usize), "slot {slot} exists")?;
        match track {
            Some(track) => track.add(sighting, settings),
            None => *track = Some(Track::new(sighting, settings)),
        }
        track.map(|track| track.position_m(track.at(), settings))
    }

    /// Merges the track in `gone` into the one in `kept`; returns its new position.
    pub(crate) fn merge(&mut self, kept: u32, gone: u32) -> Option<[f32; 3]> {
        let Self { settings, tracks } = self;
        let other = require!(tracks.get(gone as usize), "slot {gone} exists").copied().flatten();
        let track = require!(tracks.get_mut(kept as usize), "slot {kept} exists")?;
        *track = match (*track, other) {
            (Some(track), Some(other)) => Some(track.merged(other, settings)),
            (one, other) => one.or(other),
        };
        track.map(|track| track.position_m(track.at(), settings))
    }

    /// The position expected at an instant.
    #[inline]
    pub(crate) fn position_m(&self, slot: u32, instant: Instant) -> Option<[f32; 3]> {
        Some(self.get(slot)?.position_m(instant, &self.settings))
    }

    /// The motion expected at an instant.
    pub(crate) fn motion(&self, slot: u32, instant: Instant) -> Option<Motion> {
        Some(self.get(slot)?.motion(instant, &self.settings))
    }

    /// How far a new belief, which is one sighting, is from an older track, as a share of the gate: the smaller of the
    /// Mahalanobis distance from the expected position, and of the distance from the last sighting, for a thing that
    /// stopped, whose gate is `metres`. `None` if the older one has not been seen for the coasting time or longer: it
    /// may be anywhere.
    pub(crate) fn share_of_gate(&self, old: u32, fresh: u32, metres: f64) -> Option<f64> {
        let (track, sighting) = (self.get(old)?, self.get(fresh)?.last_sighting());
        let is_recent = sighting.at.since(track.at()) < self.settings.coast;
        let of_motion = track.squared_mahalanobis(&sighting, &self.settings).sqrt() / self.settings.gate_sd;
        let seen_m = track.last_sighting().position_m;
        let of_rest = quantity::distance(&seen_m, &sighting.position_m) / metres;
        is_recent.then(|| of_motion.min(of_rest))
    }

    /// Like [`Self::share_of_gate`], for a thing that is out of view: the distance of the new belief from its way. `None`
    /// if the thing does not move, or was not seen for too long.
    pub(crate) fn share_along_way(&self, old: u32, fresh: u32, metres: f64) -> Option<f64> {
        let (track, sighting) = (self.get(old)?, self.get(fresh)?.last_sighting());
        if sighting.at.since(track.at()) > self.settings.reappear {
            return None;
        }
        Some(track.distance_from_way_m(sighting.position_m, sighting.at)? / metres)
    }

    /// Moves a track with what carries the thing: see [`Track::carry`].
    pub(crate) fn carry(
        &mut self,
        slot: u32,
        instant: Instant,
        position_m: [f32; 3],
        velocity_m_s: [f32; 3],
    ) {
        if let Some(Some(track)) = require!(self.tracks.get_mut(slot as usize), "slot {slot} exists") {
            track.carry(instant, position_m, velocity_m_s);
        }
    }

    /// The instant of the last sighting.
    pub(crate) fn at(&self, slot: u32) -> Option<Instant> {
        Some(self.get(slot)?.at())
    }

    /// Expresses a track in another frame: see [`Track::moved`].
    pub(crate) fn reanchor(
        &mut self,
        slot: u32,
        position: impl Fn([f32; 3]) -> [f32; 3],
        rotation: &[[f64; 3]; 3],
    ) {
        if let Some(Some(track)) = require!(self.tracks.get_mut(slot as usize), "slot {slot} exists") {
            *track = track.moved(position, rotation);
        }
    }

    #[inline]
    fn get(&self, slot: u32) -> Option<&Track> {
        require!(self.tracks.get(slot as usize), "slot {slot} exists")?.as_ref()
    }
}

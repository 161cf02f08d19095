use clock::Instant;
use servo::table::GOAL_POSITION;
use servo::{Address, Instruction, Reading};

use crate::job::Job;
use crate::joint::Joint;
use crate::request::SERVOS_MOST;
use crate::{Replies, Request};

/// Exchanges in which nobody on the bus answers before its servos are blamed one by one: until
/// then it is the bus, or the machine, that is slow.
const SILENT_MOST: u32 = 10;
/// The lengths of reading rotate over so many values: an answer that comes a cycle late has
/// another length than the one that is awaited, and is dropped for it.
const ROTATION: u16 = 3;

/// One bus: what it was asked, and by it what its answers mean.
#[derive(Clone, Debug)]
pub(crate) struct Bus {
    /// Indices of its joints.
    joints: Vec<usize>,
    /// Those whose positions were asked for, in this order.
    asked: Vec<usize>,
    asked_length: u16,
    job: Option<(usize, Job)>,
    /// The place among the joints where the search for the next job begins.
    next: usize,
    cycle: u16,
    silent: u32,
    /// Answers dropped because nobody awaited them.
    stale: u64,
}

impl Bus {
    pub(crate) fn new(joints: Vec<usize>) -> Self {
        let asked = Vec::with_capacity(joints.len());
        Self { joints, asked, asked_length: 0, job: None, next: 0, cycle: 0, silent: 0, stale: 0 }
    }

    pub(crate) const fn stale(&self) -> u64 {
        self.stale
    }

    /// Writes what the bus is told and asked in this cycle; `may_arm` says whether the torque of
    /// a group's joints may come on.
    pub(crate) fn plan(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        may_arm: impl Fn(usize) -> bool,
        request: &mut Request,
    ) {
        request.clear();
        self.cycle = (self.cycle + 1) % ROTATION;
        self.asked_length = Reading::ITEM.length + self.cycle;
        self.asked.clear();
        let mut ids = Few::<SERVOS_MOST>::default();
        let mut records = Few::<{ 5 * SERVOS_MOST }>::default();
        for &index in &self.joints {
            let Some(joint) = joints.get(index).filter(|joint| joint.is_read()) else { continue };
            self.asked.push(index);
            ids.push(&[joint.id().get()]);
            if let Some(count) = joint.command_count() {
                records.push(&[joint.id().get()]);
                records.push(&count.to_le_bytes());
            }
        }
        if !self.asked.is_empty() {
            request.add(self.asked.len(), usize::from(self.asked_length), |out| {
                goals_and_question(records.get(), ids.get(), self.asked_length, out)
            });
        }
        self.job = self.find_job(now, joints, may_arm);
        if let Some((index, job)) = self.job
            && let Some(joint) = joints.get(index)
        {
            request.add(1, job.answer_length(), |out| job.encode(joint.id(), out));
        }
    }

    /// Takes what the bus answered to the last plan.
    pub(crate) fn digest(&mut self, now: Instant, joints: &mut [Joint], replies: &Replies) {
        let (asked, job) = (std::mem::take(&mut self.asked), self.job.take());
        if replies.lost.is_some() {
            for &index in &self.joints {
                if let Some(joint) = joints.get_mut(index) {
                    joint.lost(now);
                }
            }
        } else if !asked.is_empty() || job.is_some() {
            self.silent = if replies.is_empty() { self.silent.saturating_add(1) } else { 0 };
            let missing = self.take_readings(now, joints, replies, &asked);
            let job_part = usize::from(!asked.is_empty());
            self.take_answer(now, joints, replies, job.map(|(index, job)| (index, job, job_part)), missing);
        }
        // The list's memory is used again in the next cycle.
        self.asked = asked;
        self.asked.clear();
    }

    /// Takes the positions, and returns who on the bus did not tell his.
    fn take_readings(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        replies: &Replies,
        asked: &[usize],
    ) -> Option<usize> {
        let mut told = [false; SERVOS_MOST];
        if !asked.is_empty() {
            for answer in replies.of_part(0) {
                let status = answer.status();
                let place = asked
                    .iter()
                    .position(|&index| joints.get(index).is_some_and(|joint| joint.id() == status.id));
                let long_enough =
                    status.params.len() == usize::from(self.asked_length) || status.fault.is_some();
                let joint = place.and_then(|place| joints.get_mut(*asked.get(place)?));
                match (place.and_then(|place| told.get_mut(place)), joint) {
                    (Some(told), Some(joint)) if long_enough && !*told => {
                        *told = true;
                        joint.read(now, &status);
                    }
                    _ => self.stale += 1,
                }
            }
        }
        let mut missing = None;
        for (&index, _) in asked.iter().zip(&told).filter(|(_, told)| !**told) {
            missing = Some(index);
            if self.blames_servos()
                && let Some(joint) = joints.get_mut(index)
            {
                joint.missed(now);
            }
        }
        missing
    }

    /// Takes the answer to the job. A servo that did not tell its position either has been noted
    /// as silent already.
    fn take_answer(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        replies: &Replies,
        job: Option<(usize, Job, usize)>,
        missing: Option<usize>,
    ) {
        let Some((index, job, part)) = job else { return };
        let Some(joint) = joints.get_mut(index) else { return };
        let mut answers = replies.of_part(part).map(crate::request::Answer::status);
        let awaited = answers.find(|status| {
            let length = status.params.len();
            status.id == joint.id() && (length == job.answer_length() || status.fault.is_some())
        });
        match awaited {
            Some(status) => joint.answered(now, job, &status),
            None if missing != Some(index) && self.blames_servos() => joint.missed(now),
            None => {}
        }
    }

    const fn blames_servos(&self) -> bool {
        self.silent == 0 || self.silent > SILENT_MOST
    }

    /// The next job on the way up or down, of one joint after the other; without any, a look at
    /// how one servo is.
    fn find_job(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        may_arm: impl Fn(usize) -> bool,
    ) -> Option<(usize, Job)> {
        let count = self.joints.len();
        let places = (self.next..count).chain(0..self.next);
        for place in places {
            let Some(joint) = self.joints.get(place).and_then(|&index| joints.get_mut(index)) else {
                continue;
            };
            if let Some(job) = joint.job(now, may_arm(joint.group())) {
                self.next = (place + 1) % count;
                return Some((*self.joints.get(place)?, job));
            }
        }
        self.next = (self.next + 1) % count.max(1);
        let index = *self.joints.get(self.next)?;
        joints.get(index)?.is_read().then_some((index, Job::Look))
    }
}

/// The goals of this cycle, which nobody answers, and behind them the question for positions.
fn goals_and_question(records: &[u8], ids: &[u8], length: u16, out: &mut [u8]) -> usize {
    let goals =
        Instruction::SyncWrite { address: GOAL_POSITION.address, length: GOAL_POSITION.length, records };
    let question = Instruction::SyncRead { address: Reading::ITEM.address, length, ids };
    let told = if records.is_empty() { Ok(0) } else { goals.encode(Address::All, out) };
    let Ok(told) = told else { return 0 };
    let asked = question.encode(Address::All, out.get_mut(told..).unwrap_or_default());
    asked.map_or(0, |asked| told + asked)
}

/// A few bytes on the stack.
struct Few<const MOST: usize> {
    bytes: [u8; MOST],
    end: usize,
}

impl<const MOST: usize> Default for Few<MOST> {
    fn default() -> Self {
        Self { bytes: [0; MOST], end: 0 }
    }
}

impl<const MOST: usize> Few<MOST> {
    fn push(&mut self, bytes: &[u8]) {
        if let Some(place) = self.bytes.get_mut(self.end..self.end + bytes.len()) {
            place.copy_from_slice(bytes);
            self.end += bytes.len();
        }
    }

    fn get(&self) -> &[u8] {
        self.bytes.get(..self.end).unwrap_or_default()
    }
}

use arrayvec::ArrayVec;
use clock::{Duration, Instant};
use invariant::{invariant, require};
use message::BusHealth;
use serial::LineLostError;
use servo::table::{GOAL_POSITION, PROFILE_VELOCITY, TORQUE_ENABLE};
use servo::{Address, Id, Instruction, Reading, Status};

use crate::duplicate_id_check::ProbeResult;
use crate::job::{CONDITION, Job, READING_WITH_SUPPLY};
use crate::joint::{Command, Joint};
use crate::request::{MAX_SERVOS, PartKind, STATUS_BYTES};
use crate::{Replies, Request};

/// Exchanges without any answer on the bus before a missing answer counts against its servo. Until then the bus, or the
/// machine, is taken to be slow. The counter `missed` of the bus counts every missing answer.
const MAX_SILENT_EXCHANGES: u32 = 10;
/// Consecutive exchanges with late bytes in which no missing answer counts against its servo. Until the reply timeout
/// has grown, the line is taken to be slow.
const MAX_LATE_EXCHANGES: u32 = 6;
/// Number of read lengths. Until the bus is clean, the read length cycles through these values. So a late reply to an
/// earlier request is detected by its length. The extra bytes follow the measurements in the control table. On a
/// clean bus every reply arrived before the next request, so no late reply can be outstanding.
const READ_LENGTHS: u16 = 12;
/// Extra bytes with which the measurements contain input voltage and temperature: the longest of the read lengths. A
/// clean bus reads them twice a second. A read of its own for each servo would take more than twice the time on the
/// wire.
const SUPPLY_LENGTH: u16 = READING_WITH_SUPPLY.length - Reading::ITEM.length;
const _: () = assert!(SUPPLY_LENGTH == READ_LENGTHS - 1, "a bus that is not clean reads them too");
const SUPPLY_PERIOD: Duration = Duration::from_millis(500);
/// A bus is clean after this many consecutive exchanges without missing, corrupt, late or repeated reads.
const MIN_CLEAN_EXCHANGES: u32 = 24;
/// Period of the request rotation. With torque off, one request in this many reads positions. Otherwise, in one
/// request in this many a due condition read precedes the other jobs.
const ROUNDS: usize = 3;
/// How often the broadcast of torque off is repeated in one request.
const BROADCASTS: usize = 3;

/// Operating mode of a bus in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Drive the joints; torque may come on in groups up to `arm_up_to`.
    Drive {
        /// The last group whose torque may come on, if any.
        arm_up_to: Option<usize>,
    },
    /// Switch torque off on every servo.
    TorqueOff,
}

/// One bus: its last request, and the interpretation of the replies to it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bus {
    joints: Vec<usize>,
    /// Whether its servos are simulated by the mock servo bus.
    pub(crate) is_simulated: bool,
    /// Joints read in the last request, in the order of their answers, and the kind of part.
    asked: Vec<(usize, PartKind)>,
    asked_length: u16,
    job: Option<(usize, Job)>,
    /// Position in `joints` at which the search for the next job begins.
    next: usize,
    /// Extra bytes read behind the measurements.
    extra_bytes: u16,
    supply_due_at: Instant,
    /// Request counter modulo [`ROUNDS`].
    round: usize,
    /// Consecutive exchanges with every reply and nothing else.
    clean_exchanges: u32,
    silent: u32,
    /// Consecutive exchanges with late bytes.
    late: u32,
    /// Whether the line is lost.
    pub(crate) is_lost: bool,
    /// Whether it is lost because its other end was closed.
    pub(crate) has_hung_up: bool,
    /// What the bus counts itself; the faults of its servos are counted by joint.
    pub(crate) counts: BusHealth,
}

impl Bus {
    pub(crate) fn new(joints: Vec<usize>, is_simulated: bool) -> Self {
        Self { asked: Vec::with_capacity(joints.len()), joints, is_simulated, ..Self::default() }
    }

    /// Writes the request of this cycle.
    pub(crate) fn plan(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        purpose: Purpose,
        request: &mut Request,
    ) {
        request.clear();
        self.round = (self.round + 1) % ROUNDS;
        self.extra_bytes = if self.clean_exchanges < MIN_CLEAN_EXCHANGES {
            (self.extra_bytes + 1) % READ_LENGTHS
        } else if now >= self.supply_due_at && matches!(purpose, Purpose::Drive { .. }) {
            SUPPLY_LENGTH
        } else {
            0
        };
        if self.reads_supply() {
            self.supply_due_at = now + SUPPLY_PERIOD;
        }
        self.asked_length = Reading::ITEM.length + self.extra_bytes;
        self.asked.clear();
        self.job = None;
        match purpose {
            // Once every torque is off, one request in three reads positions. The others confirm that it stays off.
            Purpose::TorqueOff if self.round == 0 && self.have_let_go(joints) => {
                self.plan_measurements(now, joints, request);
            }
            Purpose::TorqueOff => self.plan_release(joints, request),
            Purpose::Drive { arm_up_to } => {
                self.plan_measurements(now, joints, request);
                self.plan_job(now, joints, arm_up_to, request);
            }
        }
    }

    /// Whether the measurements of this cycle contain input voltage and temperature.
    fn reads_supply(&self) -> bool {
        self.extra_bytes == SUPPLY_LENGTH
    }

    fn have_let_go(&self, joints: &[Joint]) -> bool {
        self.joints.iter().all(|&index| joint(joints, index).is_some_and(Joint::has_confirmed_torque_off))
    }

    /// Adds the goals for all servos and the read of the measurements. Servos whose firmware supports it get a fast
    /// sync read, the others a sync read.
    fn plan_measurements(&mut self, now: Instant, joints: &mut [Joint], request: &mut Request) {
        let mut goals = Goals::default();
        self.each(joints, |joint| {
            if let Some(command) = joint.command(now) {
                goals.add(joint.id, command);
            }
        });
        for (kind, fast) in [(PartKind::FastRead, true), (PartKind::PlainRead, false)] {
            let first = self.asked.len();
            // Servos that missed their last read come last, so that they cannot delay the others.
            for suspect in [false, true] {
                for &index in &self.joints {
                    let Some(joint) = joint(joints, index).filter(|joint| joint.is_read()) else { continue };
                    if joint.contact.is_fast == fast && (joint.contact.timeouts > 0) == suspect {
                        self.asked.push((index, kind));
                    }
                }
            }
            let asked = self.asked.get(first..).unwrap_or_default();
            if asked.is_empty() && (fast || goals.is_empty()) {
                continue;
            }
            let asked_ids = asked.iter().filter_map(|(index, _)| Some(joint(joints, *index)?.id));
            let (address, length) = (Reading::ITEM.address, self.asked_length);
            let goals_to_send = std::mem::take(&mut goals);
            request.add(kind, asked_ids, usize::from(length), |ids, out| {
                let question = if fast {
                    Instruction::FastSyncRead { address, length, ids }
                } else {
                    Instruction::SyncRead { address, length, ids }
                };
                let question = Some(question).filter(|_| !ids.is_empty());
                broadcast(goals_to_send.instructions().chain(question), out)
            });
        }
    }

    fn plan_job(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        arm_up_to: Option<usize>,
        request: &mut Request,
    ) {
        self.job = self.find_job(now, joints, arm_up_to);
        if let Some((index, job)) = self.job
            && let Some(joint) = joint(joints, index)
        {
            // With two servos on one identifier, two answers can arrive.
            let answers = if matches!(job, Job::DuplicateIdCheck { .. }) { 2 } else { 1 };
            let asked_ids = std::iter::repeat_n(joint.id, answers);
            request.add(job.kind(), asked_ids, job.answer_length(), |_, out| job.encode(joint.id, out));
        }
    }

    /// Adds the torque-off broadcasts, and a sync read of torque enable from each servo.
    fn plan_release(&mut self, joints: &[Joint], request: &mut Request) {
        // A silent servo can keep the servos behind it from answering. So confirmed servos come first, and the order
        // of the others rotates.
        let has_confirmed_torque_off =
            |index: usize| joint(joints, index).is_some_and(Joint::has_confirmed_torque_off);
        let first = self.round * self.joints.len() / ROUNDS;
        for confirmed in [true, false] {
            let turns = self.joints.iter().cycle().skip(first).take(self.joints.len());
            self.asked.extend(
                turns
                    .filter(|&&index| has_confirmed_torque_off(index) == confirmed)
                    .map(|&index| (index, PartKind::Torque)),
            );
        }
        let asked_ids = self.asked.iter().filter_map(|(index, _)| Some(joint(joints, *index)?.id));
        let (address, length) = (TORQUE_ENABLE.address, TORQUE_ENABLE.length + self.extra_bytes);
        let off = Instruction::Write { address, data: &[0] };
        request.add(PartKind::Torque, asked_ids, usize::from(length), |ids, out| {
            let question = Instruction::SyncRead { address, length, ids };
            broadcast(std::iter::repeat_n(off, BROADCASTS).chain([question]), out)
        });
        self.asked_length = length;
    }

    /// Processes the replies to the last plan.
    pub(crate) fn process_replies(&mut self, now: Instant, joints: &mut [Joint], replies: &Replies) {
        let (asked, job) = (std::mem::take(&mut self.asked), self.job.take());
        self.counts.exchanges += 1;
        self.counts.corrupt += u64::from(replies.noisy);
        self.counts.late_bytes += u64::try_from(replies.late).unwrap_or(u64::MAX);
        if let Some(lost) = replies.lost {
            self.lose(now, joints);
            self.has_hung_up = lost == LineLostError::HangUp;
        } else if !asked.is_empty() || job.is_some() {
            // The line counts as present again only after an exchange that expected answers.
            self.is_lost = false;
            self.has_hung_up = false;
            self.silent = if replies.answers.is_empty() { self.silent.saturating_add(1) } else { 0 };
            let stale = self.counts.stale;
            let heard = self.process_measurements(now, joints, replies, &asked);
            self.counts.stale += job.map_or(0, |job| strays(joints, job, replies));
            let is_late = replies.late > 0 || self.counts.stale > stale;
            self.late = if is_late { self.late.saturating_add(1) } else { 0 };
            let unheard = asked.iter().zip(&heard).filter(|(_, heard)| !**heard).map(|(asked, _)| *asked);
            let missing: ArrayVec<_, MAX_SERVOS> = unheard.take(MAX_SERVOS).collect();
            self.count_missing(now, joints, replies, &missing);
            // A servo that was read again may still answer the first request.
            let has_asked_again = replies.part(PartKind::Reread).bytes > 0;
            let is_calm = !(is_late || replies.noisy || has_asked_again) && missing.is_empty();
            self.clean_exchanges = if is_calm { self.clean_exchanges.saturating_add(1) } else { 0 };
            self.process_job_answer(now, joints, replies, job, &missing);
            for status in replies.about(PartKind::AlertCondition) {
                // A late answer to another job is no condition.
                let is_condition =
                    status.params.len() == usize::from(CONDITION.length) || status.fault.is_some();
                match self.joint_of(joints, status.id).filter(|_| is_condition) {
                    Some(joint) => joint.process_condition(now, status.params),
                    None => self.counts.stale += 1,
                }
            }
        }
        // Reuse the allocation in the next cycle.
        self.asked = asked;
        self.asked.clear();
    }

    /// Marks the line as lost.
    pub(crate) fn lose(&mut self, now: Instant, joints: &mut [Joint]) {
        self.counts.hang_ups += u64::from(!self.is_lost);
        self.is_lost = true;
        self.clean_exchanges = 0;
        self.each(joints, |joint| joint.lost(now));
    }

    /// Acts on each joint of the bus.
    fn each(&self, joints: &mut [Joint], mut act: impl FnMut(&mut Joint)) {
        for &index in &self.joints {
            joint_mut(joints, index).into_iter().for_each(&mut act);
        }
    }

    /// Processes the measurements. Returns which of the joints in `asked` have answered, by their position.
    fn process_measurements(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        replies: &Replies,
        asked: &[(usize, PartKind)],
    ) -> [bool; MAX_SERVOS] {
        let mut heard = [false; MAX_SERVOS];
        for kind in [PartKind::FastRead, PartKind::PlainRead, PartKind::Reread, PartKind::Torque] {
            for status in replies.about(kind) {
                let is_whose = |index: usize| joint(joints, index).is_some_and(|joint| joint.id == status.id);
                let asked = asked.iter().zip(&mut heard).find(|((index, _), _)| is_whose(*index));
                let is_whole = status.params.len() == usize::from(self.asked_length);
                let fits = is_whole || status.fault.is_some();
                match asked.and_then(|((index, _), heard)| Some((heard, joint_mut(joints, *index)?))) {
                    Some((heard, joint)) if fits && !*heard => {
                        *heard = true;
                        if kind == PartKind::Torque {
                            // An error in place of the data confirms nothing.
                            if let Some(torque) = status.params.first().filter(|_| is_whole) {
                                joint.confirm(now, *torque);
                            }
                        } else {
                            let is_stale = joint.read(now, replies.part(kind).asked_at, &status);
                            self.counts.stale += u64::from(is_stale);
                        }
                    }
                    _ => self.counts.stale += 1,
                }
            }
            self.counts.corrupt += u64::from(replies.part(kind).corrupt);
        }
        heard
    }

    /// Counts the missing joints: each with its index and the kind of the part that asked it.
    fn count_missing(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        replies: &Replies,
        missing: &[(usize, PartKind)],
    ) {
        for &(index, kind) in missing {
            self.counts.missed += 1;
            if self.is_prompt()
                && let Some(joint) = joint_mut(joints, index)
            {
                joint.missed(now, replies.part(kind).corrupt > 0);
            }
        }
    }

    /// Processes the answer to the job. A servo whose measurement is missing as well has already been counted.
    fn process_job_answer(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        replies: &Replies,
        job: Option<(usize, Job)>,
        missing: &[(usize, PartKind)],
    ) {
        let Some((index, job)) = job else { return };
        let Some(joint) = joint_mut(joints, index) else { return };
        self.counts.corrupt += u64::from(replies.part(job.kind()).corrupt);
        let id = joint.id;
        let fits = |status: &Status<'_>| is_answer(status, id, job);
        if let Job::DuplicateIdCheck { .. } = job {
            let came = ProbeResult {
                answers: replies.about(PartKind::Job).filter(fits).count(),
                broken: replies.part(PartKind::Job).corrupt > 0,
                too_long: replies.part(PartKind::Job).bytes > STATUS_BYTES + job.answer_length(),
            };
            if joint.process_probe(now, came) {
                self.counts.duplicates += 1;
                self.each(joints, |joint| joint.forbid(now, id));
            }
            return;
        }
        match replies.about(job.kind()).find(fits) {
            Some(status) => joint.process_answer(now, job, &status),
            None if missing.iter().all(|(missing, _)| *missing != index) && self.is_prompt() => {
                self.counts.missed += 1;
                joint.unanswered(now, job, replies.part(job.kind()).corrupt > 0);
            }
            None => {}
        }
    }

    /// Whether a missing answer is a fault of its servo: not after late or silent exchanges, which the bus may have
    /// caused.
    fn is_prompt(&self) -> bool {
        let is_slow = (1..=MAX_LATE_EXCHANGES).contains(&self.late)
            || (1..=MAX_SILENT_EXCHANGES).contains(&self.silent);
        !is_slow
    }

    fn joint_of<'a>(&self, joints: &'a mut [Joint], id: Id) -> Option<&'a mut Joint> {
        let index =
            self.joints.iter().find(|&&index| joint(joints, index).is_some_and(|joint| joint.id == id))?;
        joint_mut(joints, *index)
    }

    /// Finds the next job of setup or power switching, round-robin over the joints. A due condition read is used if
    /// there is no such job, and first in every [`ROUNDS`]th request.
    fn find_job(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        arm_up_to: Option<usize>,
    ) -> Option<(usize, Job)> {
        if self.round == 0
            && let Some(read_condition) = self.find_condition_read(now, joints)
        {
            return Some(read_condition);
        }
        let count = self.joints.len();
        // A joint under setup, or under a check for a duplicate identifier, delays torque on the whole bus. Silent
        // servos and locked joints do not.
        let unsettled = |&index: &usize| joint(joints, index).is_some_and(Joint::is_unsettled);
        let arm_up_to = arm_up_to.filter(|_| !self.joints.iter().any(unsettled));
        for place in (self.next..count).chain(0..self.next) {
            let index = *require!(self.joints.get(place), "joint {place} of {count} of the bus exists")?;
            let Some(joint) = joint_mut(joints, index) else { continue };
            let may_arm = arm_up_to.is_some_and(|last| joint.settings.group <= last);
            if let Some(job) = joint.job(now, may_arm) {
                self.next = (place + 1) % count;
                return Some((index, job));
            }
        }
        self.find_condition_read(now, joints)
    }

    /// Condition read of the servo that is most overdue. A cycle with longer measurements has none.
    fn find_condition_read(&self, now: Instant, joints: &mut [Joint]) -> Option<(usize, Job)> {
        let due = |index: usize| Some((joint(joints, index)?.condition_read_due_since(now)?, index));
        if self.reads_supply() {
            return None;
        }
        let (_, index) = self.joints.iter().filter_map(|&index| due(index)).min()?;
        Some((index, joint_mut(joints, index)?.read_condition(now)))
    }
}

/// Whether a status can be the answer of servo `id` to a job.
fn is_answer(status: &Status<'_>, id: Id, job: Job) -> bool {
    status.id == id && (status.params.len() == job.answer_length() || status.fault.is_some())
}

/// Number of answers that cannot be the answer to the job, such as late ones to an earlier job.
fn strays(joints: &[Joint], (index, job): (usize, Job), replies: &Replies) -> u64 {
    let Some(id) = joint(joints, index).map(|joint| joint.id) else { return 0 };
    replies.about(job.kind()).map(|status| u64::from(!is_answer(&status, id, job))).sum()
}

/// A joint of the body. A bus only has indices of joints that exist.
fn joint(joints: &[Joint], index: usize) -> Option<&Joint> {
    require!(joints.get(index), "joint {index} exists")
}

/// A joint of the body, to be changed.
fn joint_mut(joints: &mut [Joint], index: usize) -> Option<&mut Joint> {
    require!(joints.get_mut(index), "joint {index} exists")
}

/// Goals of a cycle. They are written without acknowledgement.
#[derive(Default)]
struct Goals {
    /// Records of identifier and goal position.
    positions: ArrayVec<u8, { 5 * MAX_SERVOS }>,
    /// Records of identifier, profile velocity and goal position; the two items are adjacent in the control table.
    with_velocities: ArrayVec<u8, { 9 * MAX_SERVOS }>,
}

impl Goals {
    fn add(&mut self, id: Id, command: Command) {
        let Command { position, velocity } = command;
        let [a, b, c, d] = position.to_le_bytes();
        let id = id.get();
        // A record that is written in part would shift the values of all servos behind it.
        let added = if let Some(velocity) = velocity {
            let [e, f, g, h] = velocity.to_le_bytes();
            self.with_velocities.try_extend_from_slice(&[id, e, f, g, h, a, b, c, d])
        } else {
            self.positions.try_extend_from_slice(&[id, a, b, c, d])
        };
        invariant!(added.is_ok(), "the goal of servo {id} fits");
    }

    fn is_empty(&self) -> bool {
        self.positions.is_empty() && self.with_velocities.is_empty()
    }

    /// The instructions that write the goals.
    fn instructions(&self) -> impl Iterator<Item = Instruction<'_>> {
        let (both, goal) = (PROFILE_VELOCITY.length + GOAL_POSITION.length, GOAL_POSITION.length);
        let all = [
            (PROFILE_VELOCITY.address, both, &self.with_velocities[..]),
            (GOAL_POSITION.address, goal, &self.positions[..]),
        ];
        let is_used = |(_, _, records): &(u16, u16, &[u8])| !records.is_empty();
        all.into_iter().filter(is_used).map(|(address, length, records)| Instruction::SyncWrite {
            address,
            length,
            records,
        })
    }
}

/// Writes instructions to all servos. Returns their length in bytes.
fn broadcast<'a>(instructions: impl Iterator<Item = Instruction<'a>>, out: &mut [u8]) -> usize {
    let mut end = 0;
    for instruction in instructions {
        let place = out.get_mut(end..).unwrap_or_default();
        let length = instruction.encode(Address::All, place).ok();
        end += require!(length, "an instruction of a cycle fits").unwrap_or(0);
    }
    end
}

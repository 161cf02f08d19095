use clock::Instant;
use servo::table::{GOAL_POSITION, PROFILE_VELOCITY, TORQUE_ENABLE};
use servo::{Address, Id, Instruction, Reading};

use crate::counts::BusCounts;
use crate::doubt::Came;
use crate::few::Few;
use crate::job::Job;
use crate::joint::{Command, Joint, Taken};
use crate::request::{SERVOS_MOST, STATUS_BYTES, Topic};
use crate::{Replies, Request};

/// Exchanges in which nobody on the bus answers before its servos are blamed one by one: until
/// then it is the bus, or the machine, that is slow.
const SILENT_MOST: u32 = 10;
/// Exchanges in a row before which bytes came after their time, in which no servo is blamed: until
/// patience has grown, it is the line that is slow.
const LATE_MOST: u32 = 6;
/// While a bus is not calm, the length of reading rotates over so many values: an answer to an earlier
/// question has another length than the one that is awaited, and is dropped for it. All of it is in the
/// control table behind the measurements. On a calm bus every answer was there when the next question
/// was asked, so that none can come later.
const LENGTHS: u16 = 12;
/// A bus is calm after so many exchanges in which nothing was missing, broken, late or asked again.
const CALM: u32 = 24;
/// Of so many requests to a bus that has let go one asks where its servos stand; of so many others in one a
/// look at how a servo is comes before what anybody is to be told.
const ROUNDS: usize = 3;
/// How often torque off is said to all at once.
const BROADCASTS: usize = 3;

/// What a bus may do in a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Drive; torque may come on in groups up to this one.
    Drive {
        /// The last group whose torque may come on, if any.
        arm_up_to: Option<usize>,
    },
    /// Switch every torque off.
    LetGo,
}

/// One bus: what it was asked, and by it what its answers mean.
#[derive(Clone, Debug)]
pub(crate) struct Bus {
    /// Indices of its joints.
    joints: Vec<usize>,
    /// Those who were asked to answer, in this order, and about what.
    asked: Vec<(usize, Topic)>,
    asked_length: u16,
    job: Option<(usize, Job)>,
    /// The place among the joints where the search for the next job begins.
    next: usize,
    /// Bytes that are read besides the measurements.
    more: u16,
    /// Counts the requests, modulo [`ROUNDS`].
    round: usize,
    /// Exchanges in a row in which everything came, and nothing else.
    calm: u32,
    silent: u32,
    /// Exchanges in a row before which bytes came after their time.
    late: u32,
    is_lost: bool,
    counts: BusCounts,
}

impl Bus {
    pub(crate) fn new(joints: Vec<usize>) -> Self {
        let asked = Vec::with_capacity(joints.len());
        Self {
            joints,
            asked,
            asked_length: 0,
            job: None,
            next: 0,
            more: 0,
            round: 0,
            calm: 0,
            silent: 0,
            late: 0,
            is_lost: false,
            counts: BusCounts::default(),
        }
    }

    pub(crate) const fn counts(&self) -> BusCounts {
        self.counts
    }

    /// Whether the line is gone.
    pub(crate) const fn is_lost(&self) -> bool {
        self.is_lost
    }

    /// Writes what the bus is told and asked in this cycle.
    pub(crate) fn plan(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        purpose: Purpose,
        request: &mut Request,
    ) {
        request.clear();
        self.round = (self.round + 1) % ROUNDS;
        self.more = if self.calm < CALM { (self.more + 1) % LENGTHS } else { 0 };
        self.asked_length = Reading::ITEM.length + self.more;
        self.asked.clear();
        self.job = None;
        match purpose {
            // Those who have let go are asked by turns whether they still do and where they are.
            Purpose::LetGo if self.round == 0 && self.have_let_go(joints) => {
                self.plan_measurements(now, joints, request);
            }
            Purpose::LetGo => self.plan_release(joints, request),
            Purpose::Drive { arm_up_to } => {
                self.plan_measurements(now, joints, request);
                self.plan_job(now, joints, arm_up_to, request);
            }
        }
    }

    fn have_let_go(&self, joints: &[Joint]) -> bool {
        self.joints.iter().all(|&index| joints.get(index).is_some_and(Joint::has_let_go))
    }

    /// Goals to all, and the question for measurements: to those who know how in one chain, to
    /// the others one by one.
    fn plan_measurements(&mut self, now: Instant, joints: &mut [Joint], request: &mut Request) {
        let mut goals = Goals::default();
        for &index in &self.joints {
            if let Some(joint) = joints.get_mut(index)
                && let Some(command) = joint.command(now)
            {
                goals.add(joint.id(), command);
            }
        }
        for (topic, fast) in [(Topic::Chain, true), (Topic::Each, false)] {
            let first = self.asked.len();
            // Those who were not heard last come last: they cannot cost the others anything then.
            for suspect in [false, true] {
                for &index in &self.joints {
                    let Some(joint) = joints.get(index).filter(|joint| joint.is_read()) else { continue };
                    if joint.is_fast() == fast && joint.is_suspect() == suspect {
                        self.asked.push((index, topic));
                    }
                }
            }
            let asked = self.asked.get(first..).unwrap_or_default();
            let who = || asked.iter().filter_map(|(index, _)| Some(joints.get(*index)?.id()));
            let ids: Few<SERVOS_MOST> = who().map(Id::get).collect();
            let (address, length) = (Reading::ITEM.address, self.asked_length);
            let question = if fast {
                Instruction::FastSyncRead { address, length, ids: ids.get() }
            } else {
                Instruction::SyncRead { address, length, ids: ids.get() }
            };
            let question = Some(question).filter(|_| !asked.is_empty());
            if question.is_none() && (fast || goals.is_empty()) {
                continue;
            }
            let told = std::mem::take(&mut goals);
            request.add(topic, who(), usize::from(length), |out| told.encode_with(question, out));
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
            && let Some(joint) = joints.get(index)
        {
            // Where two may answer, two answers are waited for.
            let answers = if matches!(job, Job::Doubt { .. }) { 2 } else { 1 };
            let who = std::iter::repeat_n(joint.id(), answers);
            request.add(job.topic(), who, job.answer_length(), |out| job.encode(joint.id(), out));
        }
    }

    /// Torque off, said to all a few times, and the question to each whether it is; and where
    /// those stand who have said so.
    fn plan_release(&mut self, joints: &[Joint], request: &mut Request) {
        // A silent servo may keep those behind it from answering: who has confirmed comes first, and
        // the others take turns.
        let has_let_go = |index: usize| joints.get(index).is_some_and(Joint::has_let_go);
        let first = self.round * self.joints.len() / ROUNDS;
        for confirmed in [true, false] {
            let turns = self.joints.iter().cycle().skip(first).take(self.joints.len());
            self.asked.extend(
                turns.filter(|&&index| has_let_go(index) == confirmed).map(|&index| (index, Topic::Torque)),
            );
        }
        let who = || self.asked.iter().filter_map(|(index, _)| Some(joints.get(*index)?.id()));
        let ids: Few<SERVOS_MOST> = who().map(Id::get).collect();
        let length = TORQUE_ENABLE.length + self.more;
        let off = Instruction::Write { address: TORQUE_ENABLE.address, data: &[0] };
        let question = Instruction::SyncRead { address: TORQUE_ENABLE.address, length, ids: ids.get() };
        self.asked_length = length;
        request.add(Topic::Torque, who(), usize::from(length), |out| {
            let mut end = 0;
            for instruction in std::iter::repeat_n(off, BROADCASTS).chain([question]) {
                let place = out.get_mut(end..).unwrap_or_default();
                end += instruction.encode(Address::All, place).unwrap_or(0);
            }
            end
        });
    }

    /// Takes what the bus answered to the last plan.
    pub(crate) fn digest(&mut self, now: Instant, joints: &mut [Joint], replies: &Replies) {
        let (asked, job) = (std::mem::take(&mut self.asked), self.job.take());
        self.counts.exchanges += 1;
        self.counts.broken += u64::from(replies.noisy);
        self.counts.late_bytes += u64::try_from(replies.late).unwrap_or(u64::MAX);
        if replies.lost.is_some() {
            self.lose(now, joints);
        } else if !asked.is_empty() || job.is_some() {
            // Only who says something can find that the line is there again.
            self.is_lost = false;
            self.silent = if replies.is_empty() { self.silent.saturating_add(1) } else { 0 };
            let stale = self.counts.stale;
            let heard = self.take_all(now, joints, replies, &asked);
            let is_late = replies.late > 0 || self.counts.stale > stale;
            self.late = if is_late { self.late.saturating_add(1) } else { 0 };
            let missing = self.blame(now, joints, replies, &asked, &heard);
            // Whom a second question reached may still answer the first.
            let has_asked_again = replies.heard(Topic::Again) > 0;
            let is_calm =
                !(is_late || replies.noisy || has_asked_again || missing.iter().any(Option::is_some));
            self.calm = if is_calm { self.calm.saturating_add(1) } else { 0 };
            self.take_answer(now, joints, replies, job, missing);
            for status in replies.about(Topic::Alarm) {
                if let Some(joint) = self.joint_of(joints, status.id) {
                    joint.alarmed(now, &status);
                }
            }
        }
        for &index in &self.joints {
            if let Some(joint) = joints.get_mut(index) {
                self.counts.incidents.add(joint.take_incidents());
            }
        }
        // The list's memory is used again in the next cycle.
        self.asked = asked;
        self.asked.clear();
    }

    /// Notes that the line is gone.
    pub(crate) fn lose(&mut self, now: Instant, joints: &mut [Joint]) {
        self.counts.hang_ups += u64::from(!self.is_lost);
        self.is_lost = true;
        self.calm = 0;
        for &index in &self.joints {
            if let Some(joint) = joints.get_mut(index) {
                joint.lost(now);
            }
        }
    }

    /// Takes what all were asked: who was heard, by their place among those asked.
    fn take_all(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        replies: &Replies,
        asked: &[(usize, Topic)],
    ) -> [bool; SERVOS_MOST] {
        let mut heard = [false; SERVOS_MOST];
        for topic in [Topic::Chain, Topic::Each, Topic::Again, Topic::Torque] {
            for status in replies.about(topic) {
                let is_whose = |index: usize| joints.get(index).is_some_and(|joint| joint.id() == status.id);
                let place = asked.iter().position(|(index, _)| is_whose(*index));
                let joint = place.and_then(|place| joints.get_mut(asked.get(place)?.0));
                let fits = status.params.len() == usize::from(self.asked_length) || status.fault.is_some();
                match (place.and_then(|place| heard.get_mut(place)), joint) {
                    (Some(heard), Some(joint)) if fits && !*heard => {
                        *heard = true;
                        if topic == Topic::Torque {
                            if let Some(torque) = status.params.first() {
                                joint.confirm(now, *torque);
                            }
                        } else if joint.read(now, replies.asked_at(topic), &status) == Taken::Stale {
                            self.counts.stale += 1;
                        }
                    }
                    _ => self.counts.stale += 1,
                }
            }
            self.counts.broken += u64::from(replies.spoilt(topic));
        }
        heard
    }

    /// Notes who was asked and not heard, and returns them.
    fn blame(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        replies: &Replies,
        asked: &[(usize, Topic)],
        heard: &[bool; SERVOS_MOST],
    ) -> [Option<usize>; SERVOS_MOST] {
        let mut missing = [None; SERVOS_MOST];
        for ((&(index, topic), _), place) in
            asked.iter().zip(heard).filter(|(_, heard)| !**heard).zip(&mut missing)
        {
            *place = Some(index);
            self.counts.missed += 1;
            if self.blames_servos()
                && let Some(joint) = joints.get_mut(index)
            {
                joint.missed(now, replies.spoilt(topic) > 0);
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
        job: Option<(usize, Job)>,
        missing: [Option<usize>; SERVOS_MOST],
    ) {
        let Some((index, job)) = job else { return };
        let Some(joint) = joints.get_mut(index) else { return };
        self.counts.broken += u64::from(replies.spoilt(job.topic()));
        let fits = |status: &servo::Status<'_>| {
            let length = status.params.len();
            status.id == joint.id() && (length == job.answer_length() || status.fault.is_some())
        };
        if let Job::Doubt { .. } = job {
            let came = Came {
                answers: replies.about(Topic::Job).filter(fits).count(),
                broken: replies.spoilt(Topic::Job) > 0,
                too_long: replies.heard(Topic::Job) > STATUS_BYTES + job.answer_length(),
            };
            if joint.doubted(now, came) {
                self.counts.duplicates += 1;
                let id = joint.id();
                for &index in &self.joints {
                    if let Some(joint) = joints.get_mut(index) {
                        joint.forbid(now, id);
                    }
                }
            }
            return;
        }
        match replies.about(job.topic()).find(fits) {
            Some(status) => joint.answered(now, job, &status),
            None if !missing.contains(&Some(index)) && self.blames_servos() => {
                self.counts.missed += 1;
                joint.unanswered(now, job, replies.spoilt(job.topic()) > 0);
            }
            None => {}
        }
    }

    fn blames_servos(&self) -> bool {
        let is_slow = (1..=LATE_MOST).contains(&self.late) || (1..=SILENT_MOST).contains(&self.silent);
        !is_slow
    }

    fn joint_of<'a>(&self, joints: &'a mut [Joint], id: Id) -> Option<&'a mut Joint> {
        let index =
            self.joints.iter().find(|&&index| joints.get(index).is_some_and(|joint| joint.id() == id))?;
        joints.get_mut(*index)
    }

    /// The next job on the way up or down, of one joint after the other; without any, and now and then
    /// before it, a look at how one servo is, where it is time for it.
    fn find_job(
        &mut self,
        now: Instant,
        joints: &mut [Joint],
        arm_up_to: Option<usize>,
    ) -> Option<(usize, Job)> {
        if self.round == 0
            && let Some(look) = self.find_look(now, joints)
        {
            return Some(look);
        }
        let count = self.joints.len();
        // Torque comes on where it is known who is there.
        let unsettled = |&index: &usize| joints.get(index).is_some_and(Joint::is_unsettled);
        let arm_up_to = arm_up_to.filter(|_| !self.joints.iter().any(unsettled));
        for place in (self.next..count).chain(0..self.next) {
            let index = *self.joints.get(place)?;
            let Some(joint) = joints.get_mut(index) else { continue };
            let may_arm = arm_up_to.is_some_and(|last| joint.group() <= last);
            if let Some(job) = joint.job(now, may_arm) {
                self.next = (place + 1) % count;
                return Some((index, job));
            }
        }
        self.find_look(now, joints)
    }

    /// A look at the servo for which it has been time the longest.
    fn find_look(&self, now: Instant, joints: &mut [Joint]) -> Option<(usize, Job)> {
        let due = |index: usize| Some((joints.get(index)?.look_due(now)?, index));
        let (_, index) = self.joints.iter().filter_map(|&index| due(index)).min()?;
        Some((index, joints.get_mut(index)?.look(now)))
    }
}

/// The goals of a cycle, which are not acknowledged.
#[derive(Default)]
struct Goals {
    /// Identifiers and goal positions.
    positions: Few<{ 5 * SERVOS_MOST }>,
    /// Identifiers, velocities of the profile, and the goal positions that stand behind them in the control table.
    with_velocities: Few<{ 9 * SERVOS_MOST }>,
}

impl Goals {
    fn add(&mut self, id: Id, command: Command) {
        let Command { position, velocity } = command;
        if let Some(velocity) = velocity {
            self.with_velocities.push(&[id.get()]);
            self.with_velocities.push(&velocity.to_le_bytes());
            self.with_velocities.push(&position.to_le_bytes());
        } else {
            self.positions.push(&[id.get()]);
            self.positions.push(&position.to_le_bytes());
        }
    }

    fn is_empty(&self) -> bool {
        self.positions.get().is_empty() && self.with_velocities.get().is_empty()
    }

    /// Writes the goals, and behind them the question for measurements; returns their length in bytes.
    fn encode_with(&self, question: Option<Instruction<'_>>, out: &mut [u8]) -> usize {
        let write = |address, length, records| Instruction::SyncWrite { address, length, records };
        let (both, goal) = (PROFILE_VELOCITY.length + GOAL_POSITION.length, GOAL_POSITION.length);
        let with_velocities = self.with_velocities.get();
        let positions = self.positions.get();
        let with_velocities =
            (!with_velocities.is_empty()).then(|| write(PROFILE_VELOCITY.address, both, with_velocities));
        let positions = (!positions.is_empty()).then(|| write(GOAL_POSITION.address, goal, positions));
        let mut end = 0;
        for instruction in with_velocities.into_iter().chain(positions).chain(question) {
            let place = out.get_mut(end..).unwrap_or_default();
            end += instruction.encode(Address::All, place).unwrap_or(0);
        }
        end
    }
}

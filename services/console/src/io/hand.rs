//! Forwards the pages' acts to the simulator, and the simulator's answers to the pages.

use clock::{Duration, Instant};
use message::{ActAnswer, ActsAnswered, Header, TeacherAct, TeacherActKind, TeacherActs, Topic as _};
use process::{ProcessError, ProcessNode};
use transport::{FramePublisher, FrameSubscriber};

use crate::io::requester::{QueuedRequest, Requester};
use crate::requests::PageRequest;

/// Maximum number of acts in a frame.
const MAX_ACTS_PER_FRAME: usize = TeacherActs::ROW.capacity.entries(0, 0);
/// Time-out of an answer of the simulator.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);

/// Acts of all pages, with those that wait for an answer.
pub(crate) struct PendingActs {
    acts: FramePublisher<TeacherActs>,
    answered: FrameSubscriber<ActsAnswered>,
    serial: u64,
    waiting: Vec<Waiting>,
    /// File of the lesson that was saved last.
    pub(crate) saved: Option<String>,
}

struct Waiting {
    serial: u64,
    kind: Option<TeacherActKind>,
    since: Instant,
    requester: Requester,
}

impl PendingActs {
    pub(crate) fn open(member: &ProcessNode) -> Result<Self, ProcessError> {
        let mut acts = member.publisher::<TeacherActs>(None, MAX_ACTS_PER_FRAME)?;
        // An empty frame tells the simulator of the new incarnation: what the hands of the old one held goes back.
        acts.send_all(Header::at(member.now().as_nanos()), &[], |_| {})?;
        Ok(Self {
            acts,
            answered: member.subscriber::<ActsAnswered>(None)?,
            serial: 0,
            waiting: Vec::new(),
            saved: None,
        })
    }

    /// Sends the acts to the simulator and returns the requests that are not for it.
    pub(crate) fn forward(
        &mut self,
        now: Instant,
        has_simulator: bool,
        asked: impl Iterator<Item = QueuedRequest>,
    ) -> Result<Vec<QueuedRequest>, ProcessError> {
        let mut acts: Vec<TeacherAct> = Vec::new();
        let mut others = Vec::new();
        for asked in asked.take(MAX_ACTS_PER_FRAME) {
            let PageRequest::Act(act) = &asked.page_request else {
                others.push(asked);
                continue;
            };
            if !has_simulator {
                let why = "there is no simulator here: on a robot, things are moved by hand";
                asked.requester.answer(Err(why));
                continue;
            }
            self.serial += 1;
            let act = TeacherAct { serial: self.serial, hand: asked.page, ..**act };
            self.waiting.push(Waiting {
                serial: self.serial,
                kind: act.kind(),
                since: now,
                requester: asked.requester,
            });
            acts.push(act);
        }
        if !acts.is_empty() {
            self.acts.send_all(Header::at(now.as_nanos()), &acts, |_| {})?;
        }
        Ok(others)
    }

    /// Forwards the simulator's answers to the pages and reports time-outs.
    pub(crate) fn answer(&mut self, now: Instant) -> Result<(), ProcessError> {
        while let Some(frame) = self.answered.receive()? {
            for answer in frame.entries() {
                let Some(index) = self.waiting.iter().position(|waiting| waiting.serial == answer.serial)
                else {
                    continue;
                };
                let waiting = self.waiting.swap_remove(index);
                if waiting.kind == Some(TeacherActKind::Save) && answer.refused == 0 {
                    self.saved = Some(answer.text.as_str().to_owned());
                }
                waiting.tell(answer);
            }
        }
        self.waiting.retain(|waiting| {
            let waits = now.since(waiting.since) < ANSWER_TIMEOUT;
            if !waits {
                let why = "the simulator does not answer: is it being restarted?";
                waiting.requester.answer(Err(why));
            }
            waits
        });
        Ok(())
    }

    /// Answer frames lost.
    pub(crate) fn drops(&self) -> u64 {
        self.answered.drops()
    }

    /// Frames of acts that could not be delivered to the simulator.
    pub(crate) fn undelivered(&self) -> u64 {
        self.acts.undelivered()
    }
}

impl Waiting {
    fn tell(&self, answer: &ActAnswer) {
        let text = answer.text.as_str();
        if answer.refused != 0 {
            return self.requester.answer(Err(text));
        }
        let extra = match self.kind {
            Some(TeacherActKind::Add) => Some(("thing", text)),
            Some(TeacherActKind::Save) => Some(("file", text)),
            _ => None,
        };
        self.requester.answer(Ok(extra));
    }
}

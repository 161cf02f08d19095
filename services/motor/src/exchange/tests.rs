use servo::mock::{Line, Servo};
use servo::{Address, Id, Instruction, Model, Reading};

use super::*;

/// Two servos whose answers to a question come when the next one has been asked.
struct Laggard {
    line: Line,
    now: Instant,
    late: Vec<u8>,
    there: Vec<u8>,
}

impl Port for Laggard {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, Lost> {
        self.now += Duration::from_millis(3);
        self.there = std::mem::take(&mut self.late);
        self.line.hear(self.now, bytes, &mut self.late);
        Ok(Sent { at: self.now, late: 0 })
    }

    fn receive(&mut self, into: &mut [u8], _within: Duration) -> Result<usize, Lost> {
        let there = std::mem::take(&mut self.there);
        into[..there.len()].copy_from_slice(&there);
        Ok(there.len())
    }
}

#[test]
fn a_late_answer_to_the_first_question_does_not_pass_for_a_sample_made_after_the_second() {
    let ids = [1, 2].map(|id| Id::new(id).unwrap());
    let line = Line::new(ids.map(|id| Servo::new(Model::Xm430W350, id, 0.0, Instant::EPOCH)).into());
    let mut port = Laggard { line, now: Instant::EPOCH, late: Vec::new(), there: Vec::new() };
    let (mut request, mut replies) = (Request::default(), Replies::default());
    let (address, length) = (Reading::ITEM.address, Reading::ITEM.length);
    request.add(Topic::Each, ids, usize::from(length), |out| {
        Instruction::SyncRead { address, length, ids: &[1, 2] }.encode(Address::All, out).unwrap()
    });

    let patience = Duration::from_millis(1);
    Master::new(4_000_000, (patience, patience)).exchange(&mut port, &request, &mut replies);

    let late = replies.about(Topic::Again).next().expect("it is taken");
    let sampled = Reading::parse(Model::Xm430W350, late.params).unwrap();
    assert_eq!(sampled.tick_ms, 3, "it answers what was asked after three milliseconds");
    assert_eq!(port.now, Instant::EPOCH + Duration::from_millis(6), "and was asked again");
    assert_eq!(replies.asked_at(Topic::Again), Instant::EPOCH + Duration::from_millis(3));
}

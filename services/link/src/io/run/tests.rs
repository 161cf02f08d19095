use crossbeam::channel::Sender;
use tokio::sync::mpsc::Receiver;

use super::*;

/// One of two machines; the test carries its network messages.
struct End {
    carrier: LinkRuntime,
    net: Net,
    sent: Receiver<(MessageKind, Vec<u8>)>,
    comes: Sender<Message>,
    /// The incompatibilities it reported.
    said: Vec<IncompatiblePeer>,
}

impl End {
    fn new(life_ns: u64, compatibility: Compatibility) -> Self {
        let (net, (sent, comes)) = Net::by_hand();
        let carrier = LinkRuntime::new(compatibility, &[TopicId::Events], Instant::from_nanos(life_ns));
        Self { carrier, net, sent, comes, said: Vec::new() }
    }

    fn cycle(&mut self, now: Instant) {
        let before = self.carrier.refusing;
        self.carrier.receive_and_publish(&self.net).unwrap();
        self.said.extend(self.carrier.refusing.filter(|_| self.carrier.refusing != before));
        self.carrier.listen(now);
        self.carrier.transmit(&self.net, now);
    }
}

/// Runs two ends for two seconds.
fn session(ends: &mut [End; 2]) {
    for cycle in 0..400 {
        let now = Instant::from_nanos(1_000_000_000 + cycle * 5_000_000);
        let [one, other] = &mut *ends;
        one.cycle(now);
        other.cycle(now);
        deliver(now, &mut one.sent, &other.comes);
        deliver(now, &mut other.sent, &one.comes);
    }
}

fn deliver(now: Instant, sent: &mut Receiver<(MessageKind, Vec<u8>)>, comes: &Sender<Message>) {
    while let Ok((sort, bytes)) = sent.try_recv() {
        let _full = comes.try_send(Message { sort, at: now, bytes });
    }
}

fn compatibility() -> Compatibility {
    Compatibility::of(&Robot::load(None).unwrap(), 2)
}

#[test]
fn machines_with_different_layouts_refuse_each_other_and_log_it_once() {
    let here = compatibility();
    let there = Compatibility { layouts: here.layouts ^ 1, ..here };
    let mut ends = [End::new(1, here), End::new(2, there)];
    session(&mut ends);
    let [one, other] = &ends;
    assert_eq!(one.said, [IncompatiblePeer::Meaning { here, there }]);
    assert_eq!(other.said, [IncompatiblePeer::Meaning { here: there, there: here }]);
    for end in &ends {
        assert!(end.carrier.refused() > 1, "each of their words is refused");
        assert_eq!((end.carrier.session.is_up(), end.carrier.health.received), (false, 0));
    }
}

#[test]
fn machines_with_the_same_layouts_establish_a_session() {
    let mut ends = [1, 2].map(|epoch| End::new(epoch, compatibility()));
    session(&mut ends);
    for end in &ends {
        assert!(end.carrier.session.is_up() && end.said.is_empty() && end.carrier.refused() == 0);
    }
}

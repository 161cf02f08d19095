//! The queue of one client.

use std::collections::VecDeque;

use crate::channels::Stamped;
use crate::protocol::{Outgoing, message_data, time};

/// Maximum number of queued messages of channels: about two seconds of a robot with one partner.
const MAX_MESSAGES: usize = 1024;
/// Maximum size of the queued messages of channels, in bytes.
const MAX_BYTES: usize = 8 << 20;

/// What waits for a client. Of a client that reads too slowly, the oldest messages of channels are dropped.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    /// Descriptions, warnings, and the latest messages of a channel that the client subscribed to. None is dropped.
    control: VecDeque<Outgoing>,
    messages: VecDeque<Queued>,
    bytes: usize,
    /// The present time of the robot, if it is due.
    time_ns: Option<u64>,
    dropped: u64,
}

/// A message of a channel for a subscription.
#[derive(Debug)]
struct Queued {
    subscription: u32,
    message: Stamped,
}

impl Outbox {
    pub(crate) fn control(&mut self, message: Outgoing) {
        self.control.push_back(message);
    }

    /// Whether something waits that is never dropped. The client must take it before its next request is read, so that
    /// its answers do not pile up.
    pub(crate) fn has_control(&self) -> bool {
        !self.control.is_empty()
    }

    /// Queues a message of a channel. Drops the oldest ones beyond the limits.
    pub(crate) fn message(&mut self, subscription: u32, message: Stamped) {
        self.bytes += message.bytes.len();
        self.messages.push_back(Queued { subscription, message });
        // The newest message is kept, also if it alone exceeds the limit.
        while self.messages.len() > MAX_MESSAGES || (self.bytes > MAX_BYTES && self.messages.len() > 1) {
            if let Some(oldest) = self.messages.pop_front() {
                self.bytes -= oldest.message.bytes.len();
                self.dropped += 1;
            }
        }
    }

    /// Sets the time to send. Only the newest one waits.
    pub(crate) fn time(&mut self, at_ns: u64) {
        self.time_ns = Some(at_ns);
    }

    /// Removes the messages of a subscription.
    pub(crate) fn unsubscribe(&mut self, subscription: u32) {
        self.messages.retain(|queued| queued.subscription != subscription);
        self.bytes = self.messages.iter().map(|queued| queued.message.bytes.len()).sum();
    }

    /// The next message to send, and whether it is one of a channel.
    pub(crate) fn next(&mut self) -> Option<(Outgoing, bool)> {
        if let Some(control) = self.control.pop_front() {
            return Some((control, false));
        }
        if let Some(at_ns) = self.time_ns.take() {
            return Some((time(at_ns), false));
        }
        let Queued { subscription, message } = self.messages.pop_front()?;
        self.bytes -= message.bytes.len();
        Some((message_data(subscription, message.at_ns, &message.bytes), true))
    }

    /// Number of messages of channels that were dropped.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamped(at_ns: u64, bytes: usize) -> Stamped {
        Stamped { at_ns, bytes: vec![0; bytes].into() }
    }

    #[test]
    fn a_client_that_reads_nothing_keeps_only_the_newest_messages() {
        let mut outbox = Outbox::default();
        for at_ns in 0..3000 {
            outbox.message(1, stamped(at_ns, 10));
        }
        assert_eq!((outbox.messages.len(), outbox.bytes, outbox.dropped()), (1024, 10_240, 1976));
        assert_eq!(outbox.next(), Some((message_data(1, 1976, &[0; 10]), true)));
        // The limit in bytes.
        for at_ns in 0..100 {
            outbox.message(2, stamped(at_ns, 1 << 20));
        }
        assert_eq!((outbox.messages.len(), outbox.bytes), (8, 8 << 20));
        // A message beyond the limit.
        outbox.message(3, stamped(0, 9 << 20));
        assert_eq!((outbox.messages.len(), outbox.bytes), (1, 9 << 20));
        outbox.unsubscribe(3);
        assert_eq!((outbox.next(), outbox.bytes), (None, 0));
    }

    #[test]
    fn control_messages_and_the_time_precede_messages_of_channels() {
        let mut outbox = Outbox::default();
        outbox.message(1, stamped(5, 0));
        outbox.time(4);
        outbox.time(5);
        outbox.control(Outgoing::Text("first".to_owned()));
        assert!(outbox.has_control());
        assert_eq!(outbox.next(), Some((Outgoing::Text("first".to_owned()), false)));
        assert!(!outbox.has_control());
        assert_eq!(outbox.next(), Some((time(5), false)));
        assert_eq!(outbox.next(), Some((message_data(1, 5, &[]), true)));
        assert_eq!(outbox.next(), None);
    }
}

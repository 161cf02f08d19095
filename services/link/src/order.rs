//! The topics that a link carries, and their order.

use message::{Delivery, TopicId};

/// Sort key of the publishing order of frames received at once: joint states first, so that they are there when beliefs
/// wake the learner. The others follow in the order of the data flow.
pub(crate) fn publishing_order(topic: TopicId) -> (bool, TopicId) {
    (topic != TopicId::JointStates, topic)
}

/// The topics that a link carries for a robot with `perspectives` perspectives, in the publishing order.
pub(crate) fn carried_topics(perspectives: u32) -> Vec<TopicId> {
    let mut topics: Vec<TopicId> =
        TopicId::of_robot(perspectives).filter(|topic| is_carried(*topic)).collect();
    topics.sort_by_key(|topic| publishing_order(*topic));
    topics
}

/// Whether a link carries a topic.
pub(crate) fn is_carried(topic: TopicId) -> bool {
    topic.row().delivery != Delivery::Local
}

/// Whether the writer of a topic replays to new subscribers.
pub(crate) fn is_latched(topic: TopicId) -> bool {
    topic.row().delivery == Delivery::Latched
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_carried_topics_have_their_order_and_codes() {
        let carried = carried_topics(3).into_iter().map(|topic| (topic.to_string(), topic.link_code().0));
        let known = [
            ("joint-states", 3),
            ("scene", 4),
            ("teacher-acts", 6),
            ("acts-answered", 7),
            ("utterances", 8),
            ("percepts", 0),
            ("beliefs/0", 1),
            ("beliefs/1", 1),
            ("beliefs/2", 1),
            ("divergences/1", 2),
            ("divergences/2", 2),
            ("events", 9),
            ("joint-goals", 5),
        ];
        assert_eq!(carried.collect::<Vec<_>>(), known.map(|(name, code)| (name.to_owned(), code)));
    }
}

use message::{Process, Topic, each_topic};

use crate::{FramePublisher, FrameSubscriber, Node, PortError};

macro_rules! port_functions {
    () => {
        /// As [`Node::publisher`].
        ///
        /// # Errors
        ///
        /// As [`Node::publisher`].
        fn open_publisher(
            node: &Node,
            number: Option<u32>,
            capacity: usize,
        ) -> Result<FramePublisher<Self>, PortError> {
            FramePublisher::open(node, number, capacity)
        }

        /// As [`Node::subscriber_from`], with notifications if `is_woken`.
        ///
        /// # Errors
        ///
        /// As [`Node::subscriber_from`].
        fn open_subscriber(
            node: &Node,
            number: Option<u32>,
            owner: Option<Process>,
            is_woken: bool,
        ) -> Result<FrameSubscriber<Self>, PortError> {
            FrameSubscriber::open(node, number, owner, is_woken)
        }

        /// As [`Node::existing_subscriber`].
        ///
        /// # Errors
        ///
        /// As [`Node::existing_subscriber`].
        fn open_existing_subscriber(
            node: &Node,
            number: Option<u32>,
        ) -> Result<Option<FrameSubscriber<Self>>, PortError> {
            FrameSubscriber::open_existing(node, number)
        }
    };
}

/// A topic whose ports can be opened.
///
/// An optimised build compiles a generic function again in each crate that calls it, and opening a port is a hundred
/// thousand lines of LLVM code of the middleware. So a macro repeats each default for each topic of the registry, in an
/// implementation that is not generic: the compiler compiles it in this crate only.
pub trait TopicPorts: Topic + Sized {
    port_functions!();
}

macro_rules! topic_ports {
    ($($topic:path)+) => {$(
        impl TopicPorts for $topic {
            port_functions!();
        }
    )+};
}

each_topic!(topic_ports);

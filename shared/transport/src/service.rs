//! Settings of the iceoryx2 services that publishers and subscribers of a topic must agree on.

use iceoryx2::node::Node as RawNode;
use iceoryx2::prelude::ServiceName;
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::{event, publish_subscribe};
use message::Topic;

use crate::queues::{MAX_BORROWED, MAX_PUBLISHERS, MAX_SUBSCRIBERS};
use crate::{OverflowPolicy, PortError, Queues};

/// Maximum number of nodes that use a topic, including dead ones not cleaned up yet.
const NODES: usize = 16;

/// The factory of a topic's publishers and subscribers.
pub(crate) type Frames<T> =
    publish_subscribe::PortFactory<Service, [<T as Topic>::Entry], <T as Topic>::Head>;

/// Maximum number of publishers. A configured source has one, because its subscribers cannot distinguish publishers.
fn publisher_slots<T: Topic>(number: Option<u32>) -> usize {
    if T::writer(number).is_some() { MAX_PUBLISHERS } else { 1 }
}

/// Opens or creates the service for the frames of a topic.
pub(crate) fn frame_service<T: Topic>(
    node: &RawNode<Service>,
    (topic, number): (&str, Option<u32>),
    queues: Queues,
    purpose: &'static str,
) -> Result<Frames<T>, PortError> {
    let service = node
        .service_builder(&service_name(topic, purpose)?)
        .publish_subscribe::<[T::Entry]>()
        .user_header::<T::Head>()
        .max_publishers(publisher_slots::<T>(number))
        .max_subscribers(MAX_SUBSCRIBERS)
        .max_nodes(NODES)
        .history_size(0)
        .subscriber_max_buffer_size(queues.max_queue_length())
        .subscriber_max_borrowed_samples(MAX_BORROWED)
        .enable_safe_overflow(queues.overflow_policy == OverflowPolicy::DropOldest)
        .open_or_create();
    match service {
        Ok(service) => Ok(service),
        Err(PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(
            PublishSubscribeOpenError::IncompatibleTypes,
        )) => Err(PortError::other_messages(topic, purpose)),
        Err(error) => Err(PortError::new(topic, purpose, error)),
    }
}

/// Opens the service if it exists, with its own queue settings; `None` if it does not exist.
pub(crate) fn existing_frame_service<T: Topic>(
    node: &RawNode<Service>,
    topic: &str,
) -> Result<Option<Frames<T>>, PortError> {
    let purpose = "reading";
    let service = node
        .service_builder(&service_name(topic, purpose)?)
        .publish_subscribe::<[T::Entry]>()
        .user_header::<T::Head>()
        .open();
    match service {
        Ok(service) => Ok(Some(service)),
        // It does not exist, or is being created. The caller tries again.
        Err(
            PublishSubscribeOpenError::DoesNotExist
            | PublishSubscribeOpenError::IsMarkedForDestruction
            | PublishSubscribeOpenError::HangsInCreation,
        ) => Ok(None),
        Err(PublishSubscribeOpenError::IncompatibleTypes) => Err(PortError::other_messages(topic, purpose)),
        Err(error) => Err(PortError::new(topic, purpose, error)),
    }
}

/// Opens or creates the event service that wakes the subscribers of a topic.
pub(crate) fn event_service<T: Topic>(
    node: &RawNode<Service>,
    (topic, number): (&str, Option<u32>),
    purpose: &'static str,
) -> Result<event::PortFactory<Service>, PortError> {
    node.service_builder(&service_name(topic, purpose)?)
        .event()
        .max_notifiers(publisher_slots::<T>(number))
        .max_listeners(MAX_SUBSCRIBERS)
        .max_nodes(NODES)
        .event_id_max_value(1)
        .open_or_create()
        .map_err(|error| PortError::new(topic, purpose, error))
}

pub(crate) fn service_name(topic: &str, purpose: &'static str) -> Result<ServiceName, PortError> {
    ServiceName::new(topic).map_err(|error| PortError::new(topic, purpose, error))
}

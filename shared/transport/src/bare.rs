//! Bare iceoryx2 ports without heads and counters: the reference of the benchmark.

use std::fmt;
use std::time::Duration;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::service::ipc::Service;
use iceoryx2::service::port_factory::{event, publish_subscribe};

use crate::service::service_name;
use crate::{Node, PortError, ReceiveError, SendError};

/// Publisher of bytes with a notification: one direction of a bare exchange between two processes.
pub struct BarePublisher {
    publisher: Publisher<Service, [u8], ()>,
    notifications: Notifier<Service>,
}

/// Subscriber to the bytes of a [`BarePublisher`].
pub struct BareSubscriber {
    subscriber: Subscriber<Service, [u8], ()>,
    notifications: Listener<Service>,
}

impl BarePublisher {
    /// Opens the publisher of `name` for messages of up to `size` bytes.
    ///
    /// # Errors
    ///
    /// Shared memory is exhausted, or the topic was opened with other settings.
    pub fn open(node: &Node, name: &str, size: usize) -> Result<Self, PortError> {
        let purpose = "writing";
        let (bytes, notifications) = services(node, name, purpose)?;
        let publisher = bytes.publisher_builder().initial_max_slice_len(size).create();
        let publisher = publisher.map_err(|error| PortError::new(name, purpose, error))?;
        let notifications = notifications.notifier_builder().create();
        let notifications = notifications.map_err(|error| PortError::new(name, purpose, error))?;
        Ok(Self { publisher, notifications })
    }

    /// Copies the bytes into shared memory and wakes the subscriber.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn send(&self, bytes: &[u8]) -> Result<(), SendError> {
        let failed = |reason: &dyn fmt::Debug| SendError::Failed {
            topic: "a bare exchange".to_owned(),
            reason: format!("{reason:?}"),
        };
        let sample = self.publisher.loan_slice_uninit(bytes.len()).map_err(|error| failed(&error))?;
        sample.write_from_slice(bytes).send().map_err(|error| failed(&error))?;
        self.notifications.notify().map_err(|error| failed(&error))?;
        Ok(())
    }
}

impl BareSubscriber {
    /// Opens the subscriber of `name`.
    ///
    /// # Errors
    ///
    /// Shared memory is exhausted, or the topic was opened with other settings.
    pub fn open(node: &Node, name: &str) -> Result<Self, PortError> {
        let purpose = "reading";
        let (bytes, notifications) = services(node, name, purpose)?;
        let subscriber = bytes.subscriber_builder().create();
        let subscriber = subscriber.map_err(|error| PortError::new(name, purpose, error))?;
        let notifications = notifications.listener_builder().create();
        let notifications = notifications.map_err(|error| PortError::new(name, purpose, error))?;
        Ok(Self { subscriber, notifications })
    }

    /// Waits up to `max` for a message, and reads every byte of it. Returns the sum of the bytes, or `None` if no
    /// message arrived.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn receive(&self, max: Duration) -> Result<Option<u64>, ReceiveError> {
        let failed = |reason: &dyn fmt::Debug| ReceiveError {
            topic: "a bare exchange".to_owned(),
            reason: format!("{reason:?}"),
        };
        self.notifications.timed_wait(|_| {}, max).map_err(|error| failed(&error))?;
        let sample = self.subscriber.receive().map_err(|error| failed(&error))?;
        Ok(sample.map(|sample| sample.payload().iter().map(|&byte| u64::from(byte)).sum()))
    }
}

/// The topic of an exchange's bytes, and that of its notifications.
type Services = (publish_subscribe::PortFactory<Service, [u8], ()>, event::PortFactory<Service>);

/// Opens the bytes and the notifications of an exchange.
fn services(node: &Node, name: &str, purpose: &'static str) -> Result<Services, PortError> {
    let service = service_name(name, purpose)?;
    let builder = || node.raw().service_builder(&service);
    let bytes = builder().publish_subscribe::<[u8]>().open_or_create();
    let bytes = bytes.map_err(|error| PortError::new(name, purpose, error))?;
    let notifications = builder().event().open_or_create();
    Ok((bytes, notifications.map_err(|error| PortError::new(name, purpose, error))?))
}

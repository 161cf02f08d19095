//! Metrics of the link to another machine.

use message::LinkHealth;
use quantity::number::float;

use crate::page::{Kind, MetricsText, seconds};
use crate::processes::distribution;
use crate::readings::Readings;

/// A counter of the link: family name, help text, field.
type Count = (&'static str, &'static str, fn(&LinkHealth) -> u64);

const COUNTS: [Count; 10] = [
    ("leo_link_sessions", "How often the link to the other machine was established.", |link| link.sessions),
    ("leo_link_sent_frames", "Frames handed to the network.", |link| link.sent),
    ("leo_link_overtaken_frames", "Frames not sent because a newer one came first.", |link| link.overtaken),
    ("leo_link_expired_frames", "Frames dropped after waiting too long to be sent.", |link| link.expired),
    ("leo_link_received_frames", "Frames of the other machine that were published here.", |link| {
        link.received
    }),
    ("leo_link_lost_batches", "Batches of frames that were lost on the way to this machine.", |link| {
        link.lost
    }),
    ("leo_link_refused", "Messages and frames of the other machine refused as malformed.", |link| {
        link.refused
    }),
    ("leo_link_late_commands", "Commands that came too late to be carried out.", |link| link.late),
    ("leo_link_sent_bytes", "Bytes handed to the network.", |link| link.bytes_sent),
    ("leo_link_received_bytes", "Bytes received from the other machine.", |link| link.bytes_received),
];

pub(crate) fn write(readings: &Readings, page: &mut MetricsText) {
    let Some(link) = &readings.link else { return };
    let gauges = [
        ("leo_link_up", "1 while the link to the other machine is up.", float(link.is_up)),
        (
            "leo_link_round_trip_seconds",
            "Latest round-trip time to the other machine.",
            seconds(link.round_trip_ns),
        ),
        (
            "leo_link_clock_error_seconds",
            "Maximum error of the timestamps from the other machine.",
            seconds(link.clock_error_ns),
        ),
    ];
    for (name, help, value) in gauges {
        page.family(name, Kind::Gauge, help);
        page.gauge(&[], value);
    }
    for (name, help, of) in COUNTS {
        page.family(name, Kind::Counter, help);
        page.count(&[], of(link));
    }
    let labelled = [("received", &link.delay)];
    distribution(page, "leo_link_delay", "From the other machine to this one", "direction", &labelled);
}

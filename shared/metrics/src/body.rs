//! Metrics of the servo buses and the joints.

use message::{
    BusHealth, JointCause, JointLicence, JointLink, JointMachines, JointMode, JointMotion, JointPower,
};
use quantity::number::{float, float_of_count};

use crate::page::{Kind, MetricsText};
use crate::processes::distribution;
use crate::readings::Readings;

/// A counter of a bus: family name, help text, field.
type Count = (&'static str, &'static str, fn(&BusHealth) -> u64);

const COUNTS: [Count; 3] = [
    ("leo_bus_exchanges", "Requests carried out.", |bus| bus.exchanges),
    ("leo_bus_skipped_cycles", "Cycles in which the bus was still busy with the previous cycle.", |bus| {
        bus.skipped
    }),
    ("leo_bus_late_bytes", "Bytes that arrived after the reply timeout.", |bus| bus.late_bytes),
];

/// A kind of fault: label, field.
type Fault = (&'static str, fn(&BusHealth) -> u64);

/// Faults of status packets.
const FAULTS: [Fault; 3] =
    [("missed", |bus| bus.missed), ("broken", |bus| bus.broken), ("stale", |bus| bus.stale)];

/// Incidents of a bus and its servos.
const INCIDENTS: [Fault; 6] = [
    ("alert", |bus| bus.alerts),
    ("restart", |bus| bus.restarts),
    ("watchdog", |bus| bus.watchdogs),
    ("refusal", |bus| bus.refusals),
    ("duplicate_id", |bus| bus.duplicates),
    ("hang_up", |bus| bus.hang_ups),
];

pub(crate) fn write(readings: &Readings, page: &mut MetricsText) {
    buses(&readings.buses, page);
    joints(readings, page);
}

fn buses(buses: &[BusHealth], page: &mut MetricsText) {
    type Gauge = (&'static str, &'static str, fn(&BusHealth) -> u64);
    let gauges: [Gauge; 3] = [
        ("leo_bus_lost", "1 while the line is lost.", |bus| u64::from(bus.lost != 0)),
        ("leo_bus_joints", "Joints on the bus.", |bus| bus.joints),
        ("leo_bus_quarantined_joints", "Joints whose servo does not answer.", |bus| bus.quarantined),
    ];
    for (name, help, of) in gauges {
        page.family(name, Kind::Gauge, None, help);
        for bus in buses {
            page.gauge(&[("bus", bus.name.as_str())], float(of(bus)));
        }
    }
    for (name, help, of) in COUNTS {
        page.family(name, Kind::Counter, None, help);
        for bus in buses {
            page.count(&[("bus", bus.name.as_str())], of(bus));
        }
    }
    page.family(
        "leo_bus_errors",
        Kind::Counter,
        None,
        "Replies that were missing, corrupt or of another cycle.",
    );
    for bus in buses {
        for (error, of) in FAULTS {
            page.count(&[("bus", bus.name.as_str()), ("error", error)], of(bus));
        }
    }
    page.family(
        "leo_bus_incidents",
        Kind::Counter,
        None,
        "Incidents of the servos and of the serial line, by kind.",
    );
    for bus in buses {
        for (incident, of) in INCIDENTS {
            page.count(&[("bus", bus.name.as_str()), ("incident", incident)], of(bus));
        }
    }
    let told: Vec<_> = buses.iter().map(|bus| (bus.name.as_str(), &bus.exchange)).collect();
    distribution(page, "leo_bus_exchange", "How long a request took", "bus", &told);
}

fn joints(readings: &Readings, page: &mut MetricsText) {
    if readings.joints.is_empty() {
        return;
    }
    page.family("leo_joints", Kind::Gauge, None, "Joints by their mode in the motor process.");
    for mode in JointMode::ALL {
        let count = readings.joints.iter().filter(|joint| joint.mode() == Some(*mode)).count();
        page.gauge(&[("mode", mode.name())], float_of_count(count));
    }
    page.family("leo_joints_with_fault", Kind::Gauge, None, "Joints with a fault, by the cause.");
    for cause in JointCause::ALL.iter().filter(|cause| **cause != JointCause::None) {
        let count = readings.joints.iter().filter(|joint| joint.cause() == Some(*cause)).count();
        page.gauge(&[("cause", cause.name())], float_of_count(count));
    }
    machines(readings, page);
    page.family(
        "leo_joint_position_radians",
        Kind::Gauge,
        Some("radians"),
        "Last position of the joint that was read.",
    );
    for joint in &readings.joints {
        if let Some(radians) = joint.present_position_rad() {
            page.gauge(&[("joint", &readings.joint_name(joint.joint))], radians);
        }
    }
    page.family(
        "leo_joint_temperature_celsius",
        Kind::Gauge,
        Some("celsius"),
        "Temperature inside the servo.",
    );
    for joint in &readings.joints {
        if let Some(celsius) = joint.present_temperature_c() {
            page.gauge(&[("joint", &readings.joint_name(joint.joint))], f64::from(celsius));
        }
    }
    page.family("leo_joint_input_volts", Kind::Gauge, Some("volts"), "Voltage at the servo.");
    for joint in &readings.joints {
        if let Some(volts) = joint.present_input_v() {
            page.gauge(&[("joint", &readings.joint_name(joint.joint))], f64::from(volts));
        }
    }
    page.family("leo_joint_current_amperes", Kind::Gauge, Some("amperes"), "Current through the servo.");
    for joint in &readings.joints {
        if let Some(amperes) = joint.present_current_a() {
            page.gauge(&[("joint", &readings.joint_name(joint.joint))], amperes);
        }
    }
}

/// Metrics of the joints' state machines and goals, and of the joints in trouble.
fn machines(readings: &Readings, page: &mut MetricsText) {
    let machines: Vec<JointMachines> =
        readings.joints.iter().filter_map(message::JointState::machines).collect();
    let mut gauge = |name, label, help, states: &[(&str, usize)]| {
        page.family(name, Kind::Gauge, None, help);
        for (state, count) in states {
            page.gauge(&[(label, state)], float_of_count(*count));
        }
    };
    macro_rules! counted {
        ($machine:ident, $field:ident) => {
            $machine::ALL
                .iter()
                .map(|state| {
                    (state.name(), machines.iter().filter(|machines| machines.$field == *state).count())
                })
                .collect::<Vec<_>>()
        };
    }
    gauge(
        "leo_joints_by_arming",
        "arming",
        "Joints by whether they may move.",
        &counted!(JointLicence, licence),
    );
    gauge(
        "leo_joints_by_link",
        "link",
        "Joints by the connection to their servo.",
        &counted!(JointLink, link),
    );
    gauge(
        "leo_joints_by_power",
        "power",
        "Joints by the torque of their servo.",
        &counted!(JointPower, power),
    );
    gauge("leo_joints_by_motion", "motion", "Joints by how they move.", &counted!(JointMotion, motion));
    for (name, help, count) in [
        ("leo_joint_locks", "How often a joint was locked.", readings.joint_locks),
        ("leo_goals_limited", "Goals beyond a joint's limits, which were limited.", readings.goals_limited),
        (
            "leo_goals_refused",
            "Goals that are not a number, or for an unknown joint.",
            readings.goals_refused,
        ),
    ] {
        page.family(name, Kind::Counter, None, help);
        page.count(&[], count);
    }
    page.family(
        "leo_joint_fault",
        Kind::Info,
        None,
        "The states of a joint with a fault, and why it is locked or disarmed.",
    );
    for joint in readings.joints.iter().filter(|joint| joint.is_in_trouble()) {
        let Some(machines) = joint.machines() else { continue };
        let labels = [
            ("joint", readings.joint_name(joint.joint)),
            ("link", machines.link.name().to_owned()),
            ("power", machines.power.name().to_owned()),
            ("arming", machines.licence.name().to_owned()),
            ("arming_cause", machines.licence_cause.name().to_owned()),
            ("motion", machines.motion.name().to_owned()),
        ];
        let labels = labels.each_ref().map(|(name, text)| (*name, text.as_str()));
        page.sample("_info", &labels, 1.0);
    }
}

//! Metrics of the servo buses and the joints.

use message::{
    BusHealth, JointArming, JointCause, JointLink, JointMachines, JointMode, JointMotion, JointPower,
    JointState,
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
    [("missed", |bus| bus.missed), ("corrupt", |bus| bus.corrupt), ("stale", |bus| bus.stale)];

/// Incidents of a bus and its servos.
const INCIDENTS: [Fault; 6] = [
    ("alert", |bus| bus.alerts),
    ("restart", |bus| bus.restarts),
    ("watchdog", |bus| bus.watchdogs),
    ("refusal", |bus| bus.refusals),
    ("duplicate_id", |bus| bus.duplicates),
    ("hang_up", |bus| bus.hang_ups),
];

/// A number that is read from a servo: family name, help text, field.
type Read = (&'static str, &'static str, fn(&JointState) -> Option<f64>);

const READ: [Read; 4] = [
    (
        "leo_joint_position_radians",
        "Last position of the joint that was read.",
        JointState::present_position_rad,
    ),
    ("leo_joint_temperature_celsius", "Temperature inside the servo.", |joint| {
        joint.present_temperature_c().map(f64::from)
    }),
    ("leo_joint_input_volts", "Voltage at the servo.", |joint| joint.present_input_v().map(f64::from)),
    ("leo_joint_current_amperes", "Current through the servo.", JointState::present_current_a),
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
        page.gauges(name, help, "bus", buses.iter().map(|bus| (bus.name.as_str(), float(of(bus)))));
    }
    for (name, help, of) in COUNTS {
        page.counts(name, help, "bus", buses.iter().map(|bus| (bus.name.as_str(), of(bus))));
    }
    page.family("leo_bus_errors", Kind::Counter, "Replies that were missing, corrupt or of another cycle.");
    for bus in buses {
        for (error, of) in FAULTS {
            page.count(&[("bus", bus.name.as_str()), ("error", error)], of(bus));
        }
    }
    page.family(
        "leo_bus_incidents",
        Kind::Counter,
        "Incidents of the servos and of the serial line, by kind.",
    );
    for bus in buses {
        for (incident, of) in INCIDENTS {
            page.count(&[("bus", bus.name.as_str()), ("incident", incident)], of(bus));
        }
    }
    let labelled: Vec<_> = buses.iter().map(|bus| (bus.name.as_str(), &bus.exchange)).collect();
    distribution(page, "leo_bus_exchange", "How long a request took", "bus", &labelled);
}

fn joints(readings: &Readings, page: &mut MetricsText) {
    if readings.joints.is_empty() {
        return;
    }
    let count = |is: &dyn Fn(&JointState) -> bool| {
        float_of_count(readings.joints.iter().filter(|joint| is(joint)).count())
    };
    let modes = JointMode::ALL.iter().map(|mode| (mode.name(), count(&|joint| joint.mode() == Some(*mode))));
    page.gauges("leo_joints", "Joints by their mode in the motor process.", "mode", modes);
    let causes = JointCause::ALL.iter().filter(|cause| **cause != JointCause::None);
    let causes = causes.map(|cause| (cause.name(), count(&|joint| joint.cause() == Some(*cause))));
    page.gauges("leo_joints_with_fault", "Joints with a fault, by the cause.", "cause", causes);
    machines(readings, page);
    for (name, help, of) in READ {
        let read =
            readings.joints.iter().filter_map(|joint| Some((readings.joint_name(joint.joint), of(joint)?)));
        page.gauges(name, help, "joint", read);
    }
}

/// Metrics of the joints' state machines and goals, and of the joints in trouble.
fn machines(readings: &Readings, page: &mut MetricsText) {
    let machines: Vec<JointMachines> = readings.joints.iter().filter_map(JointState::machines).collect();
    macro_rules! states {
        ($name:literal, $label:literal, $help:literal, $machine:ident, $field:ident) => {
            let count = |state: $machine| {
                float_of_count(machines.iter().filter(|machines| machines.$field == state).count())
            };
            page.gauges(
                $name,
                $help,
                $label,
                $machine::ALL.iter().map(|state| (state.name(), count(*state))),
            );
        };
    }
    states!("leo_joints_by_arming", "arming", "Joints by whether they may move.", JointArming, arming);
    states!("leo_joints_by_link", "link", "Joints by the connection to their servo.", JointLink, link);
    states!("leo_joints_by_power", "power", "Joints by the torque of their servo.", JointPower, power);
    states!("leo_joints_by_motion", "motion", "Joints by how they move.", JointMotion, motion);
    for (name, help, count) in [
        ("leo_joint_locks", "How often a joint was locked.", readings.joint_locks),
        ("leo_goals_limited", "Goals beyond a joint's limits, which were limited.", readings.goals_limited),
        (
            "leo_goals_refused",
            "Goals that are not a number, or for an unknown joint.",
            readings.goals_refused,
        ),
    ] {
        page.family(name, Kind::Counter, help);
        page.count(&[], count);
    }
    page.family(
        "leo_joint_fault",
        Kind::Info,
        "The states of a joint with a fault, and why it is locked or disarmed.",
    );
    for joint in readings.joints.iter().filter(|joint| joint.is_in_trouble()) {
        let Some(machines) = joint.machines() else { continue };
        let labels = [
            ("joint", readings.joint_name(joint.joint)),
            ("link", machines.link.name().to_owned()),
            ("power", machines.power.name().to_owned()),
            ("arming", machines.arming.name().to_owned()),
            ("arming_cause", machines.arming_cause.name().to_owned()),
            ("motion", machines.motion.name().to_owned()),
        ];
        let labels = labels.each_ref().map(|(name, text)| (*name, text.as_str()));
        page.sample("_info", &labels, 1.0);
    }
}
